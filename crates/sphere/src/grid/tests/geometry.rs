//! Rays, solid angles and edges: exact sums over spheres and rectangles.

use crate::{Camera, SphereGrid};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Solid angles and closed sums of a grid are exact but for rounding: about 1e-16 per pixel.
const EXACT: f64 = 1e-12;

/// Solid angle of the rectangle from the optical axis to `(z1, z2)` at z = 1.
fn corner_rectangle(z1: f64, z2: f64) -> f64 {
    (z1 * z2 / (1.0 + z1 * z1 + z2 * z2).sqrt()).atan()
}

fn grids() -> Vec<SphereGrid> {
    [
        Camera::pinhole(40.0, 42.0, 30.3, 21.7, 64, 48),
        Camera::equirectangular(96, 48),
        Camera::equirectangular(7, 5),
    ]
    .into_iter()
    .map(|camera| SphereGrid::new(&camera.unwrap()).unwrap())
    .collect()
}

#[test]
fn solid_angles_of_the_360_degree_grid_sum_to_the_whole_sphere() {
    for (width, height) in [(4, 2), (5, 3), (96, 48), (1280, 640)] {
        let grid = SphereGrid::new(&Camera::equirectangular(width, height).unwrap()).unwrap();
        // Row by row: one running sum of 819200 values would itself round at 1e-11.
        let rows = grid.solid_angle().chunks(width);
        let sum: f64 = rows.map(|row| row.iter().sum::<f64>()).sum();
        assert!((sum - 4.0 * PI).abs() < EXACT, "{width}x{height}: {sum}");
    }
}

#[test]
fn solid_angles_of_a_pinhole_are_the_closed_form_of_each_rectangle() {
    let (fx, fy, cx, cy) = (40.0, 42.0, 30.3, 21.7);
    let camera = Camera::pinhole(fx, fy, cx, cy, 64, 48).unwrap();
    let grid = SphereGrid::new(&camera).unwrap();
    for (x, y) in [(0, 0), (63, 47), (30, 21), (12, 40)] {
        let a = |u: f64| (x as f64 + u - cx) / fx;
        let b = |v: f64| (y as f64 + v - cy) / fy;
        let expected = corner_rectangle(a(0.5), b(0.5))
            - corner_rectangle(a(-0.5), b(0.5))
            - corner_rectangle(a(0.5), b(-0.5))
            + corner_rectangle(a(-0.5), b(-0.5));
        let found = grid.solid_angle()[y * 64 + x];
        assert!((found - expected).abs() < EXACT * expected.max(1e-3));
    }
}

#[test]
fn edge_normals_point_to_larger_x_and_y_and_tangents_turn_with_eta() {
    for grid in grids() {
        for y in 1..grid.height() {
            for x in 1..grid.width() {
                let (across, down) = (grid.edge_x(x, y), grid.edge_y(x, y));
                let step_x = grid.ray(x, y) - grid.ray(x - 1, y);
                let step_y = grid.ray(x, y) - grid.ray(x, y - 1);
                assert!(across.normal_length.dot(&step_x) > 0.0);
                assert!(down.normal_length.dot(&step_y) > 0.0);
                for edge in [across, down] {
                    let turned = edge.middle.cross(&edge.normal_length);
                    assert!(turned.cross(&edge.tangent_length).norm() < EXACT);
                    assert!(turned.dot(&edge.tangent_length) > 0.0);
                }
            }
        }
    }
}

#[test]
fn edges_around_every_pixel_close() {
    // The sum of outward (eta x n) dl is a closed contour; the sum of outward n dl is minus twice
    // the integral of eta (the divergence of a constant vector's tangential part is -2 eta.P).
    for grid in grids() {
        for y in 0..grid.height() {
            for x in 0..grid.width() {
                let (left, right) = (grid.edge_x(x, y), grid.edge_x(x + 1, y));
                let (top, bottom) = (grid.edge_y(x, y), grid.edge_y(x, y + 1));
                let contour = right.tangent_length - left.tangent_length + bottom.tangent_length
                    - top.tangent_length;
                assert!(contour.norm() < EXACT);
                let normals = right.normal_length - left.normal_length + bottom.normal_length
                    - top.normal_length;
                let area = grid.solid_angle()[y * grid.width() + x];
                // The mean ray of a pixel is shorter than 1 and off its centre: half a pixel at most.
                let mean_ray = -0.5 * normals / area;
                let size = left.tangent_length.norm()
                    + right.tangent_length.norm()
                    + top.tangent_length.norm()
                    + bottom.tangent_length.norm();
                assert!((mean_ray - grid.ray(x, y)).norm() < 0.25 * size);
            }
        }
    }
}

#[test]
fn edges_of_a_wrapping_grid_are_the_same_on_both_borders() {
    let grid = SphereGrid::new(&Camera::equirectangular(31, 16).unwrap()).unwrap();
    for y in 0..16 {
        assert_eq!(grid.edge_x(0, y), grid.edge_x(31, y));
        let west = grid.ray(30, y) - grid.ray(0, y);
        assert!(grid.edge_x(0, y).normal_length.dot(&west) < 0.0);
    }
}

#[test]
fn pole_edges_have_no_length() {
    let grid = SphereGrid::new(&Camera::equirectangular(32, 16).unwrap()).unwrap();
    for x in 0..32 {
        for (y, pole) in [(0, -Vector3::y()), (16, Vector3::y())] {
            let edge = grid.edge_y(x, y);
            assert_eq!(edge.normal_length, Vector3::zeros());
            assert_eq!(edge.tangent_length, Vector3::zeros());
            assert!((edge.middle - pole).norm() < EXACT);
        }
    }
}

#[test]
fn grid_refuses_a_sphere_of_three_columns() {
    let error = SphereGrid::new(&Camera::equirectangular(3, 2).unwrap()).unwrap_err();
    assert!(error.to_string().contains("camera size"), "{error}");
}

#[test]
fn grid_refuses_a_sphere_that_does_not_close() {
    let model = Camera::equirectangular(64, 32).unwrap().model().clone();
    for (width, height) in [(60, 32), (64, 30), (64, 34)] {
        let camera = Camera::new(model.clone(), width, height).unwrap();
        let error = SphereGrid::new(&camera)
            .err()
            .map(|error| error.to_string());
        assert!(error.is_some_and(|error| error.contains("does not close")));
    }
}
