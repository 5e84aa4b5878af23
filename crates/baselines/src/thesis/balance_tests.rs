//! The coefficients and rates of the balance against closed forms on a moving plane.

use super::super::edge::contour;
use super::*;
use nalgebra::Vector3;
use sphereflow_core::{DepthMap, Plane, RangeMap};

/// A slanted plane `normal . X = distance` ahead, in the camera's frame.
const DISTANCE_M: f64 = 2.0;
/// Of a domain's volume: the mid-point rule on edges of a pixel, 1/160 of the image plane. Depth on
/// a plane is interpolated exactly between a pinhole's pixels.
const MID_POINT: f64 = 5e-6;
/// The same where the value at the edge is itself interpolated to second order.
const INTERPOLATED: f64 = 5e-4;

fn normal() -> Vector3<f64> {
    Vector3::new(0.3, -0.2, 1.0).normalize()
}

fn cameras() -> [Camera; 2] {
    [
        Camera::pinhole(160.0, 155.0, 79.5, 59.5, 160, 120).unwrap(),
        Camera::fov(160.0, 155.0, 79.5, 59.5, 0.9, 160, 120).unwrap(),
    ]
}

fn ray(camera: &Camera, x: f64, y: f64) -> Vector3<f64> {
    camera.unproject(&Vector2::new(x, y)).unwrap()
}

fn balance(camera: &Camera, wanted: usize) -> Balance {
    let table = EdgeTable::new(camera).unwrap();
    let domains = Domains::new(camera.width(), camera.height(), wanted, false);
    Balance::new(camera, &table, domains)
}

fn depth(camera: &Camera) -> DepthMap {
    DepthMap::new(Plane::from_fn(160, 120, |x, y| {
        let eta = ray(camera, x as f64, y as f64);
        (DISTANCE_M / normal().dot(&eta) * eta.z) as f32
    }))
}

fn range(camera: &Camera) -> RangeMap {
    RangeMap::new(Plane::from_fn(160, 120, |x, y| {
        (DISTANCE_M / normal().dot(&ray(camera, x as f64, y as f64))) as f32
    }))
}

/// Thesis: eq. (6.3): of a plane, the contours' coefficients give the closed form of the rate of
/// the integral of D^3, whatever the motion: `n' = -omega x n`, `d' = -n . v`.
#[test]
fn coefficients_give_the_rate_of_a_moving_plane() {
    let (omega, v) = (Vector3::new(0.4, -0.3, 0.2), Vector3::new(-0.5, 0.2, 0.7));
    let twist = Vector6::new(omega.x, omega.y, omega.z, v.x, v.y, v.z);
    let rate = |eta: &Vector3<f64>| {
        let towards = normal().dot(eta);
        let range = DISTANCE_M / towards;
        let turned = (-omega.cross(&normal())).dot(eta);
        let change = -normal().dot(&v) / towards - DISTANCE_M * turned / (towards * towards);
        3.0 * range * range * change
    };
    for camera in cameras() {
        let table = EdgeTable::new(&camera).unwrap();
        let (depth, range) = (depth(&camera), range(&camera));
        let images = [DepthImage::from(&depth), DepthImage::from(&range)];
        for image in images {
            let exact = camera.model_name() == "pinhole" && image.axis() == Axis::Optical;
            let close = if exact { MID_POINT } else { INTERPOLATED };
            let mut balance = balance(&camera, 20);
            balance.accumulate(&image, &image, TimeRule::Forward);
            let (columns, rows) = (
                balance.domains.columns.clone(),
                balance.domains.rows.clone(),
            );
            for (i, cell) in balance.cells.iter().enumerate() {
                let (column, row) = (i % (columns.len() - 1), i / (columns.len() - 1));
                let ends = [columns[column], columns[column + 1]].map(|x| x as f64 - 0.5);
                let down = [rows[row], rows[row + 1]].map(|y| y as f64 - 0.5);
                let expected = contour::gauss(ends[0], ends[1], |x| {
                    contour::gauss(down[0], down[1], |y| {
                        let area = table.pixel_area(x, y);
                        Vector3::repeat(rate(&ray(&camera, x, y)) * area)
                    })
                })
                .x;
                let found = cell.coefficients.dot(&twist);
                let error = (found - expected).abs() / cell.volume;
                assert!(error < close, "{found} {expected}");
                assert_eq!(cell.change, 0.0);
            }
        }
    }
}

/// Thesis: eq. (6.3): the coefficients are those of contours drawn around each domain alone.
#[test]
fn accumulate_equals_a_loop_around_every_domain() {
    for camera in cameras() {
        let table = EdgeTable::new(&camera).unwrap();
        let mut balance = balance(&camera, 40);
        let map = depth(&camera);
        let image = DepthImage::from(&map);
        balance.accumulate(&image, &image, TimeRule::Trapezoid);
        let across = balance.domains.across();
        for (i, cell) in balance.cells.iter().enumerate() {
            let bounds = |ends: &[usize], k: usize| (ends[k], ends[k + 1]);
            let (x0, x1) = bounds(&balance.domains.columns, i % across);
            let (y0, y1) = bounds(&balance.domains.rows, i / across);
            let mut expected = Vector6::zeros();
            let mut add = |side: Side, x: f64, y: f64| {
                let range = DISTANCE_M / normal().dot(&ray(&camera, x, y));
                let element = table.pixel_edge(side, x, y);
                let tangent = element.tangent * range.powi(3);
                let normal = element.normal * (1.5 * range * range);
                expected += Vector6::new(
                    tangent.x, tangent.y, tangent.z, normal.x, normal.y, normal.z,
                );
            };
            for y in y0..y1 {
                add(Side::LowZ1, x0 as f64 - 0.5, y as f64);
                add(Side::HighZ1, x1 as f64 - 0.5, y as f64);
            }
            for x in x0..x1 {
                add(Side::LowZ2, x as f64, y0 as f64 - 0.5);
                add(Side::HighZ2, x as f64, y1 as f64 - 0.5);
            }
            let close = match camera.model_name() {
                "pinhole" => MID_POINT,
                _ => INTERPOLATED,
            };
            let error = (cell.coefficients - expected).norm() / cell.volume;
            assert!(error < close, "cell {i}: {error}");
        }
    }
}

#[test]
fn accumulate_over_four_cells_cancels_their_inner_edges() {
    let camera = &cameras()[0];
    let mut fine = balance(camera, 48);
    let map = depth(camera);
    let image = DepthImage::from(&map);
    fine.accumulate(&image, &image, TimeRule::Trapezoid);
    assert_eq!((fine.domains.across(), fine.domains.down()), (8, 6));
    let mut coarse = balance(camera, 12);
    coarse.accumulate(&image, &image, TimeRule::Trapezoid);
    assert_eq!((coarse.domains.across(), coarse.domains.down()), (4, 3));
    for (i, cell) in coarse.cells.iter().enumerate() {
        let corner = 2 * (i / 4) * 8 + 2 * (i % 4);
        let parts = [0, 1, 8, 9].map(|k| fine.cells[corner + k]);
        let sum: Vector6<f64> = parts.iter().map(|part| part.coefficients).sum();
        assert!((sum - cell.coefficients).norm() < 1e-13);
        let volume: f64 = parts.iter().map(|part| part.volume).sum();
        assert!((volume - cell.volume).abs() < 1e-12);
    }
}

#[test]
fn accumulate_marks_domains_with_holes_and_leaves_their_neighbours() {
    let camera = &cameras()[0];
    let map = depth(camera);
    let mut holes = map.clone().into_plane();
    holes[(10, 10)] = f32::NAN; // in the first cell
    holes[(19, 5)] = f32::NAN; // on its right border
    let holed = DepthMap::new(holes);
    let (full, part) = (DepthImage::from(&map), DepthImage::from(&holed));
    let mut balance = balance(camera, 48);
    balance.accumulate(&full, &full, TimeRule::Trapezoid);
    let whole = balance.cells.clone();
    let known = balance.accumulate(&full, &part, TimeRule::Trapezoid);
    assert!((known - (1.0 - 2.0 / 19200.0)).abs() < 1e-12, "{known}");
    assert!(balance.cells[0].change.is_nan());
    for (found, expected) in balance.cells.iter().zip(&whole).skip(1) {
        // An edge next to a hole is drawn through the pixels inside: the same on a plane.
        let error = (found.coefficients - expected.coefficients).norm();
        assert!(error < 1e-6 * expected.volume, "{error}");
        assert_eq!(found.change, 0.0);
    }
}
