//! Warping of known scenes: planes and a box inside a room, any camera to any other.

use super::*;
use nalgebra::UnitQuaternion;

/// f32 ranges of some metres.
const ROUNDING: f64 = 1e-6;
/// The usual depth jump.
const JUMP: f64 = 0.12;

fn pinhole() -> Camera {
    Camera::pinhole(60.0, 62.0, 39.0, 31.0, 80, 64).unwrap()
}

fn fish_eye() -> Camera {
    Camera::fov(30.0, 30.0, 40.0, 31.0, 0.9, 80, 64).unwrap()
}

fn pose(euler: [f64; 3], translation: [f64; 3]) -> Pose {
    let [roll, pitch, yaw] = euler;
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Pose::new(rotation, translation.into())
}

/// Ranges that `camera` at `world_from_camera` measures in a scene: distance along a world ray.
fn range_of(
    camera: &Camera,
    world_from_camera: &Pose,
    scene: impl Fn(&Vector3<f64>, &Vector3<f64>) -> f64,
) -> RangeMap {
    RangeMap::new(Plane::from_fn(camera.width(), camera.height(), |x, y| {
        let ray = camera.unproject(&Vector2::new(x as f64, y as f64));
        ray.map_or(f32::NAN, |ray| {
            scene(
                &world_from_camera.translation,
                &(world_from_camera.rotation * ray),
            ) as f32
        })
    }))
}

/// The wall z + 0.2 x - 0.1 y = 3.
fn wall(origin: &Vector3<f64>, ray: &Vector3<f64>) -> f64 {
    let normal = Vector3::new(0.2, -0.1, 1.0);
    (3.0 - normal.dot(origin)) / normal.dot(ray)
}

/// The inside of the sphere of radius 4 around the origin.
fn globe(origin: &Vector3<f64>, ray: &Vector3<f64>) -> f64 {
    let along = origin.dot(ray);
    -along + (along * along + 16.0 - origin.norm_squared()).sqrt()
}

/// A poster |x|, |y| < 0.5 at z = 1.5 before the wall.
fn poster(origin: &Vector3<f64>, ray: &Vector3<f64>) -> f64 {
    let t = (1.5 - origin.z) / ray.z;
    let hit = origin + ray * t;
    let on_it = t > 0.0 && hit.x.abs() < 0.5 && hit.y.abs() < 0.5;
    if on_it { t } else { wall(origin, ray) }
}

/// Largest relative error of the known pixels, and their share.
fn compare(found: &RangeMap, expected: &RangeMap) -> (f64, f64) {
    let pairs = found.metres().data().iter().zip(expected.metres().data());
    let worst = pairs
        .filter(|(f, _)| f.is_finite())
        .map(|(f, e)| f64::from((f / e - 1.0).abs()));
    (worst.fold(0.0, f64::max), found.known_share())
}

#[test]
fn render_at_the_same_place_gives_the_map_back() {
    for camera in [
        pinhole(),
        fish_eye(),
        Camera::equirectangular(80, 40).unwrap(),
    ] {
        let range = range_of(&camera, &Pose::identity(), globe);
        let warp = Warp::new(&camera, &camera, Pose::identity());
        let (worst, share) = compare(&warp.render_range(&range, JUMP).unwrap(), &range);
        assert!(worst < ROUNDING, "{worst}");
        assert_eq!(share, range.known_share());
    }
}

#[test]
fn render_of_a_plane_into_another_camera_is_exact() {
    let world_from_src = pose([0.1, -0.05, 0.2], [0.1, 0.2, -0.3]);
    let world_from_dst = pose([-0.1, 0.1, 0.1], [-0.2, 0.1, 0.1]);
    let dst_from_src = world_from_dst.inverse() * world_from_src;
    for (src, dst) in [
        (pinhole(), fish_eye()),
        (fish_eye(), pinhole()),
        (pinhole(), pinhole()),
    ] {
        let src_range = range_of(&src, &world_from_src, wall);
        let expected = range_of(&dst, &world_from_dst, wall);
        let warp = Warp::new(&src, &dst, dst_from_src);
        let rendered = warp.render_range(&src_range, JUMP).unwrap();
        let (worst, share) = compare(&rendered, &expected);
        assert!(worst < ROUNDING && share > 0.2, "{worst} {share}");
        // Known is exactly what lies between the outermost pixel centres of the source.
        let pixels = warp.source_pixels(&expected).unwrap();
        for (range, [u, v]) in rendered.metres().data().iter().zip(pixels.data()) {
            let inside = *u >= 0.0 && *v >= 0.0 && *u <= 79.0 && *v <= 63.0;
            assert_eq!(range.is_finite(), inside, "source pixel {u}, {v}");
        }
    }
}

#[test]
fn render_between_360_degree_views_leaves_no_hole() {
    let camera = Camera::equirectangular(160, 80).unwrap();
    let world_from_dst = pose([0.7, -0.4, 1.2], [0.5, -0.3, 0.4]);
    let range = range_of(&camera, &Pose::identity(), globe);
    let expected = range_of(&camera, &world_from_dst, globe);
    let warp = Warp::new(&camera, &camera, world_from_dst.inverse());
    let (worst, share) = compare(&warp.render_range(&range, JUMP).unwrap(), &expected);
    // Flat triangles of 2.25 degrees under a globe: (0.04)^2 / 8 of its radius, 1.2 times nearer.
    assert!(worst < 5e-4, "{worst}");
    assert_eq!(share, 1.0);
}

#[test]
fn render_hides_what_lies_behind_something_nearer() {
    let src = pinhole();
    let world_from_dst = pose([0.0, -0.1, 0.0], [0.35, 0.0, 0.0]);
    let src_range = range_of(&src, &Pose::identity(), poster);
    let expected = range_of(&src, &world_from_dst, poster);
    let warp = Warp::new(&src, &src, world_from_dst.inverse());
    let rendered = warp.render_range(&src_range, JUMP).unwrap();
    let pairs = rendered
        .metres()
        .data()
        .iter()
        .zip(expected.metres().data());
    let known: Vec<_> = pairs.filter(|(found, _)| found.is_finite()).collect();
    let wrong = known
        .iter()
        .filter(|(f, e)| (*f / *e - 1.0).abs() > 1e-5)
        .count();
    // The poster spans 40 x 41 source pixels; where its rim is in between two is not known, so a
    // seam of a pixel around it may show the wall (or nothing).
    assert!(wrong < 100, "{wrong} of {}", known.len());
    let uncovered = rendered
        .metres()
        .data()
        .iter()
        .filter(|v| v.is_nan())
        .count();
    assert!(
        uncovered > 200,
        "the wall beside the poster was hidden: {uncovered}"
    );
}

#[test]
fn back_of_a_surface_hides_and_is_unknown() {
    // From behind the wall, looking back: the source never saw this side.
    let src = pinhole();
    let range = range_of(&src, &Pose::identity(), wall);
    let behind = pose([0.0, std::f64::consts::PI, 0.0], [0.0, 0.0, 6.0]);
    let warp = Warp::new(&src, &src, behind.inverse());
    assert_eq!(warp.render_range(&range, JUMP).unwrap().known_share(), 0.0);
}

#[test]
fn source_pixels_and_back_are_a_round_trip() {
    let (src, dst) = (pinhole(), fish_eye());
    let world_from_dst = pose([-0.1, 0.1, 0.1], [-0.2, 0.1, 0.1]);
    let warp = Warp::new(&src, &dst, world_from_dst.inverse());
    let pixels = warp
        .source_pixels(&range_of(&dst, &world_from_dst, wall))
        .unwrap();
    let mut count = 0;
    for y in 0..dst.height() {
        for x in 0..dst.width() {
            let [u, v] = pixels[(x, y)];
            if u.is_nan() {
                continue;
            }
            let ray = src.unproject(&Vector2::new(u, v)).unwrap();
            let point = ray * wall(&Vector3::zeros(), &ray);
            let back = dst
                .project(&world_from_dst.inverse().transform(&point))
                .unwrap();
            // f32 ranges move the point along the ray by 1e-7, less than that many pixels aside.
            assert!((back - Vector2::new(x as f64, y as f64)).norm() < 1e-4);
            count += 1;
        }
    }
    assert!(count > 1000, "{count}");
}

#[test]
fn look_up_of_an_affine_image_is_the_image_at_the_source_pixels() {
    let (src, dst) = (pinhole(), pinhole());
    let warp = Warp::new(&src, &dst, pose([0.02, 0.03, 0.05], [0.1, -0.05, 0.02]));
    let image = Plane::from_fn(80, 64, |x, y| 3.0 + 0.5 * x as f32 - 0.25 * y as f32);
    let range = range_of(&dst, &Pose::identity(), wall);
    let found = warp.look_up(&image, &range).unwrap();
    let pixels = warp.source_pixels(&range).unwrap();
    for (value, [u, v]) in found.data().iter().zip(pixels.data()) {
        let expected = (3.0 + 0.5 * u - 0.25 * v) as f32;
        let border = |v: f64, n: f64| v < 0.0 || v > n - 1.0 || v.is_nan();
        let outside = border(*u, 80.0) || border(*v, 64.0);
        assert_eq!(value.is_nan(), outside);
        assert!(outside || (value - expected).abs() < 1e-4);
    }
}

#[test]
fn visible_says_which_points_the_source_sees_too() {
    let camera = pinhole();
    let world_from_dst = pose([0.0, -0.1, 0.0], [0.35, 0.0, 0.0]);
    let src_range = range_of(&camera, &Pose::identity(), poster);
    let dst_range = range_of(&camera, &world_from_dst, poster);
    let warp = Warp::new(&camera, &camera, world_from_dst.inverse());
    let seen = warp.visible(&src_range, &dst_range, 0.05).unwrap();
    let pixels = warp.source_pixels(&dst_range).unwrap();
    let (mut hidden, mut wrong) = (0, 0);
    for (index, visible) in seen.data().iter().enumerate() {
        let [u, v] = pixels.data()[index];
        if !(u >= 0.0 && v >= 0.0 && u <= 79.0 && v <= 63.0) {
            assert!(!visible);
            continue;
        }
        // The truth, from the scene itself: does the line from the source meet the poster first?
        let ray = world_from_dst.rotation * warp.dst_rays[index];
        let point = world_from_dst.translation + ray * f64::from(dst_range.metres().data()[index]);
        let first = poster(&Vector3::zeros(), &point.normalize());
        let truth = first > 0.95 * point.norm();
        hidden += usize::from(!truth);
        wrong += usize::from(truth != *visible);
    }
    // In the seam of a pixel around the poster, the source's bilinear range is in between.
    assert!(
        hidden > 200 && wrong < 100,
        "{hidden} hidden, {wrong} wrong"
    );
}

#[test]
fn warp_refuses_maps_of_another_size_and_senseless_shares() {
    let warp = Warp::new(&pinhole(), &fish_eye(), Pose::identity());
    let small = RangeMap::new(Plane::filled(8, 8, 1.0));
    let right = RangeMap::new(Plane::filled(80, 64, 1.0));
    let error = warp.render_range(&small, JUMP).unwrap_err().to_string();
    assert!(error.contains("src_range") && error.contains("80x64") && error.contains("8x8"));
    assert!(warp.render_range(&right, -1.0).is_err());
    assert!(warp.visible(&right, &right, f64::NAN).is_err());
    assert!(warp.visible(&right, &small, 0.1).is_err());
    assert!(warp.look_up(&Plane::filled(8, 8, 1.0), &right).is_err());
}
