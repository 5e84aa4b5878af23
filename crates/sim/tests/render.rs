//! Images against the exact ray query, and what the built-in scenes promise.

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use sphereflow_core::Pose;
use sphereflow_sim::scene::{Ball, Block, Cylinder, Primitive, Rectangle, Room, Texture};
use sphereflow_sim::{Motion, Renderer, Scene, render};
use sphereflow_sphere::Camera;

/// Rounding of a range of a few metres to f32.
const F32_M: f64 = 1e-6;
/// Rounding of a few operations in f64 on metres.
const F64_M: f64 = 1e-12;

fn kinect() -> Camera {
    Camera::pinhole(525.0, 525.0, 319.5, 239.5, 640, 480).unwrap()
}

fn small() -> Camera {
    Camera::pinhole(131.25, 131.25, 79.5, 59.5, 160, 120).unwrap()
}

#[test]
fn render_of_every_pixel_equals_the_ray_query() {
    // The renderer leaves out primitives that a bundle of rays cannot meet: none too many.
    let scene = Scene::furnished_room(5);
    let motion = Motion::room_tour(5);
    for camera in [small(), Camera::equirectangular(128, 64).unwrap()] {
        let renderer = Renderer::new(&scene, &camera);
        for k in 0..20 {
            let pose = motion.pose(1.25 * f64::from(k));
            let image = renderer.render(&pose);
            for y in 0..camera.height() {
                for x in 0..camera.width() {
                    let ray = camera.unproject(&Vector2::new(x as f64, y as f64)).unwrap();
                    let hit = scene
                        .intersect(&pose.translation, &(pose.rotation * ray))
                        .unwrap();
                    let range = f64::from(image.range.metres()[(x, y)]);
                    assert!((range - hit.range_m).abs() < F32_M, "{x} {y} in frame {k}");
                    let depth = f64::from(image.depth.metres()[(x, y)]);
                    if ray.z * hit.range_m > 0.0 {
                        assert!((depth - hit.range_m * ray.z).abs() < F32_M);
                    } else {
                        assert!(depth.is_nan(), "depth behind the camera is unknown");
                    }
                }
            }
        }
    }
}

#[test]
fn render_of_the_thesis_room_has_its_paint_to_the_last_digit_of_f32() {
    // Thesis: section 4.1.1. Paint is not averaged: pixels are the formula at their centre.
    let (scene, camera) = (Scene::thesis_room(), small());
    let pose = Motion::sinusoids_411().pose(0.4);
    let image = render(&scene, &camera, &pose);
    let quantised = image.grey_1_to_256();
    for (x, y) in [(0, 0), (33, 87), (159, 119), (80, 60)] {
        let ray = camera.unproject(&Vector2::new(x as f64, y as f64)).unwrap();
        let hit = scene
            .intersect(&pose.translation, &(pose.rotation * ray))
            .unwrap();
        assert_eq!(image.grey[(x, y)], hit.grey as f32);
        assert_eq!(f64::from(quantised[(x, y)]), hit.grey.round());
        let p = hit.point;
        let [u, v] = match hit.face / 2 {
            0 => [p.z, p.y],
            1 => [p.x, p.z],
            _ => [p.x, p.y],
        };
        let wave = |c: f64| (std::f64::consts::TAU * c / 0.5).sin();
        assert!((hit.grey - (128.5 + 63.75 * (wave(u) + wave(v)))).abs() < 1e-10);
    }
    let (low, high) = quantised
        .data()
        .iter()
        .fold((f32::MAX, f32::MIN), |(a, b), &g| (a.min(g), b.max(g)));
    assert!(
        low >= 1.0 && high <= 256.0 && low < 4.0 && high > 253.0,
        "{low} {high}"
    );
}

#[test]
fn render_with_one_and_two_threads_is_bit_identical() {
    let renderer = Renderer::new(&Scene::furnished_room(2), &small());
    let pose = Motion::room_tour(2).pose(3.0);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| renderer.render(&pose))
    };
    let (one, two) = (with(1), with(2));
    assert_eq!(one, two);
    assert_eq!(one.range.known_share(), 1.0);
}

#[test]
fn render_of_a_rolling_shutter_takes_each_row_from_its_own_pose() {
    let renderer = Renderer::new(&Scene::furnished_room(2), &small());
    let motion = Motion::room_tour(2);
    let time = |y: usize| 3.0 + 1e-3 * y as f64;
    let rolling = renderer.render_at(|y| motion.pose(time(y)));
    for y in [0, 47, 119] {
        let still = renderer.render(&motion.pose(time(y)));
        assert_eq!(rolling.colour.row(y), still.colour.row(y));
        assert_eq!(rolling.range.metres().row(y), still.range.metres().row(y));
    }
}

#[test]
fn scene_primitives_are_met_where_they_are() {
    let plain = Texture::Plain { rgb: [10.0; 3] };
    let place = Vector3::new(0.2, -0.3, 4.0);
    let block = Block::new(place, Vector3::new(0.5, 0.6, 0.7), 0.4);
    let (ball, cylinder) = (
        Ball {
            centre: place,
            radius_m: 0.8,
        },
        Cylinder {
            centre: place,
            radius_m: 0.4,
            half_height_m: 0.6,
        },
    );
    let rectangle = Rectangle::new(
        place,
        Vector3::new(0.6, 0.0, 0.3),
        Vector3::new(0.0, 0.5, 0.0),
    );
    for primitive in [
        Primitive::new(block, plain),
        Primitive::new(ball, plain),
        Primitive::new(cylinder, plain),
        Primitive::new(rectangle, plain),
    ] {
        let scene = Scene::new(vec![primitive.clone()]).unwrap();
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.4);
        let mut met = 0;
        for k in 0..20_000 {
            // Rays from all around, towards near the middle.
            let angle = 2.399_963 * f64::from(k);
            let height = f64::from(k % 201) / 100.0 - 1.0;
            let from = place + 3.0 * Vector3::new(angle.cos(), height, angle.sin());
            let miss = Vector3::new(
                (1.7 * angle).sin(),
                (0.9 * angle).cos(),
                (2.3 * angle).sin(),
            );
            let Some(hit) = scene.intersect(&from, &(place + 0.7 * miss - from)) else {
                continue;
            };
            met += 1;
            let p = hit.point - place;
            let gap = match primitive.shape {
                sphereflow_sim::scene::Shape::Block(_) => {
                    let q = (turn.inverse() * p).abs() - Vector3::new(0.5, 0.6, 0.7);
                    q.max().abs()
                }
                sphereflow_sim::scene::Shape::Ball(_) => (p.norm() - 0.8).abs(),
                sphereflow_sim::scene::Shape::Cylinder(_) => {
                    (p.xz().norm() - 0.4).max(p.y.abs() - 0.6).abs()
                }
                _ => p.dot(&Vector3::new(-0.3, 0.0, 0.6)).abs(),
            };
            assert!(gap < F64_M, "{:?}: {gap}", primitive.shape);
            let back = (from - hit.point).normalize();
            assert!(
                hit.normal.dot(&back) >= 0.0,
                "the normal is on the side of the origin"
            );
            assert!((hit.normal.norm() - 1.0).abs() < F64_M);
            assert!(((from - hit.point).norm() - hit.range_m).abs() < F64_M);
        }
        assert!(met > 2000, "{:?}: {met}", primitive.shape);
    }
}

#[test]
fn scene_with_impossible_size_or_nothing_in_it_is_an_error_that_names_it() {
    let text = Scene::new(vec![]).unwrap_err().to_string();
    assert!(text.contains("primitives"), "{text}");
    let flat = Room {
        min: Vector3::zeros(),
        max: Vector3::new(1.0, 0.0, 1.0),
    };
    let primitive = Primitive::new(flat, Texture::Plain { rgb: [0.0; 3] });
    let text = Scene::new(vec![primitive]).unwrap_err().to_string();
    assert!(text.contains("primitives[0].max - min"), "{text}");
    let room = Room {
        min: -Vector3::repeat(1.0),
        max: Vector3::repeat(1.0),
    };
    let primitive = Primitive::new(room, Texture::Sinusoid { period_m: f64::NAN });
    let text = Scene::new(vec![primitive]).unwrap_err().to_string();
    assert!(text.contains("primitives[0].textures: period_m"), "{text}");
    assert!(Scene::sphere(-1.0).is_err() && Scene::ellipsoid(1.0, f64::NAN, 1.0).is_err());
    assert!(
        Scene::thesis_room_with(0.0)
            .unwrap_err()
            .to_string()
            .contains("period_m")
    );
}

#[test]
fn sphere_seen_from_its_middle_is_at_its_radius() {
    let scene = Scene::sphere(2.5).unwrap();
    let camera = Camera::equirectangular(64, 32).unwrap();
    let image = render(&scene, &camera, &Pose::identity());
    let range = image.range.metres().data();
    assert!(range.iter().all(|r| (f64::from(*r) - 2.5).abs() < F32_M));
}

#[test]
fn furnished_room_tour_keeps_clear_and_closes_for_every_seed() {
    // A Kinect sees from 0.5 m on: the path keeps that from everything.
    let camera = Camera::equirectangular(128, 64).unwrap();
    for seed in 0..12 {
        let scene = Scene::furnished_room(seed);
        assert!(scene.primitives().len() > 14 + 1);
        let (renderer, motion) = (Renderer::new(&scene, &camera), Motion::room_tour(seed));
        for k in 0..50 {
            let image = renderer.render(&motion.pose(0.5 * f64::from(k)));
            let nearest = image
                .range
                .metres()
                .data()
                .iter()
                .copied()
                .fold(9.0, f32::min);
            assert!(
                nearest > 0.5,
                "seed {seed}, {} s: {nearest} m",
                0.5 * f64::from(k)
            );
            assert_eq!(image.range.known_share(), 1.0);
        }
        let (start, end) = (motion.pose(0.0), motion.pose(motion.duration_s));
        let (distance, angle) = start.distance_and_angle(&end);
        assert!(
            distance < 1e-9 && angle < 1e-7,
            "seed {seed}: {distance} {angle}"
        );
    }
}

#[test]
fn furnished_room_leaves_hand_held_and_trolley_paths_free_for_every_seed() {
    for seed in 0..12 {
        let scene = Scene::furnished_room(seed);
        for motion in [Motion::hand_held(seed), Motion::trolley(seed)] {
            for k in 0..3000 {
                let place = motion.pose(0.01 * f64::from(k)).translation;
                assert_eq!(scene.obstacle(&place), None, "seed {seed}: {place:?}");
            }
        }
    }
}

#[test]
fn furnished_room_gives_every_view_of_the_tour_texture_and_relief() {
    // Corners: pixels where brightness changes by more than 12 grey levels both ways, of 160x120.
    let camera = kinect().binned(4).unwrap();
    for seed in 0..6 {
        let (scene, motion) = (Scene::furnished_room(seed), Motion::room_tour(seed));
        let renderer = Renderer::new(&scene, &camera);
        for k in 0..25 {
            let image = renderer.render(&motion.pose(f64::from(k)));
            let grey = &image.grey;
            let textured = (1..119)
                .flat_map(|y| (1..159).map(move |x| (x, y)))
                .filter(|&(x, y)| {
                    (grey[(x + 1, y)] - grey[(x - 1, y)]).abs() > 12.0
                        && (grey[(x, y + 1)] - grey[(x, y - 1)]).abs() > 12.0
                })
                .count();
            assert!(
                textured > 300,
                "seed {seed}, {k} s: {textured} textured pixels"
            );
            let depth = image.depth.metres().data();
            let (near, far) = depth
                .iter()
                .fold((9.0_f32, 0.0_f32), |(a, b), &d| (a.min(d), b.max(d)));
            assert!(far - near > 0.8, "seed {seed}, {k} s: {near} to {far} m");
        }
    }
}
