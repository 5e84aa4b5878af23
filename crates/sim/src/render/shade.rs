//! Paint and light of neighbouring pixels that see the same face.

use super::SEGMENT;
use crate::scene::{Brush, Crossing, Scene, SurfacePoint, luminance};
use nalgebra::Vector3;

/// Surfaces seen at a smaller cosine are averaged as if seen at this one.
const LEAST_SLANT: f64 = 0.25;

/// Buffers of one run of pixels.
pub(super) struct Shader {
    at: [SurfacePoint; SEGMENT],
    footprint_m: [f64; SEGMENT],
    rgb: [[f64; 3]; SEGMENT],
}

impl Shader {
    pub(super) fn new() -> Self {
        let nowhere = SurfacePoint {
            normal: Vector3::zeros(),
            uv: [0.0; 2],
            local: Vector3::zeros(),
        };
        Self {
            at: [nowhere; SEGMENT],
            footprint_m: [0.0; SEGMENT],
            rgb: [[0.0; 3]; SEGMENT],
        }
    }

    /// Colour and brightness of at most [`SEGMENT`] unit rays from `origin` whose crossings all lie
    /// on the face of the first, in order. `pixel_rad` is the angle between neighbouring rays, over
    /// which textures are averaged.
    pub(super) fn face(
        &mut self,
        scene: &Scene,
        origin: &Vector3<f64>,
        pixel_rad: f64,
        run: &[(Vector3<f64>, Crossing)],
        mut paint: impl FnMut(usize, [f64; 3], f64),
    ) {
        let Some((_, first)) = run.first() else {
            return;
        };
        let primitive = &scene.primitives()[first.primitive];
        let at = &mut self.at[..run.len()];
        let points = run
            .iter()
            .map(|(unit, c)| (origin + unit * c.range_m, *unit));
        primitive.shape.surfaces(first.face, points, at);
        let footprint_m = &mut self.footprint_m[..run.len()];
        for ((footprint_m, at), (unit, crossing)) in footprint_m.iter_mut().zip(&*at).zip(run) {
            let slant = at.normal.dot(unit).abs().max(LEAST_SLANT);
            *footprint_m = pixel_rad * crossing.range_m / slant;
        }
        let rgb = &mut self.rgb[..run.len()];
        Brush::new(primitive.texture(first.face)).rgb(at, footprint_m, rgb);
        for (place, (rgb, at)) in rgb.iter().zip(at).enumerate() {
            let light = scene.light(&at.normal);
            let rgb = rgb.map(|c| c * light);
            paint(place, rgb, luminance(rgb));
        }
    }
}
