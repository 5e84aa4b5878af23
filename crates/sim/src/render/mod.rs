//! What a camera sees of a scene.

mod bundle;
mod candidates;
mod shade;

use crate::rounding::byte;
use crate::scene::{Crossing, Scene};
use bundle::Bundle;
use candidates::Candidates;
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use rayon::prelude::*;
use shade::Shader;
use sphereflow_core::{DepthMap, Plane, Pose, RangeMap};
use sphereflow_sphere::Camera;

/// Pixels of a row that share their candidates.
const SEGMENT: usize = 64;

/// Of a ray that meets nothing.
const NOTHING: Crossing = Crossing {
    range_m: f64::NAN,
    primitive: usize::MAX,
    face: 0,
};

/// One exact image of a scene: no noise, no quantisation but that of the colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendered {
    /// Distance along the ray; NaN where the camera has no ray or the ray meets nothing.
    pub range: RangeMap,
    /// Distance along the optical axis; NaN also behind a 360-degree camera.
    pub depth: DepthMap,
    /// 8-bit RGB, rounded and clamped; black where nothing is met.
    pub colour: Plane<[u8; 3]>,
    /// Brightness, unquantised; NaN where nothing is met.
    pub grey: Plane<f32>,
}

impl Rendered {
    /// Thesis: section 4.1.1. Brightness rounded to integers from 1 to 256.
    pub fn grey_1_to_256(&self) -> Plane<f32> {
        self.grey.map(|g| g.round().clamp(1.0, 256.0))
    }
}

/// A scene and the rays of a camera, ready for many poses.
#[derive(Clone, Debug)]
pub struct Renderer {
    scene: Scene,
    camera: Camera,
    /// Unit rays in the camera frame, row after row; NaN where the model has none.
    rays: Vec<Vector3<f64>>,
    /// What encloses each segment of each row, camera frame.
    bundles: Vec<Bundle>,
    /// Angle between the rays of neighbouring pixels in the middle of the image.
    pixel_rad: f64,
}

/// [`Renderer::render`] for a single image.
pub fn render(scene: &Scene, camera: &Camera, world_from_camera: &Pose) -> Rendered {
    Renderer::new(scene, camera).render(world_from_camera)
}

impl Renderer {
    /// The rays of `camera`, for images of `scene`.
    pub fn new(scene: &Scene, camera: &Camera) -> Self {
        let (width, height) = (camera.width(), camera.height());
        let ray = |x: f64, y: f64| {
            let none = Vector3::repeat(f64::NAN);
            camera.unproject(&Vector2::new(x, y)).unwrap_or(none)
        };
        let rays: Vec<Vector3<f64>> = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x as f64, y as f64)))
            .map(|(x, y)| ray(x, y))
            .collect();
        let bundles = rays
            .chunks(width)
            .flat_map(|row| row.chunks(SEGMENT).map(Bundle::around))
            .collect();
        let (cx, cy) = (0.5 * width as f64 - 0.5, 0.5 * height as f64 - 0.5);
        let step = (ray(cx + 0.5, cy) - ray(cx - 0.5, cy)).norm();
        Self {
            scene: scene.clone(),
            camera: camera.clone(),
            rays,
            bundles,
            pixel_rad: if step.is_finite() { step } else { 0.0 },
        }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The image from one pose.
    pub fn render(&self, world_from_camera: &Pose) -> Rendered {
        self.render_at(|_| *world_from_camera)
    }

    /// The image of a rolling shutter: row `y` is seen from `world_from_camera(y)`.
    pub fn render_at(&self, world_from_camera: impl Fn(usize) -> Pose + Sync) -> Rendered {
        let (width, height) = (self.camera.width(), self.camera.height());
        // Zeros come from the system without being written; the maps turn them into NaN.
        let mut range = Plane::filled(width, height, 0.0_f32);
        let mut depth = Plane::filled(width, height, 0.0_f32);
        let mut grey = Plane::filled(width, height, 0.0_f32);
        let mut colour = Plane::filled(width, height, [0_u8; 3]);
        range
            .data_mut()
            .par_chunks_mut(width)
            .zip(depth.data_mut().par_chunks_mut(width))
            .zip(grey.data_mut().par_chunks_mut(width))
            .zip(colour.data_mut().par_chunks_mut(width))
            .enumerate()
            .for_each_init(
                || Desk::new(&self.scene),
                |desk, (y, (((range, depth), grey), colour))| {
                    let row = Row {
                        range,
                        depth,
                        grey,
                        colour,
                    };
                    self.render_row(y, &world_from_camera(y), desk, row);
                },
            );
        Rendered {
            range: RangeMap::new(range),
            depth: DepthMap::new(depth),
            colour,
            grey,
        }
    }

    fn render_row(&self, y: usize, pose: &Pose, desk: &mut Desk<'_>, out: Row<'_>) {
        let (width, origin) = (self.camera.width(), pose.translation);
        let rotation = UnitQuaternion::to_rotation_matrix(pose.rotation);
        let rays = &self.rays[y * width..(y + 1) * width];
        let segments = width.div_ceil(SEGMENT);
        let bundles = &self.bundles[y * segments..(y + 1) * segments];
        let Desk {
            candidates,
            shader,
            seen,
        } = desk;
        candidates.look_from(&origin);
        for (segment, (bundle, rays)) in bundles.iter().zip(rays.chunks(SEGMENT)).enumerate() {
            candidates.choose(&bundle.turned(&rotation));
            let mut x = segment * SEGMENT;
            for (offset, (seen, ray)) in seen.iter_mut().zip(rays).enumerate() {
                let unit = rotation * ray;
                let crossing = candidates.nearest(&unit).unwrap_or(NOTHING);
                out.range[x + offset] = crossing.range_m as f32;
                out.depth[x + offset] = (crossing.range_m * ray.z) as f32;
                *seen = (unit, crossing);
            }
            for run in seen[..rays.len()].chunk_by(|a, b| same_face(&a.1, &b.1)) {
                let (colour, grey) = (&mut out.colour[x..], &mut out.grey[x..]);
                x += run.len();
                if run[0].1.primitive == NOTHING.primitive {
                    grey[..run.len()].fill(f32::NAN);
                    continue;
                }
                let paint = |place: usize, rgb: [f64; 3], brightness: f64| {
                    colour[place] = rgb.map(|c| byte(c as f32));
                    grey[place] = brightness as f32;
                };
                shader.face(&self.scene, &origin, self.pixel_rad, run, paint);
            }
        }
    }
}

#[inline]
fn same_face(a: &Crossing, b: &Crossing) -> bool {
    a.primitive == b.primitive && a.face == b.face
}

/// What a row needs and the next one can use again.
struct Desk<'a> {
    candidates: Candidates<'a>,
    shader: Shader,
    seen: [(Vector3<f64>, Crossing); SEGMENT],
}

impl<'a> Desk<'a> {
    fn new(scene: &'a Scene) -> Self {
        Self {
            candidates: Candidates::new(scene),
            shader: Shader::new(),
            seen: [(Vector3::zeros(), NOTHING); SEGMENT],
        }
    }
}

/// One row of every plane.
struct Row<'a> {
    range: &'a mut [f32],
    depth: &'a mut [f32],
    grey: &'a mut [f32],
    colour: &'a mut [[u8; 3]],
}
