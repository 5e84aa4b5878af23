//! The voxel cloud: geometry, counts, order, bounds.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

use nalgebra::{UnitQuaternion, Vector3};
use sphereflow_core::{DepthMap, Plane, Pose, RangeMap};
use sphereflow_slam::VoxelCloud;
use sphereflow_sphere::Camera;

const VOXEL_M: f64 = 0.05;
/// Positions are stored in single precision.
const ROUNDING_M: f64 = 1e-6;

fn camera() -> Camera {
    Camera::pinhole(60.0, 60.0, 31.5, 23.5, 64, 48).unwrap()
}

fn wall() -> DepthMap {
    DepthMap::new(Plane::filled(64, 48, 2.0))
}

fn pose() -> Pose {
    Pose::new(
        UnitQuaternion::from_euler_angles(0.3, -0.4, 0.9),
        Vector3::new(1.0, -2.0, 0.5),
    )
}

fn cloud() -> VoxelCloud {
    VoxelCloud::new(VOXEL_M, 1_000_000).unwrap()
}

#[test]
fn cloud_of_a_plane_lies_in_the_plane_where_the_pose_puts_it() {
    let mut cloud = cloud();
    let added = cloud
        .add(&wall(), None, &camera(), &pose(), 1, 10.0)
        .unwrap();
    assert_eq!(added, 64 * 48);
    let points = cloud.points();
    assert_eq!(points.counts.iter().sum::<u32>(), 64 * 48);
    assert!(points.positions.len() > 200 && points.positions.len() < 64 * 48);
    for position in &points.positions {
        let in_camera = pose()
            .inverse()
            .transform(&Vector3::from(position.map(f64::from)));
        assert!((in_camera.z - 2.0).abs() < ROUNDING_M, "{in_camera}");
        assert!(
            in_camera.x.abs() < 1.06 && in_camera.y.abs() < 0.8,
            "{in_camera}"
        );
    }
    assert!(points.colours.iter().all(Option::is_none));
}

#[test]
fn cloud_of_ranges_is_a_sphere_for_a_camera_that_sees_all_around() {
    let camera = Camera::equirectangular(128, 64).unwrap();
    let range = RangeMap::new(Plane::filled(128, 64, 1.5));
    let mut cloud = VoxelCloud::new(1e-3, 1_000_000).unwrap();
    cloud
        .add_ranges(&range, None, &camera, &pose(), 1, 10.0)
        .unwrap();
    for position in cloud.points().positions {
        let distance = (Vector3::from(position.map(f64::from)) - pose().translation).norm();
        assert!((distance - 1.5).abs() < ROUNDING_M, "{distance}");
    }
}

#[test]
fn cloud_means_colours_and_counts_of_one_voxel() {
    let camera = Camera::pinhole(1000.0, 1000.0, 0.5, 0.0, 2, 1).unwrap();
    let depth = DepthMap::new(Plane::filled(2, 1, 1.01));
    let colour = Plane::from_vec(2, 1, vec![[10, 0, 255], [20, 1, 255]]).unwrap();
    let mut cloud = VoxelCloud::new(1.0, 10).unwrap();
    let aside = Pose::new(UnitQuaternion::identity(), Vector3::new(0.5, 0.5, 0.0));
    for _ in 0..3 {
        cloud
            .add(&depth, Some(&colour), &camera, &aside, 1, 5.0)
            .unwrap();
    }
    let points = cloud.points();
    assert_eq!(
        (points.counts, points.colours),
        (vec![6], vec![Some([15, 1, 255])])
    );
    assert!((points.positions[0][0] - 0.5).abs() < 1e-6);
}

#[test]
fn cloud_takes_every_stride_and_nothing_beyond_the_range() {
    let mut near = cloud();
    assert_eq!(
        near.add(&wall(), None, &camera(), &pose(), 4, 10.0)
            .unwrap(),
        16 * 12
    );
    let mut far = cloud();
    assert_eq!(
        far.add(&wall(), None, &camera(), &pose(), 4, 1.9).unwrap(),
        0
    );
    let some = far.add(&wall(), None, &camera(), &pose(), 1, 2.1).unwrap();
    assert!(some > 0 && some < 64 * 48, "{some}");
}

#[test]
fn cloud_of_unknown_depth_is_empty() {
    let mut cloud = cloud();
    let unknown = DepthMap::new(Plane::filled(64, 48, f32::NAN));
    assert_eq!(
        cloud
            .add(&unknown, None, &camera(), &pose(), 1, 10.0)
            .unwrap(),
        0
    );
    assert!(cloud.is_empty() && cloud.points().positions.is_empty());
}

#[test]
fn cloud_built_twice_is_the_same_in_every_bit() {
    let build = || {
        let mut cloud = cloud();
        for stride in [1, 3, 2] {
            cloud
                .add(&wall(), None, &camera(), &pose(), stride, 10.0)
                .unwrap();
        }
        cloud.points()
    };
    assert_eq!(build(), build());
}

#[test]
fn cloud_that_is_full_drops_new_voxels_and_counts_them() {
    let mut cloud = VoxelCloud::new(VOXEL_M, 5).unwrap();
    let added = cloud
        .add(&wall(), None, &camera(), &pose(), 1, 10.0)
        .unwrap();
    assert_eq!(cloud.len(), 5);
    assert_eq!(added as u64 + cloud.dropped(), 64 * 48);
}

#[test]
fn cloud_with_bad_arguments_is_an_error_that_names_them() {
    assert!(
        VoxelCloud::new(0.0, 5)
            .unwrap_err()
            .to_string()
            .contains("voxel_m")
    );
    assert!(
        VoxelCloud::new(0.1, 0)
            .unwrap_err()
            .to_string()
            .contains("max_points")
    );
    let mut cloud = cloud();
    let small = DepthMap::new(Plane::filled(3, 2, 1.0));
    let error = cloud
        .add(&small, None, &camera(), &pose(), 1, 10.0)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("depth") && error.contains("64x48") && error.contains("3x2"),
        "{error}"
    );
    let colour = Plane::filled(3, 2, [0; 3]);
    let error = cloud
        .add(&wall(), Some(&colour), &camera(), &pose(), 1, 10.0)
        .unwrap_err();
    assert!(error.to_string().contains("colour"), "{error}");
    let error = cloud
        .add(&wall(), None, &camera(), &pose(), 0, 10.0)
        .unwrap_err();
    assert!(error.to_string().contains("stride"), "{error}");
    let error = cloud
        .add(&wall(), None, &camera(), &pose(), 1, f64::NAN)
        .unwrap_err();
    assert!(error.to_string().contains("max_range_m"), "{error}");
}
