//! Smaller and smaller images by block means.
//!
//! Level 0 is full size, level k has blocks of 2^k x 2^k full-size pixels. Every block knows the
//! sum, number, least and largest of its *full-size* pixels, so that a level is the same whether
//! it is built alone or through the levels below.

use crate::Camera;
use crate::range::check_size;
use sphereflow_core::{DepthMap, Error, Plane, RangeMap, Result};

/// When the mean of a block stands for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockRule {
    /// Share of the block's pixels that must be known, 0 to 1.
    pub least_known: f64,
    /// Largest (maximum - minimum) / |mean| of the known ones; infinite for no limit.
    pub largest_spread: f64,
}

impl BlockRule {
    /// Of images: 80 % known, any spread.
    pub const IMAGE: Self = Self {
        least_known: 0.8,
        largest_spread: f64::INFINITY,
    };
    /// Of inverse depth or range: 80 % known, and no depth jump in the block, which a relative
    /// spread of 12 % betrays.
    pub const INVERSE_DEPTH: Self = Self {
        least_known: 0.8,
        largest_spread: 0.12,
    };
}

/// One size of a pyramid.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// The camera of the smaller image.
    pub camera: Camera,
    /// Block means; NaN where the rule is not met.
    pub plane: Plane<f32>,
}

/// An image in several sizes, each half as large as the one before; level 0 is full size.
#[derive(Clone, Debug, PartialEq)]
pub struct Pyramid {
    levels: Vec<Level>,
}

impl Pyramid {
    /// Block means of an image in `levels` sizes; rows and columns that fill no block are dropped.
    ///
    /// # Errors
    /// [`Error::Shape`] where the image has not the camera's size; [`Error::Value`] where `levels`
    /// is 0 or the image too small for them.
    pub fn new(
        plane: &Plane<f32>,
        camera: &Camera,
        levels: usize,
        rule: BlockRule,
    ) -> Result<Self> {
        check_size("plane", plane.size(), camera)?;
        if levels == 0 {
            return Err(Error::value("levels", "at least 1", levels));
        }
        let mut built = vec![Level {
            camera: camera.clone(),
            plane: plane.clone(),
        }];
        let mut blocks = plane.map(|value| Block::of(*value));
        for level in 1..levels {
            let factor = u32::try_from(level)
                .ok()
                .and_then(|n| 1_usize.checked_shl(n));
            let camera = camera.binned(factor.unwrap_or(0))?;
            blocks = Block::merged(&blocks, camera.width(), camera.height());
            let pixels = 4.0_f64.powi(level as i32);
            built.push(Level {
                plane: blocks.map(|block| block.mean(pixels, &rule)),
                camera,
            });
        }
        Ok(Self { levels: built })
    }

    /// Of an image ([`BlockRule::IMAGE`]).
    ///
    /// # Errors
    /// As [`Pyramid::new`].
    pub fn of_image(image: &Plane<f32>, camera: &Camera, levels: usize) -> Result<Self> {
        Self::new(image, camera, levels, BlockRule::IMAGE)
    }

    /// Of inverse depth 1/Z per metre ([`BlockRule::INVERSE_DEPTH`]), the mean of which is exact on
    /// planes for a pinhole.
    ///
    /// # Errors
    /// As [`Pyramid::new`].
    pub fn of_inverse_depth(depth: &DepthMap, camera: &Camera, levels: usize) -> Result<Self> {
        let inverse = depth.metres().map(|z| 1.0 / z);
        Self::new(&inverse, camera, levels, BlockRule::INVERSE_DEPTH)
    }

    /// Of inverse range 1/D per metre ([`BlockRule::INVERSE_DEPTH`]): for cameras that look beyond
    /// 90 degrees, where there is no depth along z.
    ///
    /// # Errors
    /// As [`Pyramid::new`].
    pub fn of_inverse_range(range: &RangeMap, camera: &Camera, levels: usize) -> Result<Self> {
        let inverse = range.metres().map(|d| 1.0 / d);
        Self::new(&inverse, camera, levels, BlockRule::INVERSE_DEPTH)
    }

    /// All levels, full size first.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }
}

/// What is known of a block's full-size pixels.
#[derive(Clone, Copy, Debug)]
struct Block {
    sum: f32,
    known: f32,
    least: f32,
    largest: f32,
}

impl Block {
    const EMPTY: Self = Self {
        sum: 0.0,
        known: 0.0,
        least: f32::INFINITY,
        largest: f32::NEG_INFINITY,
    };

    fn of(value: f32) -> Self {
        if !value.is_finite() {
            return Self::EMPTY;
        }
        Self {
            sum: value,
            known: 1.0,
            least: value,
            largest: value,
        }
    }

    fn with(self, other: &Self) -> Self {
        Self {
            sum: self.sum + other.sum,
            known: self.known + other.known,
            least: self.least.min(other.least),
            largest: self.largest.max(other.largest),
        }
    }

    /// Every four blocks in one; odd last rows and columns are dropped.
    fn merged(fine: &Plane<Self>, width: usize, height: usize) -> Plane<Self> {
        Plane::from_fn(width, height, |x, y| {
            let (top, bottom) = (fine.row(2 * y), fine.row(2 * y + 1));
            top[2 * x]
                .with(&top[2 * x + 1])
                .with(&bottom[2 * x].with(&bottom[2 * x + 1]))
        })
    }

    fn mean(&self, pixels: f64, rule: &BlockRule) -> f32 {
        let mean = self.sum / self.known;
        let enough = f64::from(self.known) >= rule.least_known * pixels && self.known > 0.0;
        let spread = f64::from(self.largest - self.least);
        if enough && spread <= rule.largest_spread * f64::from(mean.abs()) {
            mean
        } else {
            f32::NAN
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Vector2, Vector3};

    /// Rounding of f32 means of values near 1.
    const ROUNDING: f32 = 1e-6;

    fn camera() -> Camera {
        Camera::pinhole(50.0, 52.0, 31.0, 23.0, 64, 48).unwrap()
    }

    /// The depth of the plane `normal . X = 1` per metre in each pixel of the camera.
    fn plane_depth(camera: &Camera, normal: [f64; 3]) -> DepthMap {
        DepthMap::new(Plane::from_fn(camera.width(), camera.height(), |x, y| {
            let ray = camera.unproject(&Vector2::new(x as f64, y as f64)).unwrap();
            (ray.z / ray.dot(&Vector3::from(normal))) as f32
        }))
    }

    #[test]
    fn inverse_depth_of_a_plane_is_the_plane_seen_by_the_binned_camera() {
        let normal = [0.1, -0.2, 0.5];
        let depth = plane_depth(&camera(), normal);
        let pyramid = Pyramid::of_inverse_depth(&depth, &camera(), 4).unwrap();
        for (k, level) in pyramid.levels().iter().enumerate() {
            assert_eq!(level.plane.size(), (64 >> k, 48 >> k));
            assert_eq!(level.camera, camera().binned(1 << k).unwrap());
            let expected = plane_depth(&level.camera, normal);
            for (found, z) in level.plane.data().iter().zip(expected.metres().data()) {
                assert!((found - 1.0 / z).abs() < ROUNDING, "level {k}");
            }
        }
    }

    #[test]
    fn block_across_a_depth_jump_is_unknown() {
        let depth = |x: usize| if x < 5 { 1.0 } else { 1.2 };
        let map = DepthMap::new(Plane::from_fn(64, 48, |x, _| depth(x)));
        let pyramid = Pyramid::of_inverse_depth(&map, &camera(), 3).unwrap();
        let coarse = &pyramid.levels()[2].plane;
        assert!(coarse[(1, 3)].is_nan());
        assert!((coarse[(0, 3)] - 1.0).abs() < ROUNDING);
        assert!((coarse[(2, 3)] - 1.0 / 1.2).abs() < ROUNDING);
    }

    #[test]
    fn block_with_a_fifth_of_its_pixels_unknown_is_known_and_with_more_is_not() {
        // Of 16 pixels 3 may be missing (81 % known), not 4 (75 %).
        for (missing, known) in [(3, true), (4, false)] {
            let mut metres = Plane::filled(64, 48, 2.0_f32);
            for x in 0..missing {
                metres[(x, 0)] = f32::NAN;
            }
            let pyramid = Pyramid::of_inverse_depth(&DepthMap::new(metres), &camera(), 3).unwrap();
            assert_eq!(pyramid.levels()[2].plane[(0, 0)].is_finite(), known);
        }
    }

    #[test]
    fn image_pyramid_keeps_means_across_any_contrast() {
        let image = Plane::from_fn(64, 48, |x, _| if x % 2 == 0 { 0.0 } else { 200.0 });
        let pyramid = Pyramid::of_image(&image, &camera(), 3).unwrap();
        assert!(pyramid.levels()[1].plane.data().iter().all(|v| *v == 100.0));
    }

    #[test]
    fn pyramid_of_too_many_levels_is_refused() {
        let image = Plane::filled(64, 48, 1.0);
        for levels in [0, 7, 70] {
            assert!(Pyramid::of_image(&image, &camera(), levels).is_err());
        }
        assert!(Pyramid::of_image(&Plane::filled(8, 8, 1.0), &camera(), 1).is_err());
    }

    #[test]
    fn inverse_range_pyramid_of_a_360_degree_image_halves_its_camera() {
        let camera = Camera::equirectangular(32, 16).unwrap();
        let range = RangeMap::new(Plane::filled(32, 16, 4.0));
        let pyramid = Pyramid::of_inverse_range(&range, &camera, 3).unwrap();
        assert_eq!(
            pyramid.levels()[2].camera,
            Camera::equirectangular(8, 4).unwrap()
        );
        assert!(pyramid.levels()[2].plane.data().iter().all(|v| *v == 0.25));
    }
}
