//! Dual numbers for tests: derivatives without steps, of formulas written a second time.
//!
//! A group element moved by `epsilon` times a generator is exactly `I + epsilon E`, and logarithms
//! are those of matrices (square roots and a series), so that nothing here shares a closed form with
//! what it checks.

use nalgebra::{SMatrix, Vector3};
use sphereflow_core::Pose;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// `v + d epsilon` with `epsilon^2 = 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual {
    pub v: f64,
    pub d: f64,
}

/// The constant `v`.
pub fn c(v: f64) -> Dual {
    Dual { v, d: 0.0 }
}

impl Dual {
    fn of(v: f64, slope: f64, by: Self) -> Self {
        Self { v, d: slope * by.d }
    }

    pub fn sqrt(self) -> Self {
        let root = self.v.sqrt();
        Self::of(root, 0.5 / root, self)
    }

    pub fn ln(self) -> Self {
        Self::of(self.v.ln(), 1.0 / self.v, self)
    }

    pub fn tan(self) -> Self {
        let tan = self.v.tan();
        Self::of(tan, 1.0 + tan * tan, self)
    }

    pub fn atan2(self, x: Self) -> Self {
        let norm = self.v * self.v + x.v * x.v;
        Self {
            v: self.v.atan2(x.v),
            d: (x.v * self.d - self.v * x.d) / norm,
        }
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self {
            v: self.v + o.v,
            d: self.d + o.d,
        }
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            v: -self.v,
            d: -self.d,
        }
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self {
            v: self.v * o.v,
            d: self.d * o.v + self.v * o.d,
        }
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let v = self.v / o.v;
        Self {
            v,
            d: (self.d - v * o.d) / o.v,
        }
    }
}

/// A square matrix of dual numbers, by rows.
#[derive(Clone, Copy, Debug)]
pub struct Square<const N: usize>(pub [[Dual; N]; N]);

impl<const N: usize> Square<N> {
    pub fn from_fn(f: impl Fn(usize, usize) -> Dual) -> Self {
        Self(std::array::from_fn(|r| std::array::from_fn(|c| f(r, c))))
    }

    pub fn constant(m: &SMatrix<f64, N, N>) -> Self {
        Self::from_fn(|r, k| c(m[(r, k)]))
    }

    pub fn identity() -> Self {
        Self::constant(&SMatrix::identity())
    }

    pub fn times(&self, o: &Self) -> Self {
        Self::from_fn(|r, k| (0..N).fold(c(0.0), |sum, j| sum + self.0[r][j] * o.0[j][k]))
    }

    pub fn plus(&self, o: &Self) -> Self {
        Self::from_fn(|r, k| self.0[r][k] + o.0[r][k])
    }

    pub fn scaled(&self, by: f64) -> Self {
        Self::from_fn(|r, k| self.0[r][k] * c(by))
    }

    pub fn transposed(&self) -> Self {
        Self::from_fn(|r, k| self.0[k][r])
    }

    pub fn apply(&self, x: [Dual; N]) -> [Dual; N] {
        std::array::from_fn(|r| (0..N).fold(c(0.0), |sum, k| sum + self.0[r][k] * x[k]))
    }

    /// Gauss-Jordan with the largest pivot.
    pub fn inverse(&self) -> Self {
        let (mut a, mut b) = (self.0, Self::identity().0);
        for k in 0..N {
            let pivot = (k..N)
                .max_by(|&i, &j| a[i][k].v.abs().total_cmp(&a[j][k].v.abs()))
                .unwrap();
            a.swap(k, pivot);
            b.swap(k, pivot);
            let by = a[k][k];
            for j in 0..N {
                (a[k][j], b[k][j]) = (a[k][j] / by, b[k][j] / by);
            }
            for r in (0..N).filter(|&r| r != k) {
                let by = a[r][k];
                for j in 0..N {
                    a[r][j] = a[r][j] - by * a[k][j];
                    b[r][j] = b[r][j] - by * b[k][j];
                }
            }
        }
        Self(b)
    }

    /// The series, of an argument halved six times.
    pub fn exp(&self) -> Self {
        let small = self.scaled(1.0 / 64.0);
        let (mut sum, mut term) = (Self::identity(), Self::identity());
        for k in 1..16 {
            term = term.times(&small).scaled(1.0 / f64::from(k));
            sum = sum.plus(&term);
        }
        (0..6).fold(sum, |m, _| m.times(&m))
    }

    /// Square roots (Denman and Beavers) until the series is short.
    pub fn log(&self) -> Self {
        let (mut m, roots) = (*self, 6);
        for _ in 0..roots {
            let (mut y, mut z) = (m, Self::identity());
            for _ in 0..12 {
                let (y1, z1) = (y.plus(&z.inverse()), z.plus(&y.inverse()));
                (y, z) = (y1.scaled(0.5), z1.scaled(0.5));
            }
            m = y;
        }
        let x = m.plus(&Self::identity().scaled(-1.0));
        let (mut sum, mut power) = (x, x);
        for k in 2..14 {
            power = power.times(&x);
            sum = sum.plus(&power.scaled(if k % 2 == 0 { -1.0 } else { 1.0 } / f64::from(k)));
        }
        sum.scaled(f64::from(1 << roots))
    }
}

/// `[x]_`.
pub fn hat(x: [Dual; 3]) -> Square<3> {
    let o = c(0.0);
    Square([[o, -x[2], x[1]], [x[2], o, -x[0]], [-x[1], x[0], o]])
}

/// A constant vector.
pub fn vector(x: &Vector3<f64>) -> [Dual; 3] {
    [c(x.x), c(x.y), c(x.z)]
}

/// The 4 x 4 matrix of a pose with a scale.
pub fn matrix(pose: &Pose, scale: f64) -> Square<4> {
    let mut m = pose.matrix();
    for r in 0..3 {
        for k in 0..3 {
            m[(r, k)] *= scale;
        }
    }
    Square::constant(&m)
}

/// The identity moved by `epsilon` along coordinate `k` of `[omega, v, sigma]`.
pub fn nudge(k: usize) -> Square<4> {
    let mut m = Square::identity();
    let epsilon = Dual { v: 0.0, d: 1.0 };
    let mut axis = [c(0.0); 3];
    match k {
        0..3 => {
            axis[k] = epsilon;
            let turn = hat(axis);
            for r in 0..3 {
                for j in 0..3 {
                    m.0[r][j] = m.0[r][j] + turn.0[r][j];
                }
            }
        }
        3..6 => m.0[k - 3][3] = epsilon,
        _ => (0..3).for_each(|r| m.0[r][r] = m.0[r][r] + epsilon),
    }
    m
}

/// `[omega, v, sigma]` of the logarithm of a transform.
pub fn tangent(m: &Square<4>) -> [Dual; 7] {
    let l = m.log().0;
    [
        l[2][1], l[0][2], l[1][0], l[0][3], l[1][3], l[2][3], l[0][0],
    ]
}

/// The squared norm of `root x`.
pub fn squared<const R: usize>(root: &SMatrix<f64, R, R>, x: [Dual; R]) -> Dual {
    let image = Square::constant(root).apply(x);
    image.iter().fold(c(0.0), |sum, e| sum + *e * *e)
}

#[test]
fn logarithm_of_exponential_is_the_argument_with_its_derivative() {
    let x: [Dual; 3] = [(0.4, 1.0), (-0.7, 0.2), (0.5, -0.3)].map(|(v, d)| Dual { v, d });
    let back = hat(x).exp().log();
    for (found, expected) in [back.0[2][1], back.0[0][2], back.0[1][0]].iter().zip(x) {
        // rounding of a few hundred products
        assert!((found.v - expected.v).abs() < 1e-12);
        assert!((found.d - expected.d).abs() < 1e-11);
    }
}
