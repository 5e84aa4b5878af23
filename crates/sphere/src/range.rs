//! Depth along the optical axis to range along the ray, and back, for any camera.

use crate::Camera;
use nalgebra::Vector2;
use rayon::prelude::*;
use sphereflow_core::{DepthMap, Error, Plane, RangeMap, Result};

/// The range of each pixel from its depth: D = Z / eta_z. Unknown where the pixel has no ray or
/// looks sideways or backwards (eta_z <= 0), where no depth along z can be.
///
/// # Errors
/// [`Error::Shape`] where the map has not the size of the camera's image.
pub fn range_from_depth(depth: &DepthMap, camera: &Camera) -> Result<RangeMap> {
    scale_by_ray(depth.metres(), camera, "depth", |z, eta_z| z / eta_z).map(RangeMap::new)
}

/// The depth along the optical axis of each pixel from its range: Z = D eta_z. Unknown where the
/// pixel has no ray, and where what it sees lies beside or behind the camera (Z <= 0).
///
/// # Errors
/// [`Error::Shape`] where the map has not the size of the camera's image.
pub fn depth_from_range(range: &RangeMap, camera: &Camera) -> Result<DepthMap> {
    scale_by_ray(range.metres(), camera, "range", |d, eta_z| d * eta_z).map(DepthMap::new)
}

fn scale_by_ray(
    metres: &Plane<f32>,
    camera: &Camera,
    argument: &str,
    scale: impl Fn(f64, f64) -> f64 + Sync,
) -> Result<Plane<f32>> {
    check_size(argument, metres.size(), camera)?;
    let mut out = metres.clone();
    let rows = out.data_mut().par_chunks_mut(camera.width());
    rows.enumerate().for_each(|(y, row)| {
        for (x, value) in row.iter_mut().enumerate() {
            let eta = camera.unproject(&Vector2::new(x as f64, y as f64));
            *value = match eta {
                Some(eta) if eta.z > 0.0 => scale(f64::from(*value), eta.z) as f32,
                _ => f32::NAN,
            };
        }
    });
    Ok(out)
}

/// An image must have the size that its camera says.
pub(crate) fn check_size(argument: &str, size: (usize, usize), camera: &Camera) -> Result<()> {
    let expected = (camera.width(), camera.height());
    if size == expected {
        return Ok(());
    }
    Err(Error::shape(
        argument,
        format!("{}x{} as the camera's image", expected.0, expected.1),
        format!("{}x{}", size.0, size.1),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two roundings of f32.
    const ROUNDING: f32 = 3e-7;

    #[test]
    fn range_and_depth_are_inverse_for_forward_cameras() {
        let pinhole = Camera::pinhole(30.0, 31.0, 15.0, 12.0, 32, 24).unwrap();
        let fish_eye = Camera::fov(18.0, 18.0, 15.0, 12.0, 0.9, 32, 24).unwrap();
        for camera in [pinhole, fish_eye] {
            let depth = DepthMap::new(Plane::from_fn(32, 24, |x, y| 1.0 + 0.1 * (x + y) as f32));
            let range = range_from_depth(&depth, &camera).unwrap();
            let back = depth_from_range(&range, &camera).unwrap();
            for (a, b) in depth.metres().data().iter().zip(back.metres().data()) {
                assert!((a - b).abs() <= ROUNDING * a);
            }
        }
    }

    #[test]
    fn range_of_a_wall_is_its_depth_times_n() {
        // Thesis: eq. (1.13): D is measured along the ray; a wall at Z has D = Z n.
        let camera = Camera::pinhole(30.0, 31.0, 15.0, 12.0, 32, 24).unwrap();
        let wall = DepthMap::new(Plane::filled(32, 24, 2.0));
        let range = range_from_depth(&wall, &camera).unwrap();
        let (a, b) = ((31.0 - 15.0) / 30.0, (0.0 - 12.0) / 31.0_f32);
        let expected = 2.0 * (1.0 + a * a + b * b).sqrt();
        assert!((range.metres()[(31, 0)] - expected).abs() < 1e-6);
    }

    #[test]
    fn depth_of_what_lies_behind_is_unknown() {
        let camera = Camera::equirectangular(16, 8).unwrap();
        let range = RangeMap::new(Plane::filled(16, 8, 2.0));
        let depth = depth_from_range(&range, &camera).unwrap();
        assert!((depth.known_share() - 0.5).abs() < 1e-12);
        assert!(depth.metres()[(0, 4)].is_nan() && depth.metres()[(8, 4)] > 1.8);
    }

    #[test]
    fn range_of_a_map_of_another_size_is_refused() {
        let camera = Camera::equirectangular(16, 8).unwrap();
        let error = depth_from_range(&RangeMap::new(Plane::filled(8, 8, 1.0)), &camera);
        assert!(error.unwrap_err().to_string().contains("16x8"));
    }
}
