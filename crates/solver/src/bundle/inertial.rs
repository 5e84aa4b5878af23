//! Poses tied by pre-integrated IMU samples, with velocities and biases among the unknowns.

use super::ids::{Block, MOTION, NONE};
use super::state::ViewPose;
use crate::inertial::link::{InertialState, Matrix15, residual};
use crate::inertial::{ImuBias, Preintegration};
use nalgebra::{SMatrix, SVector, Vector3};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// A derivative of a link by a pose (six columns, then zeros) or by a motion.
type ByBlock = SMatrix<f64, 15, MOTION>;
/// What the IMU adds to a pose.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Motion {
    /// Velocity of the body in the world, m/s.
    pub velocity: Vector3<f64>,
    /// Biases.
    pub bias: ImuBias,
}

#[derive(Clone, Debug)]
pub(super) struct Tie {
    /// Indices of motions.
    pub from: usize,
    pub to: usize,
    pub samples: Preintegration,
    pub root: Matrix15,
}

#[derive(Clone, Debug)]
pub(super) struct BiasPrior {
    pub motion: usize,
    pub bias: ImuBias,
    pub root: [f64; 2],
}

/// The inertial part of a problem.
#[derive(Clone, Debug, Default)]
pub(crate) struct Inertial {
    pub(super) gravity: Vector3<f64>,
    pub(super) camera_from_body: Pose,
    /// The pose of each motion.
    pub views: Vec<usize>,
    pub motions: Vec<Motion>,
    pub(super) ties: Vec<Tie>,
    pub(super) priors: Vec<BiasPrior>,
}

impl Motion {
    /// The motion `step` further.
    pub(crate) fn moved(&self, step: &[f64]) -> Self {
        let part = |k: usize| Vector3::new(step[k], step[k + 1], step[k + 2]);
        Self {
            velocity: self.velocity + part(0),
            bias: ImuBias {
                gyro: self.bias.gyro + part(3),
                accel: self.bias.accel + part(6),
            },
        }
    }

    /// What it has over another: velocity, gyrometer bias, accelerometer bias.
    pub(crate) fn minus(&self, other: &Self) -> SVector<f64, MOTION> {
        let parts = [
            self.velocity - other.velocity,
            self.bias.gyro - other.bias.gyro,
            self.bias.accel - other.bias.accel,
        ];
        SVector::from_fn(|k, _| parts[k / 3][k % 3])
    }

    /// Squared norm of its numbers.
    pub(crate) fn norm_squared(&self) -> f64 {
        let bias = self.bias.gyro.norm_squared() + self.bias.accel.norm_squared();
        self.velocity.norm_squared() + bias
    }
}

impl Inertial {
    /// The poses that are tied.
    pub fn ties(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let ties = self.ties.iter();
        ties.map(|tie| [self.views[tie.from], self.views[tie.to]])
    }

    /// The motions that are tied.
    pub fn tied_motions(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.ties.iter().map(|tie| [tie.from, tie.to])
    }

    /// Splits off what the motions of the poses that leave take part in.
    pub fn part(&self, leaves: &[bool]) -> (Self, Self) {
        let goes = |motion: usize| leaves[self.views[motion]];
        let tie_goes = |tie: &Tie| goes(tie.from) || goes(tie.to);
        let (mut leaving, mut staying) = (self.clone(), self.clone());
        leaving.ties.retain(tie_goes);
        staying.ties.retain(|tie| !tie_goes(tie));
        leaving.priors.retain(|prior| goes(prior.motion));
        staying.priors.retain(|prior| !goes(prior.motion));
        (leaving, staying)
    }

    /// True where samples or a bias prior determine the motion.
    pub fn determines(&self, motion: usize) -> bool {
        let tied = self.tied_motions().any(|ends| ends.contains(&motion));
        tied || self.priors.iter().any(|prior| prior.motion == motion)
    }

    fn state(&self, motion: usize, poses: &[ViewPose], motions: &[Motion]) -> InertialState {
        let camera = poses[self.views[motion]].world_from_camera();
        InertialState {
            pose: camera * self.camera_from_body,
            velocity: motions[motion].velocity,
            bias: motions[motion].bias,
        }
    }

    fn evaluate(
        &self,
        tie: &Tie,
        poses: &[ViewPose],
        motions: &[Motion],
    ) -> (SVector<f64, 15>, Matrix15, Matrix15) {
        let ends = [tie.from, tie.to].map(|motion| self.state(motion, poses, motions));
        residual(
            (&tie.samples, &tie.root),
            &self.gravity,
            (&ends[0], &ends[1]),
        )
    }

    /// Half the squared residuals.
    pub fn cost(&self, poses: &[ViewPose], motions: &[Motion]) -> f64 {
        let mut cost = 0.0;
        for tie in &self.ties {
            cost += 0.5 * self.evaluate(tie, poses, motions).0.norm_squared();
        }
        for prior in &self.priors {
            let here = &motions[prior.motion].bias;
            cost += 0.5 * (here.gyro - prior.bias.gyro).norm_squared() * prior.root[0].powi(2);
            cost += 0.5 * (here.accel - prior.bias.accel).norm_squared() * prior.root[1].powi(2);
        }
        cost
    }

    /// Hands the blocks of the normal matrix (row, column) and of the gradient to `block` and
    /// `gradient`, for the blocks of the poses and of the motions that move.
    pub fn linearise(
        &self,
        (poses, motions): (&[ViewPose], &[Motion]),
        (view_block, motion_block): (&[u32], &[u32]),
        mut block: impl FnMut(u32, u32, &Block),
        mut gradient: impl FnMut(u32, &SVector<f64, MOTION>),
    ) {
        // the left update of the camera's pose, as a right update of the body's
        let turn = -se3::adjoint(&self.camera_from_body.inverse());
        for tie in &self.ties {
            let (r, a, b) = self.evaluate(tie, poses, motions);
            let of_pose = |j: &Matrix15| {
                let mut by = ByBlock::zeros();
                by.fixed_columns_mut::<6>(0)
                    .copy_from(&(j.fixed_columns::<6>(0) * turn));
                by
            };
            let of_motion = |j: &Matrix15| j.fixed_columns::<MOTION>(6).into_owned();
            let blocks = [
                (view_block[self.views[tie.from]], of_pose(&a)),
                (motion_block[tie.from], of_motion(&a)),
                (view_block[self.views[tie.to]], of_pose(&b)),
                (motion_block[tie.to], of_motion(&b)),
            ];
            for (k, (row, by_row)) in blocks.iter().enumerate() {
                if *row == NONE {
                    continue;
                }
                gradient(*row, &by_row.tr_mul(&r));
                for (column, by_column) in &blocks[..=k] {
                    if *column != NONE {
                        block(*row, *column, &by_row.tr_mul(by_column));
                    }
                }
            }
        }
        for prior in &self.priors {
            let (here, at) = (&motions[prior.motion].bias, motion_block[prior.motion]);
            let (mut normal, mut g) = (Block::zeros(), SVector::<f64, MOTION>::zeros());
            let gaps = [here.gyro - prior.bias.gyro, here.accel - prior.bias.accel];
            for (sensor, gap) in gaps.iter().enumerate() {
                for axis in 0..3 {
                    let (k, weight) = (3 + 3 * sensor + axis, prior.root[sensor].powi(2));
                    normal[(k, k)] = weight;
                    g[k] = weight * gap[axis];
                }
            }
            if at != NONE {
                block(at, at, &normal);
                gradient(at, &g);
            }
        }
    }
}
