//! Points in a pose graph's file: they do not move the poses, but are placed where the poses that
//! see them now say.

use crate::Result;
use crate::rows::Row;
use nalgebra::{Matrix3, Vector3};
use sphereflow_core::Pose;

/// A measured point: which pose saw which point where, and how surely.
#[derive(Clone, Debug)]
struct Sight {
    pose: u64,
    point: u64,
    /// In the sensor's frame, metres.
    measured: Vector3<f64>,
    information: Matrix3<f64>,
    /// Where the sensor sits on the pose.
    sensor: u64,
}

/// The points of a file and what saw them.
#[derive(Clone, Debug, Default)]
pub(super) struct Landmarks {
    points: Vec<(u64, Vector3<f64>)>,
    sensors: Vec<(u64, Pose)>,
    sights: Vec<Sight>,
}

impl Landmarks {
    /// Take a row of a point, an offset or a sight; `false` for any other.
    pub fn take(&mut self, row: &Row<'_>) -> Result<bool> {
        match row.text(0) {
            "VERTEX_TRACKXYZ" => {
                row.expect_columns(5, "tag, id, x y z")?;
                self.points
                    .push((super::g2o::id(row, 1)?, row.numbers::<3>(2)?.into()));
            }
            // The offset's own number is left out by some writers.
            "PARAMS_SE3OFFSET" => {
                let numbered = row.fields.len() == 9;
                let id = if numbered { super::g2o::id(row, 1)? } else { 0 };
                if !numbered {
                    row.expect_columns(9, "tag, id, x y z qx qy qz qw")?;
                }
                self.sensors.push((id, super::g2o::pose(row, 2)?));
            }
            "EDGE_SE3_TRACKXYZ" => {
                row.expect_columns(13, "tag, pose, point, offset, x y z, 6 of information")?;
                let [a, b, c, d, e, f] = row.numbers(7)?;
                self.sights.push(Sight {
                    pose: super::g2o::id(row, 1)?,
                    point: super::g2o::id(row, 2)?,
                    sensor: super::g2o::id(row, 3)?,
                    measured: row.numbers::<3>(4)?.into(),
                    information: Matrix3::new(a, b, c, b, d, e, c, e, f),
                });
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// The points at the weighted least squares of what saw them; a point that nothing fixes stays.
    pub fn placed(&self, pose_of: impl Fn(u64) -> Option<Pose>) -> Vec<(u64, Vector3<f64>)> {
        let sensor = |id: u64| self.sensors.iter().find(|(known, _)| *known == id);
        let place = |&(id, before): &(u64, Vector3<f64>)| {
            let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for sight in self.sights.iter().filter(|sight| sight.point == id) {
                let Some(pose) = pose_of(sight.pose) else {
                    continue;
                };
                let offset = sensor(sight.sensor).map_or(Pose::identity(), |(_, pose)| *pose);
                let turn = (pose.rotation * offset.rotation)
                    .to_rotation_matrix()
                    .into_inner();
                let origin = pose.translation + pose.rotation * offset.translation;
                let weight = turn * sight.information * turn.transpose();
                normal += weight;
                right += weight * (origin + turn * sight.measured);
            }
            let now = normal.try_inverse().map(|inverse| inverse * right);
            (
                id,
                now.filter(|p| p.iter().all(|v| v.is_finite()))
                    .unwrap_or(before),
            )
        };
        self.points.iter().map(place).collect()
    }
}
