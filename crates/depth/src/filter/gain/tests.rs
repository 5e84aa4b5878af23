//! Tests of the gains of rows.

use super::*;
use crate::filter::lattice::Lattice;
use crate::filter::prepare::{Preparation, Prepared};
use crate::filter::state::Drift;
use crate::filter::step::Step;
use nalgebra::{Rotation3, Vector3};
use sphereflow_core::Plane;
use sphereflow_sphere::Camera;

const WIDTH: usize = 160;
const HEIGHT: usize = 120;
/// The painted wall stands this far before both cameras, metres; the new one is lower.
const WALL_M: f64 = 2.0;
const STEP_M: f64 = 0.05;
/// By which 1/Z is too large where it is wrong, and its deviation then, as shares.
const OFF: f32 = 0.2;
/// Gains are lines between rows, and means over bands of them.
const WITHIN: f32 = 0.01;

/// Light that runs over the rows.
fn light(y: usize) -> f32 {
    1.0 + 0.08 * (std::f32::consts::TAU * y as f32 / HEIGHT as f32).sin()
}

/// What a camera at (0, y, 0) sees of the wall: stripes across its motion, and along it.
fn view(lattice: &Lattice, y_m: f64, stripes: [f64; 2], lit: bool) -> Prepared {
    let image = Plane::from_fn(WIDTH, HEIGHT, |x, y| {
        let ray = lattice.ray[y * WIDTH + x].cast::<f64>();
        let (x_m, y_m) = (ray.x / ray.z * WALL_M, ray.y / ray.z * WALL_M + y_m);
        let waves = stripes[0] * (11.0 * y_m).sin() + stripes[1] * (9.0 * x_m).sin();
        let light = if lit { light(y) } else { 1.0 };
        light * (128.0 + waves) as f32
    });
    let mut preparation = Preparation::new(WIDTH, HEIGHT, 1);
    preparation.prepare(&image, lattice, Some(1.0), Prepared::empty())
}

/// The gains of the new image's rows over those of a past one that was lit evenly.
fn measured(stripes: [f64; 2], lit: bool, off: f32) -> Light {
    measured_turned(stripes, lit, off, (0.0, Drift::default()))
}

/// The same where the new camera is told to look higher than it does, by pixels, and how well that is known.
fn measured_turned(
    stripes: [f64; 2],
    lit: bool,
    off: f32,
    (turned_px, drift): (f32, Drift),
) -> Light {
    let camera = Camera::pinhole(150.0, 150.0, 79.5, 59.5, WIDTH, HEIGHT).unwrap();
    let lattice = Lattice::new(&camera).unwrap();
    let new = view(&lattice, STEP_M, stripes, lit);
    let past = view(&lattice, 0.0, stripes, false);
    let pair = Pair {
        lattice: &lattice,
        step: Step {
            rotation: *Rotation3::new(Vector3::x() * (turned_px / 150.0)).matrix(),
            translation: Vector3::new(0.0, STEP_M as f32, 0.0),
        },
        new: &new,
        past: &past,
        surface: &[],
        gain: Vec::new(),
        told: Vec::new(),
        drift,
        lag: 1,
        repeats: 1.0,
    };
    let zeta = (1.0 / WALL_M) as f32;
    let deviation = off.max(1e-3) * zeta;
    let node = [(1.0 + off) * zeta, 0.0, 1.0, deviation * deviation];
    let nodes = vec![node; WIDTH * HEIGHT];
    lattice.lens.with(MeasureGain {
        pair: &pair,
        nodes: &nodes,
    })
}

/// Largest relative error of the rows' gains, away from the border that smoothing spoils.
fn largest_error(found: &Light, lit: bool) -> f32 {
    let past = |y: usize| found.past.get(y).copied().unwrap_or(1.0);
    let off = |y: usize| {
        let expected = if lit { light(y) } else { 1.0 };
        // By the wall's distance and the step, rows have moved by four.
        (found.gain[y] * past(y + 4) / expected - 1.0).abs()
    };
    (8..HEIGHT - 12).map(off).fold(0.0, f32::max)
}

#[test]
fn rows_of_stripes_that_wrong_ranges_misplace_are_not_taken_for_light() {
    let found = measured([40.0, 0.0], false, OFF);
    assert!(found.past.is_empty());
    let off = largest_error(&found, false);
    assert!(off < WITHIN, "{off}");
}

#[test]
fn rows_of_stripes_that_wrong_poses_shift_are_not_taken_for_light() {
    let told = Drift {
        rotation: (1.0_f32 / 150.0).powi(2),
        translation: 0.0,
    };
    let error = |drift: Drift| {
        let found = measured_turned([40.0, 0.0], false, 0.0, (1.0, drift));
        largest_error(&found, false)
    };
    assert!(error(told) < WITHIN, "{}", error(told));
    // A pose that is told to be exact leaves nothing but light.
    assert!(error(Drift::default()) > WITHIN);
}

#[test]
fn light_over_the_rows_is_found_where_ranges_are_known() {
    for stripes in [[40.0, 0.0], [0.0, 40.0], [30.0, 30.0]] {
        let off = largest_error(&measured(stripes, true, 0.0), true);
        assert!(off < WITHIN, "{stripes:?}: {off}");
    }
}

#[test]
fn light_over_the_rows_is_found_in_stripes_that_ranges_do_not_move() {
    let off = largest_error(&measured([0.0, 40.0], true, OFF), true);
    assert!(off < WITHIN, "{off}");
}

#[test]
fn light_over_the_rows_is_told_from_a_common_error_of_ranges() {
    let off = largest_error(&measured([30.0, 30.0], true, OFF), true);
    assert!(off < 2.0 * WITHIN, "{off}");
}
