//! Derivatives of pre-integrated terms against dual numbers.

use super::link::moved;
use super::tests::{GRAVITY, bias, integrate, shift, state};
use super::*;
use crate::dual::{Dual, Square, c, hat, matrix, nudge, vector};
use nalgebra::{Matrix3, SVector};

/// Rounding of a few hundred products and of matrix square roots.
const RELATIVE: f64 = 1e-9;

type Three = [Dual; 3];

fn plus(a: Three, b: Three) -> Three {
    std::array::from_fn(|k| a[k] + b[k])
}

fn minus(a: Three, b: Three) -> Three {
    std::array::from_fn(|k| a[k] - b[k])
}

fn times(m: &Matrix3<f64>, x: Three) -> Three {
    Square::constant(m).apply(x)
}

/// Rotation, position, velocity, biases.
struct State(Square<3>, Three, Three, Three, Three);

/// A state, moved by epsilon along one of its 15 directions.
fn dual_state(state: &InertialState, direction: Option<usize>) -> State {
    let pose = matrix(&state.pose, 1.0);
    let pose = match direction {
        Some(k @ 0..6) => pose.times(&nudge(k)),
        _ => pose,
    };
    let moved = |x: &nalgebra::Vector3<f64>, first: usize| {
        let mut x = vector(x);
        if let Some(k) = direction
            && (first..first + 3).contains(&k)
        {
            x[k - first].d = 1.0;
        }
        x
    };
    State(
        Square::from_fn(|r, k| pose.0[r][k]),
        std::array::from_fn(|r| pose.0[r][3]),
        moved(&state.velocity, 6),
        moved(&state.bias.gyro, 9),
        moved(&state.bias.accel, 12),
    )
}

fn residual(link: &Preintegration, a: &State, b: &State) -> [Dual; 15] {
    let (turn, velocity, position) = link.corrected(&link.bias);
    let [rg, vg, va, pg, pa] = link.by_bias();
    let (g, f) = (
        minus(a.3, vector(&link.bias.gyro)),
        minus(a.4, vector(&link.bias.accel)),
    );
    let base = Square::constant(&turn.to_rotation_matrix().into_inner());
    let turn = base.times(&hat(times(rg, g)).exp());
    let velocity = plus(vector(&velocity), plus(times(vg, g), times(va, f)));
    let position = plus(vector(&position), plus(times(pg, g), times(pa, f)));
    let dt = link.dt;
    let back = a.0.transposed();
    let log = turn.transposed().times(&back.times(&b.0)).log().0;
    let scaled = |x: Three, by: f64| x.map(|x| x * c(by));
    let gain = minus(minus(b.2, a.2), scaled(vector(&GRAVITY), dt));
    let fall = scaled(vector(&GRAVITY), 0.5 * dt * dt);
    let way = minus(minus(minus(b.1, a.1), scaled(a.2, dt)), fall);
    let parts = [
        [log[2][1], log[0][2], log[1][0]],
        minus(back.apply(gain), velocity),
        minus(back.apply(way), position),
        minus(b.3, a.3),
        minus(b.4, a.4),
    ];
    std::array::from_fn(|k| parts[k / 3][k % 3])
}

#[test]
fn derivatives_of_a_link_equal_dual_numbers() {
    let mut window = InertialWindow::new(state(0.2), GRAVITY).unwrap();
    let link = integrate(0.2, 0.6, &bias(), bias());
    window.push(link.clone()).unwrap();
    let states = [
        moved(&window.states()[0], &shift(1.0)),
        moved(&window.states()[1], &shift(2.0)),
    ];
    let (whitened, by_first, by_second) = window.link(0, &states);
    let root = window.root(0);
    for (which, analytic) in [by_first, by_second].iter().enumerate() {
        for k in 0..15 {
            let of = |index: usize| dual_state(&states[index], (index == which).then_some(k));
            let r = residual(&link, &of(0), &of(1));
            let value = root * SVector::<f64, 15>::from_fn(|row, _| r[row].v);
            let slope = root * SVector::<f64, 15>::from_fn(|row, _| r[row].d);
            assert!((value - whitened).norm() < RELATIVE * whitened.norm());
            let error = (slope - analytic.column(k)).norm();
            assert!(
                error < RELATIVE * (1.0 + slope.norm()),
                "{which} {k} {error:e}"
            );
        }
    }
}

/// The recursion again, with biases moved by epsilon.
fn again(samples: &[(nalgebra::Vector3<f64>, nalgebra::Vector3<f64>)], k: usize) -> [Three; 3] {
    let (mut g, mut f) = (vector(&bias().gyro), vector(&bias().accel));
    if k < 3 {
        g[k].d = 1.0;
    } else {
        f[k - 3].d = 1.0;
    }
    let dt = 1e-3;
    let (mut turn, mut v, mut p) = (Square::<3>::identity(), [c(0.0); 3], [c(0.0); 3]);
    for (gyro, accel) in samples {
        let step = minus(vector(gyro), g).map(|x| x * c(dt));
        let middle = turn.times(&hat(step.map(|x| x * c(0.5))).exp());
        let force = middle.apply(minus(vector(accel), f));
        let way = plus(v.map(|x| x * c(dt)), force.map(|x| x * c(0.5 * dt * dt)));
        p = plus(p, way);
        v = plus(v, force.map(|x| x * c(dt)));
        turn = turn.times(&hat(step).exp());
    }
    let value = Square::<3>::from_fn(|r, k| c(turn.0[r][k].v));
    let log = value.transposed().times(&turn).log().0;
    [[log[2][1], log[0][2], log[1][0]], v, p]
}

#[test]
fn derivatives_of_preintegration_by_biases_equal_dual_numbers() {
    let link = integrate(0.1, 0.3, &bias(), bias());
    let samples: Vec<_> = (0..200)
        .map(|k| super::tests::measure(0.1 + (f64::from(k) + 0.5) * 1e-3, &bias()))
        .collect();
    let zero = Matrix3::zeros();
    let [rg, vg, va, pg, pa] = link.by_bias();
    for (first, analytic) in [(0, [rg, vg, pg]), (3, [&zero, va, pa])] {
        for k in 0..3 {
            let found = again(&samples, first + k);
            for (found, analytic) in found.iter().zip(analytic) {
                for (row, found) in found.iter().enumerate() {
                    let error = (found.d - analytic[(row, k)]).abs();
                    assert!(error < RELATIVE, "{first} {k} {row} {error:e}");
                }
            }
        }
    }
}
