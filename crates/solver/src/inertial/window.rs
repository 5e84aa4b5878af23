//! A window of states (pose, velocity, biases) tied by pre-integrated samples and measured poses.

use super::link::{
    InertialState, Matrix15, STATE, Vector15, check, moved, predict, residual, root,
};
use super::preintegration::{ImuBias, Preintegration, finite};
use crate::linear::{BlockPattern, NormalEquations};
use crate::minimise::{Step, System, minimise};
use crate::options::{Damping, Options};
use crate::summary::Summary;
use crate::{Error, Result};
use nalgebra::{Matrix6, Vector3};
use sphereflow_core::Pose;
use sphereflow_core::checks::{each, positive};
use sphereflow_sphere::lie::se3;

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
        let root = root("since_last", &since_last)?;
        let next = predict(
            &since_last,
            &self.gravity,
            &self.states[self.states.len() - 1],
        );
        self.states.push(next);
        self.candidate.push(next);
        self.links.push(since_last);
        self.roots.push(root);
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
        let sigmas = [("gyro_sigma", gyro_sigma), ("accel_sigma", accel_sigma)];
        each(positive, &sigmas)?;
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
        let mut system = WindowSystem {
            equations: NormalEquations::new(pattern),
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
        residual(
            (&self.links[k], &self.roots[k]),
            &self.gravity,
            (&states[k], &states[k + 1]),
        )
    }
}

pub(super) struct WindowSystem<'a> {
    window: &'a mut InertialWindow,
    equations: NormalEquations,
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
        (self.equations).add_diagonal(state, normal.as_slice(), g.as_slice());
    }
}

impl System for WindowSystem<'_> {
    fn cost(&mut self) -> Option<f64> {
        Some(self.evaluate(false))
    }

    fn linearise(&mut self, _: Damping, _: f64) -> f64 {
        self.equations.clear();
        for k in 0..self.window.links.len() {
            let (r, a, b) = self.window.link(k, &self.window.states);
            self.add(k, &a.tr_mul(&a), &a.tr_mul(&r));
            self.add(k + 1, &b.tr_mul(&b), &b.tr_mul(&r));
            if let Some(offset) = self.equations.pattern.offset(k + 1, k) {
                self.equations.add_at(offset, b.tr_mul(&a).as_slice());
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
        self.equations.gradient_max()
    }

    fn step(&mut self, damping: Damping, lambda: f64) -> Option<Step> {
        let step = self.equations.solve(damping, lambda)?;
        let mut norm = 0.0;
        for (state, here) in self.window.states.iter().enumerate() {
            norm += 1.0 + here.pose.translation.norm_squared() + here.velocity.norm_squared();
            let d = Vector15::from_column_slice(self.equations.of(state));
            self.window.candidate[state] = moved(here, &d);
        }
        Some(Step {
            promised: step.promised,
            norm: step.squared.sqrt(),
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
