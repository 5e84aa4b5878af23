//! Paint and light of neighbouring pixels that see the same face.

use crate::scene::{Brush, Crossing, Scene, luminance};
use nalgebra::Vector3;

/// Surfaces seen at a smaller cosine are averaged as if seen at this one.
const LEAST_SLANT: f64 = 0.25;

/// Colour and brightness of crossings that all lie on the face of the first, in order. `pixel_rad`
/// is the angle between neighbouring rays, over which textures are averaged.
pub(super) fn face(
    scene: &Scene,
    origin: &Vector3<f64>,
    pixel_rad: f64,
    crossings: impl Iterator<Item = (Vector3<f64>, Crossing)>,
    mut paint: impl FnMut([f64; 3], f64),
) {
    let mut crossings = crossings.peekable();
    let Some((_, first)) = crossings.peek() else {
        return;
    };
    let primitive = &scene.primitives()[first.primitive];
    let mut brush = Brush::new(primitive.texture(first.face));
    for (unit, crossing) in crossings {
        let point = origin + unit * crossing.range_m;
        let surface = primitive.shape.surface(&point, crossing.face, &unit);
        let slant = surface.normal.dot(&unit).abs().max(LEAST_SLANT);
        let footprint_m = pixel_rad * crossing.range_m / slant;
        let light = scene.light(&surface.normal);
        let rgb = brush.rgb(&surface, footprint_m).map(|c| c * light);
        paint(rgb, luminance(rgb));
    }
}
