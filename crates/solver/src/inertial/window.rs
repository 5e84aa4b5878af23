//! A window of states (pose, velocity, biases) tied by pre-integrated samples and measured poses.

use super::preintegration::{ImuBias, Preintegration, finite};
use crate::linear::{BlockPattern, BlockSolver, LinearSolver};
use crate::minimise::{Step, System, damping_term, minimise};
use crate::options::{Damping, Options};
use crate::summary::Summary;
use crate::{Error, Result};
use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector3};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::{se3, so3};

/// Numbers of a state's update: `[omega, v]` of the pose in the body frame (`T <- T exp`), velocity,
/// gyrometer bias, accelerometer bias.
const STATE: usize = 15;
type Matrix15 = SMatrix<f64, STATE, STATE>;
type Vector15 = SVector<f64, STATE>;

/// The state at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct InertialState {
    /// World from body (the IMU's frame).
    pub pose: Pose,
    /// Velocity in the world, m/s.
    pub velocity: Vector3<f64>,
    /// Biases.
    pub bias: ImuBias,
}

#[derive(Clone, Debug)]
struct Measured {
    state: usize,
    inverse: Pose,
    root: Matrix6<f64>,
}

#[derive(Clone, Debug)]
struct BiasPrior {
    state: usize,
    bias: ImuBias,
    root: [f64; 2],
}

/// Consecutive states, with one pre-integration between each and the next, measured poses (bundle
/// adjustment's, with their covariances) and a bias known to some degree.
#[derive(Clone, Debug)]
pub struct InertialWindow {
    gravity: Vector3<f64>,
    states: Vec<InertialState>,
    candidate: Vec<InertialState>,
    links: Vec<Preintegration>,
    roots: Vec<Matrix15>,
    measured: Vec<Measured>,
    bias_priors: Vec<BiasPrior>,
}

impl InertialWindow {
    /// A window that begins with `first`; `gravity` in the world, m/s^2, points down.
    ///
    /// # Errors
    /// Where a number is not finite.
    pub fn new(first: InertialState, gravity: Vector3<f64>) -> Result<Self> {
        finite("gravity", &gravity)?;
        check(&first)?;
        Ok(Self {
            gravity,
            states: vec![first],
            candidate: vec![first],
            links: Vec::new(),
            roots: Vec::new(),
            measured: Vec::new(),
            bias_priors: Vec::new(),
        })
    }

    /// The next state, where the samples since the last one lead.
    ///
    /// # Errors
    /// Where nothing was integrated.
    pub fn push(&mut self, since_last: Preintegration) -> Result<usize> {
        let dt = since_last.dt;
        if dt <= 0.0 {
            return Err(Error::value("since_last", "integrated samples", "none"));
        }
        let mut covariance = Matrix15::zeros();
        covariance
            .fixed_view_mut::<9, 9>(0, 0)
            .copy_from(&since_last.covariance);
        let sigmas = since_last.sigmas;
        for k in 0..3 {
            covariance[(9 + k, 9 + k)] = sigmas.gyro_walk.powi(2) * dt;
            covariance[(12 + k, 12 + k)] = sigmas.accel_walk.powi(2) * dt;
        }
        let inverse = covariance.cholesky().map(|factor| factor.inverse());
        let root = inverse.and_then(|information| information.cholesky());
        let Some(root) = root else {
            let expected = "two samples or more: the covariance of one is singular";
            return Err(Error::value("since_last", expected, "fewer"));
        };
        let last = self.states[self.states.len() - 1];
        let (turn, velocity, position) = since_last.corrected(&last.bias);
        let rotation = last.pose.rotation;
        let moved = last.velocity * dt + self.gravity * (0.5 * dt * dt) + rotation * position;
        let next = InertialState {
            pose: Pose::new(rotation * turn, last.pose.translation + moved),
            velocity: last.velocity + self.gravity * dt + rotation * velocity,
            bias: last.bias,
        };
        self.states.push(next);
        self.candidate.push(next);
        self.links.push(since_last);
        self.roots.push(root.l().transpose());
        Ok(self.states.len() - 1)
    }

    /// A measured pose of a state, with the covariance of its twist in the body frame.
    ///
    /// # Errors
    /// Where the state is unknown or the covariance is not positive definite.
    pub fn add_pose(
        &mut self,
        state: usize,
        world_from_body: Pose,
        covariance: &Matrix6<f64>,
    ) -> Result<()> {
        self.known(state)?;
        finite("world_from_body", &world_from_body.translation)?;
        self.measured.push(Measured {
            state,
            inverse: world_from_body.inverse(),
            root: crate::bundle::root_information("covariance", covariance)?,
        });
        Ok(())
    }

    /// Known biases of a state, with one standard deviation for each sensor.
    ///
    /// # Errors
    /// Where the state is unknown or a number is not finite or not positive.
    pub fn add_bias(
        &mut self,
        state: usize,
        bias: ImuBias,
        (gyro_sigma, accel_sigma): (f64, f64),
    ) -> Result<()> {
        self.known(state)?;
        for (name, value) in [("gyro_sigma", gyro_sigma), ("accel_sigma", accel_sigma)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::value(name, "a positive number", value));
            }
        }
        let root = [1.0 / gyro_sigma, 1.0 / accel_sigma];
        self.bias_priors.push(BiasPrior { state, bias, root });
        Ok(())
    }

    /// The states.
    pub fn states(&self) -> &[InertialState] {
        &self.states
    }

    /// Minimise from the present states on. Biases move the pre-integrated samples to first order:
    /// integrate again where they moved far.
    ///
    /// # Errors
    /// Where a setting is outside its domain.
    pub fn solve(&mut self, options: &Options) -> Result<Summary> {
        let states = self.states.len();
        let (mut starts, mut members) = (vec![0], Vec::new());
        for k in 1..states as u32 {
            members.extend([k - 1, k]);
            starts.push(members.len());
        }
        let pattern = BlockPattern::from_groups(vec![STATE; states], &starts, &members);
        let n = pattern.dimension();
        let mut system = WindowSystem {
            solver: BlockSolver::new(&pattern, LinearSolver::Auto),
            values: vec![0.0; pattern.len()],
            damped: vec![0.0; pattern.len()],
            gradient: vec![0.0; n],
            step: vec![0.0; n],
            pattern,
            window: self,
        };
        minimise(&mut system, options)
    }

    #[cfg(test)]
    pub(super) fn root(&self, link: usize) -> &Matrix15 {
        &self.roots[link]
    }

    fn known(&self, state: usize) -> Result<()> {
        if state < self.states.len() {
            return Ok(());
        }
        let expected = format!("an index below {}", self.states.len());
        Err(Error::value("state", expected, state))
    }

    /// Whitened residual of a link and its derivatives by both states.
    pub(super) fn link(
        &self,
        k: usize,
        states: &[InertialState],
    ) -> (Vector15, Matrix15, Matrix15) {
        let (a, b, link) = (&states[k], &states[k + 1], &self.links[k]);
        let (dt, g) = (link.dt, self.gravity);
        let (turn, velocity, position) = link.corrected(&a.bias);
        let back = a.pose.rotation.inverse();
        let error = so3::log(&(turn.inverse() * back * b.pose.rotation));
        let fall = back * (b.velocity - a.velocity - g * dt);
        let way = b.pose.translation - a.pose.translation - a.velocity * dt - g * (0.5 * dt * dt);
        let way = back * way;
        let mut r = Vector15::zeros();
        r.fixed_rows_mut::<3>(0).copy_from(&error);
        r.fixed_rows_mut::<3>(3).copy_from(&(fall - velocity));
        r.fixed_rows_mut::<3>(6).copy_from(&(way - position));
        r.fixed_rows_mut::<3>(9)
            .copy_from(&(b.bias.gyro - a.bias.gyro));
        r.fixed_rows_mut::<3>(12)
            .copy_from(&(b.bias.accel - a.bias.accel));
        let (mut ja, mut jb) = (Matrix15::zeros(), Matrix15::zeros());
        let identity = Matrix3::identity();
        let inverse = so3::right_jacobian_inverse(&error);
        let relative = so3::adjoint(&(b.pose.rotation.inverse() * a.pose.rotation));
        let back = so3::adjoint(&back);
        let [rg, vg, va, pg, pa] = link.by_bias();
        let drift = rg * (a.bias.gyro - link.bias.gyro);
        let by_gyro =
            -inverse * so3::adjoint(&so3::exp(&error).inverse()) * so3::right_jacobian(&drift) * rg;
        let put = |m: &mut Matrix15, row: usize, column: usize, block: &Matrix3<f64>| {
            m.fixed_view_mut::<3, 3>(row, column).copy_from(block);
        };
        put(&mut ja, 0, 0, &(-inverse * relative));
        put(&mut jb, 0, 0, &inverse);
        put(&mut ja, 0, 9, &by_gyro);
        put(&mut ja, 3, 0, &so3::hat(&fall));
        put(&mut ja, 3, 6, &-back);
        put(&mut jb, 3, 6, &back);
        put(&mut ja, 3, 9, &-vg);
        put(&mut ja, 3, 12, &-va);
        put(&mut ja, 6, 0, &so3::hat(&way));
        put(&mut ja, 6, 3, &-identity);
        put(&mut ja, 6, 6, &(-back * dt));
        put(
            &mut jb,
            6,
            3,
            &so3::adjoint(&(a.pose.rotation.inverse() * b.pose.rotation)),
        );
        put(&mut ja, 6, 9, &-pg);
        put(&mut ja, 6, 12, &-pa);
        for column in [9, 12] {
            put(&mut ja, column, column, &-identity);
            put(&mut jb, column, column, &identity);
        }
        let root = &self.roots[k];
        (root * r, root * ja, root * jb)
    }
}

fn check(state: &InertialState) -> Result<()> {
    finite("pose", &state.pose.translation)?;
    finite("pose", &state.pose.rotation.imag())?;
    finite("velocity", &state.velocity)?;
    finite("bias.gyro", &state.bias.gyro)?;
    finite("bias.accel", &state.bias.accel)
}

/// A state moved by an update.
pub(super) fn moved(state: &InertialState, d: &Vector15) -> InertialState {
    let part = |k: usize| Vector3::new(d[k], d[k + 1], d[k + 2]);
    InertialState {
        pose: state.pose * se3::exp(&d.fixed_rows::<6>(0).into_owned()),
        velocity: state.velocity + part(6),
        bias: ImuBias {
            gyro: state.bias.gyro + part(9),
            accel: state.bias.accel + part(12),
        },
    }
}

pub(super) struct WindowSystem<'a> {
    window: &'a mut InertialWindow,
    pattern: BlockPattern,
    solver: BlockSolver,
    values: Vec<f64>,
    damped: Vec<f64>,
    gradient: Vec<f64>,
    step: Vec<f64>,
}

impl WindowSystem<'_> {
    fn evaluate(&self, candidate: bool) -> f64 {
        let window = &*self.window;
        let states = if candidate {
            &window.candidate
        } else {
            &window.states
        };
        let mut cost = 0.0;
        for k in 0..window.links.len() {
            cost += 0.5 * window.link(k, states).0.norm_squared();
        }
        for pose in &window.measured {
            let error = se3::log(&(pose.inverse * states[pose.state].pose));
            cost += 0.5 * (pose.root * error).norm_squared();
        }
        for prior in &window.bias_priors {
            let bias = &states[prior.state].bias;
            cost += 0.5 * (bias.gyro - prior.bias.gyro).norm_squared() * prior.root[0].powi(2);
            cost += 0.5 * (bias.accel - prior.bias.accel).norm_squared() * prior.root[1].powi(2);
        }
        cost
    }

    fn add(&mut self, state: usize, normal: &Matrix15, g: &Vector15) {
        let (offset, start) = (self.pattern.diagonal(state), self.pattern.start(state));
        for (k, entry) in normal.iter().enumerate() {
            self.values[offset + k] += entry;
        }
        for (k, entry) in g.iter().enumerate() {
            self.gradient[start + k] += entry;
        }
    }
}

impl System for WindowSystem<'_> {
    fn cost(&mut self) -> Option<f64> {
        Some(self.evaluate(false))
    }

    fn linearise(&mut self, _: Damping, _: f64) -> f64 {
        self.values.fill(0.0);
        self.gradient.fill(0.0);
        for k in 0..self.window.links.len() {
            let (r, a, b) = self.window.link(k, &self.window.states);
            self.add(k, &a.tr_mul(&a), &a.tr_mul(&r));
            self.add(k + 1, &b.tr_mul(&b), &b.tr_mul(&r));
            if let Some(offset) = self.pattern.offset(k + 1, k) {
                for (at, entry) in b.tr_mul(&a).iter().enumerate() {
                    self.values[offset + at] += entry;
                }
            }
        }
        for k in 0..self.window.measured.len() {
            let pose = &self.window.measured[k];
            let state = pose.state;
            let error = se3::log(&(pose.inverse * self.window.states[state].pose));
            let jacobian = pose.root * se3::right_jacobian_inverse(&error);
            let (mut normal, mut g) = (Matrix15::zeros(), Vector15::zeros());
            normal
                .fixed_view_mut::<6, 6>(0, 0)
                .copy_from(&jacobian.tr_mul(&jacobian));
            g.fixed_rows_mut::<6>(0)
                .copy_from(&jacobian.tr_mul(&(pose.root * error)));
            self.add(state, &normal, &g);
        }
        for k in 0..self.window.bias_priors.len() {
            let prior = &self.window.bias_priors[k];
            let (state, here) = (prior.state, self.window.states[prior.state].bias);
            let (mut normal, mut g) = (Matrix15::zeros(), Vector15::zeros());
            let gaps = [here.gyro - prior.bias.gyro, here.accel - prior.bias.accel];
            for (sensor, gap) in gaps.iter().enumerate() {
                for axis in 0..3 {
                    let (at, weight) = (9 + 3 * sensor + axis, prior.root[sensor].powi(2));
                    normal[(at, at)] = weight;
                    g[at] = weight * gap[axis];
                }
            }
            self.add(state, &normal, &g);
        }
        self.gradient.iter().fold(0.0, |most, g| most.max(g.abs()))
    }

    fn step(&mut self, damping: Damping, lambda: f64) -> Option<Step> {
        self.damped.copy_from_slice(&self.values);
        for state in 0..self.pattern.blocks() {
            for k in 0..STATE {
                let at = self.pattern.diagonal(state) + k * (STATE + 1);
                self.damped[at] += damping_term(damping, lambda, self.values[at]);
            }
        }
        for (step, gradient) in self.step.iter_mut().zip(&self.gradient) {
            *step = -gradient;
        }
        let solved = self.solver.factor(&self.pattern, &self.damped)
            && self
                .solver
                .solve(&self.pattern, &self.damped, &mut self.step);
        if !solved {
            return None;
        }
        let (mut promised, mut squared, mut norm) = (0.0, 0.0, 0.0);
        for state in 0..self.pattern.blocks() {
            let (start, offset) = (self.pattern.start(state), self.pattern.diagonal(state));
            let d = Vector15::from_column_slice(&self.step[start..start + STATE]);
            for k in 0..STATE {
                let term = damping_term(damping, lambda, self.values[offset + k * (STATE + 1)]);
                promised += 0.5 * d[k] * (term * d[k] - self.gradient[start + k]);
            }
            squared += d.norm_squared();
            let here = &self.window.states[state];
            norm += 1.0 + here.pose.translation.norm_squared() + here.velocity.norm_squared();
            self.window.candidate[state] = moved(here, &d);
        }
        Some(Step {
            promised,
            norm: squared.sqrt(),
            state_norm: f64::sqrt(norm),
        })
    }

    fn candidate_cost(&mut self) -> Option<f64> {
        Some(self.evaluate(true))
    }

    fn accept(&mut self) {
        self.window.states.copy_from_slice(&self.window.candidate);
    }
}
