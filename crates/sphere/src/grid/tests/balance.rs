//! What the discrete operators keep exactly: Gauss's theorem, constants, rotations, unknowns.

use super::fields::{Exact, Exponential};
use crate::grid::lattice::{Axis, Sides};
use crate::{Border, Camera, SphereGrid};
use nalgebra::{DMatrix, DVector, Rotation3, Vector3};

/// Rounding of sums over some thousand pixels of values near 1.
const ROUNDING: f64 = 1e-12;

fn pinhole() -> SphereGrid {
    SphereGrid::new(&Camera::pinhole(40.0, 43.0, 31.0, 25.0, 64, 48).unwrap()).unwrap()
}

fn sphere() -> SphereGrid {
    SphereGrid::new(&Camera::equirectangular(64, 32).unwrap()).unwrap()
}

fn exact() -> Exponential {
    Exponential(Vector3::new(0.7, -0.9, 0.5), Vector3::new(-0.4, 0.6, 1.1))
}

/// A ragged set of pixels: two discs and a few lone pixels.
fn in_set(x: usize, y: usize) -> bool {
    let near = |u: f64, v: f64, r: f64| (x as f64 - u).hypot(y as f64 - v) < r;
    near(3.0, 5.0, 9.5) || near(50.0, 25.0, 12.0) || (x * 7 + y * 13).is_multiple_of(31)
}

/// Sum of `flux` outwards over the border of the set, each edge once.
fn border_sum(grid: &SphereGrid, flux: impl Fn(Axis, usize, usize) -> f64) -> f64 {
    let (width, height) = (grid.width(), grid.height());
    let mut sum = 0.0;
    for axis in [Axis::X, Axis::Y] {
        let columns = match axis {
            Axis::X if !grid.wraps_around() => width + 1,
            _ => width,
        };
        let rows = height + usize::from(axis == Axis::Y);
        for (x, y) in (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))) {
            let [before, after] = grid.lattice.beside(axis, x, y);
            let inside = |(x, y)| in_set(x, y);
            let (before, after) = match grid.table(axis).sides(x, y) {
                Sides::Closed => (false, false),
                Sides::Inner => (inside(before), inside(after)),
                Sides::After => (false, inside(after)),
                Sides::Before => (inside(before), false),
            };
            let sign = f64::from(u8::from(before)) - f64::from(u8::from(after));
            sum += if sign == 0.0 {
                0.0
            } else {
                sign * flux(axis, x, y)
            };
        }
    }
    sum
}

fn area_sum(grid: &SphereGrid, values: &[f64]) -> f64 {
    let pixels = (0..values.len()).filter(|i| in_set(i % grid.width(), i / grid.width()));
    pixels.map(|i| values[i] * grid.solid_angle()[i]).sum()
}

/// [`border_sum`] of `flux`, on the whole sphere with what it adds for values at the centres.
fn full_border_sum(grid: &SphereGrid, flux: impl Fn(Axis, usize, usize) -> f64 + Sync) -> f64 {
    let Some(whole) = &grid.whole else {
        return border_sum(grid, flux);
    };
    let mut means = vec![0.0; grid.rays().len()];
    grid.balance_into(&mut means, &flux).unwrap();
    border_sum(grid, |axis, x, y| {
        flux(axis, x, y) + whole.centring_flux(&means, axis, x, y)
    })
}

/// Gauss's theorem on the ragged set, for both operators.
fn assert_gauss(grid: &SphereGrid, scalar: &[f64], vector: &[Vector3<f64>]) {
    for border in [Border::Extrapolate, Border::ZeroFlux] {
        let mut out = vec![0.0; scalar.len()];
        grid.divergence_into(vector, border, &mut out).unwrap();
        let flux = full_border_sum(grid, |axis, x, y| match &grid.whole {
            None => grid.flux(axis, vector, x, y, border),
            Some(whole) => grid.whole_flux(whole, axis, vector, (x, y)),
        });
        assert!((area_sum(grid, &out) - flux).abs() < ROUNDING);
        grid.laplacian_into(scalar, border, &mut out).unwrap();
        let flux = full_border_sum(grid, |axis, x, y| match &grid.whole {
            None => grid.gradient_flux(axis, scalar, x, y, border),
            Some(whole) => grid.whole_gradient_flux(whole, axis, scalar, (x, y)),
        });
        assert!((area_sum(grid, &out) - flux).abs() < ROUNDING);
    }
}

#[test]
fn gauss_theorem_holds_to_rounding_on_any_set_of_pixels() {
    let odd = SphereGrid::new(&Camera::equirectangular(65, 32).unwrap()).unwrap();
    for grid in [pinhole(), sphere(), odd] {
        let vector: Vec<_> = grid.rays().iter().map(|ray| exact().vector(ray)).collect();
        let scalar: Vec<_> = grid.rays().iter().map(|ray| exact().value(ray)).collect();
        assert_gauss(&grid, &scalar, &vector);
    }
}

#[test]
fn gauss_theorem_holds_where_an_unknown_pixel_narrows_the_stencils() {
    let grid = sphere();
    let mut scalar: Vec<_> = grid.rays().iter().map(|ray| exact().value(ray)).collect();
    // Two rows below the disc around (3, 5), which ends in row 14.
    scalar[16 * grid.width() + 3] = f64::NAN;
    let pixels = scalar.iter().zip(grid.rays());
    let vector: Vec<_> = pixels.map(|(f, ray)| exact().vector(ray) * *f).collect();
    assert_gauss(&grid, &scalar, &vector);
}

#[test]
fn balances_over_the_closed_sphere_sum_to_zero() {
    let grid = sphere();
    let vector: Vec<_> = grid.rays().iter().map(|ray| exact().vector(ray)).collect();
    let scalar: Vec<_> = grid.rays().iter().map(|ray| exact().value(ray)).collect();
    for balance in [grid.divergence(&vector), grid.laplacian(&scalar)] {
        let balance = balance.unwrap();
        let sum: f64 = balance
            .iter()
            .zip(grid.solid_angle())
            .map(|(d, a)| d * a)
            .sum();
        assert!(sum.abs() < ROUNDING);
    }
}

#[test]
fn laplacian_on_the_whole_sphere_damps_every_field_but_the_constant() {
    // What diffuses must not grow: the eigenvalues of the matrix have no positive real part.
    for (width, height) in [(16, 8), (17, 8), (8, 8), (24, 6), (4, 2), (5, 3)] {
        let grid = SphereGrid::new(&Camera::equirectangular(width, height).unwrap()).unwrap();
        let count = width * height;
        let columns: Vec<_> = (0..count)
            .map(|index| {
                let mut unit = vec![0.0; count];
                unit[index] = 1.0;
                DVector::from_vec(grid.laplacian(&unit).unwrap())
            })
            .collect();
        let values = DMatrix::from_columns(&columns).complex_eigenvalues();
        let mut growth: Vec<_> = values.iter().map(|value| value.re).collect();
        growth.sort_by(f64::total_cmp);
        let [.., linear, constant] = growth[..] else {
            panic!("no eigenvalues");
        };
        // Rounding of values up to 1e3; the next modes are the linear fields, of -2.
        assert!(constant.abs() < 1e-9 && linear < -1.0);
    }
}

#[test]
fn divergence_of_a_rotation_field_vanishes_under_refinement() {
    // Thesis: eq. (A.7): div(eta x P) = 0. The rotation about the poles is exact by symmetry.
    let p = Vector3::new(0.0, 2.0, 0.0);
    let grid = sphere();
    let vector: Vec<_> = grid.rays().iter().map(|ray| ray.cross(&p)).collect();
    let worst = grid.divergence(&vector).unwrap().into_iter().map(f64::abs);
    assert!(worst.fold(0.0, f64::max) < ROUNDING);
    let axis = Vector3::new(0.3, -0.2, 0.9);
    assert_quarters_when_doubled(|ray| ray.cross(&axis));
}

/// The divergence of a field that has none: below 1 % on the coarse pinhole, and a quarter of that
/// (with 20 % for higher terms) on pixels half as large.
fn assert_quarters_when_doubled(field: impl Fn(&Vector3<f64>) -> Vector3<f64>) {
    let worst = [1, 2].map(|n| {
        let s = n as f64;
        let camera = Camera::pinhole(40.0 * s, 43.0 * s, 31.0 * s, 25.0 * s, 64 * n, 48 * n);
        let grid = SphereGrid::new(&camera.unwrap()).unwrap();
        let vector: Vec<_> = grid.rays().iter().map(&field).collect();
        let found = grid.divergence(&vector).unwrap().into_iter().map(f64::abs);
        found.fold(0.0, f64::max)
    });
    assert!(worst[0] < 1e-2 && worst[1] < 0.3 * worst[0], "{worst:?}");
}

#[test]
fn constants_have_neither_gradient_nor_laplacian() {
    for grid in [pinhole(), sphere()] {
        let field = vec![3.0; grid.rays().len()];
        assert!(
            grid.gradient(&field)
                .unwrap()
                .iter()
                .all(|g| *g == Vector3::zeros())
        );
        assert!(grid.laplacian(&field).unwrap().iter().all(|v| *v == 0.0));
    }
}

#[test]
fn divergence_of_a_radial_field_vanishes_under_refinement() {
    assert_quarters_when_doubled(|ray| ray * (1.0 + 0.5 * ray.x));
}

#[test]
fn operators_turn_with_the_sphere() {
    // SO(3) invariance: the grid of turned rays sees the turned field with turned gradients.
    let rotation = Rotation3::from_euler_angles(0.4, -1.1, 2.3);
    let camera = Camera::pinhole(40.0, 43.0, 31.0, 25.0, 64, 48).unwrap();
    let grid = SphereGrid::new(&camera).unwrap();
    let turned = SphereGrid::with_rays(&camera, |pixel| {
        camera.unproject(pixel).map(|ray| rotation * ray)
    })
    .unwrap();
    let scalar: Vec<_> = grid.rays().iter().map(|ray| exact().value(ray)).collect();
    let vector: Vec<_> = grid.rays().iter().map(|ray| exact().vector(ray)).collect();
    let turned_vector: Vec<_> = vector.iter().map(|v| rotation * v).collect();
    let gradients = (
        grid.gradient(&scalar).unwrap(),
        turned.gradient(&scalar).unwrap(),
    );
    let divergences = (
        grid.divergence(&vector).unwrap(),
        turned.divergence(&turned_vector).unwrap(),
    );
    let laplacians = (
        grid.laplacian(&scalar).unwrap(),
        turned.laplacian(&scalar).unwrap(),
    );
    // Rounding of second differences: 1e-16 over a squared pixel of 6e-4.
    let close = |a: f64, b: f64| (a - b).abs() < 1e-10;
    for i in 0..scalar.len() {
        assert!((rotation * gradients.0[i] - gradients.1[i]).norm() < 1e-11);
        assert!(close(divergences.0[i], divergences.1[i]));
        assert!(close(laplacians.0[i], laplacians.1[i]));
        assert!(close(grid.solid_angle()[i], turned.solid_angle()[i]));
    }
}

#[test]
fn unknown_pixels_reach_their_neighbours_only() {
    for grid in [pinhole(), sphere()] {
        let width = grid.width();
        let mut field: Vec<_> = grid.rays().iter().map(|ray| exact().value(ray)).collect();
        field[20 * width + 30] = f64::NAN;
        let vector: Vec<_> = field.iter().zip(grid.rays()).map(|(f, r)| r * *f).collect();
        let gradient = grid.gradient(&field).unwrap();
        let divergence = grid.divergence(&vector).unwrap();
        let laplacian = grid.laplacian(&field).unwrap();
        for (x, y) in (0..grid.height()).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let (dx, dy) = (x.abs_diff(30), y.abs_diff(20));
            let i = y * width + x;
            assert_eq!(gradient[i].x.is_nan(), dx + dy <= 1, "gradient at {x}, {y}");
            assert_eq!(
                divergence[i].is_nan(),
                dx + dy <= 1,
                "divergence at {x}, {y}"
            );
            assert!(
                !laplacian[i].is_nan() || (dx <= 1 && dy <= 1),
                "laplacian at {x}, {y}"
            );
            assert!(
                laplacian[i].is_nan() || dx + dy > 1,
                "laplacian at {x}, {y}"
            );
        }
    }
}

#[test]
fn unknown_pixels_beside_a_pole_do_not_reach_beyond_it() {
    let grid = sphere();
    let width = grid.width();
    for unknown_row in [0, 1] {
        let mut field: Vec<_> = grid.rays().iter().map(|ray| exact().value(ray)).collect();
        field[unknown_row * width + 30] = f64::NAN;
        let vector: Vec<_> = field.iter().zip(grid.rays()).map(|(f, r)| r * *f).collect();
        let (divergence, laplacian) = (grid.divergence(&vector), grid.laplacian(&field));
        for values in [divergence.unwrap(), laplacian.unwrap()] {
            for (i, value) in values.iter().enumerate() {
                let distance = (i % width).abs_diff(30) + (i / width).abs_diff(unknown_row);
                assert_eq!(value.is_nan(), distance <= 1, "pixel {i}");
            }
        }
    }
}

#[test]
fn zero_flux_keeps_the_mean_of_what_diffuses() {
    // Thesis: eq. (2.14): without flux through the border the integral of the Laplacian is zero.
    let grid = pinhole();
    let field: Vec<_> = grid.rays().iter().map(|ray| exact().value(ray)).collect();
    let mut out = vec![0.0; field.len()];
    grid.laplacian_into(&field, Border::ZeroFlux, &mut out)
        .unwrap();
    let sum: f64 = out.iter().zip(grid.solid_angle()).map(|(v, a)| v * a).sum();
    assert!(sum.abs() < ROUNDING);
}

#[test]
fn operators_refuse_fields_of_another_size() {
    let grid = pinhole();
    let error = grid.gradient(&[0.0; 5]).unwrap_err().to_string();
    assert!(error.contains("field") && error.contains("64x48") && error.contains("5 values"));
    let mut short = [0.0; 4];
    let field = vec![0.0; 64 * 48];
    let error = grid
        .laplacian_into(&field, Border::ZeroFlux, &mut short)
        .unwrap_err();
    assert!(error.to_string().contains("out"));
    assert!(grid.divergence(&[Vector3::zeros(); 3]).is_err());
}
