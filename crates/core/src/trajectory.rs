//! Poses over time: interpolation, and association of two clocks' stamps.

use crate::{Error, Pose, Result, Stamp};

/// Poses at strictly increasing stamps. Which frames they join (`world_from_camera`, ...) is the
/// owner's to say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    stamps: Vec<Stamp>,
    poses: Vec<Pose>,
}

impl Trajectory {
    /// An empty trajectory.
    pub fn new() -> Self {
        Self::default()
    }

    /// From stamps and poses of the same number.
    ///
    /// # Errors
    /// [`Error::Shape`] where the numbers differ, [`Error::TimeOrder`] where stamps do not increase.
    pub fn from_vecs(stamps: Vec<Stamp>, poses: Vec<Pose>) -> Result<Self> {
        if stamps.len() != poses.len() {
            return Err(Error::shape(
                "poses",
                format!("{} poses, one a stamp", stamps.len()),
                format!("{} poses", poses.len()),
            ));
        }
        if let Some(index) = stamps.windows(2).position(|pair| pair[1] <= pair[0]) {
            return Err(Error::TimeOrder {
                argument: "stamps".into(),
                earlier: stamps[index],
                later: stamps[index + 1],
                index: index + 1,
            });
        }
        Ok(Self { stamps, poses })
    }

    /// Append a pose.
    ///
    /// # Errors
    /// [`Error::TimeOrder`] where `stamp` does not come after the last one.
    pub fn push(&mut self, stamp: Stamp, pose: Pose) -> Result<()> {
        if let Some(&last) = self.stamps.last()
            && stamp <= last
        {
            return Err(Error::TimeOrder {
                argument: "stamp".into(),
                earlier: last,
                later: stamp,
                index: self.stamps.len(),
            });
        }
        self.stamps.push(stamp);
        self.poses.push(pose);
        Ok(())
    }

    /// Number of poses.
    pub fn len(&self) -> usize {
        self.stamps.len()
    }

    /// True without poses.
    pub fn is_empty(&self) -> bool {
        self.stamps.is_empty()
    }

    /// The stamps, increasing.
    pub fn stamps(&self) -> &[Stamp] {
        &self.stamps
    }

    /// The poses, one a stamp.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Stamps and poses in order.
    pub fn iter(&self) -> impl Iterator<Item = (Stamp, &Pose)> {
        self.stamps.iter().copied().zip(&self.poses)
    }

    /// The pose at `stamp`: SLERP of the rotation, linear in the translation.
    ///
    /// `None` outside the trajectory, and inside a gap longer than `max_gap_s`.
    pub fn interpolate(&self, stamp: Stamp, max_gap_s: f64) -> Option<Pose> {
        let after = self.stamps.partition_point(|&s| s < stamp);
        if self.stamps.get(after) == Some(&stamp) {
            return Some(self.poses[after]);
        }
        let before = after.checked_sub(1)?;
        let (&t0, &t1) = (self.stamps.get(before)?, self.stamps.get(after)?);
        let gap_s = t1.seconds_since(t0);
        if gap_s > max_gap_s {
            return None;
        }
        let u = stamp.seconds_since(t0) / gap_s;
        let (a, b) = (&self.poses[before], &self.poses[after]);
        let rotation = a
            .rotation
            .try_slerp(&b.rotation, u, 1e-12)
            .unwrap_or(a.rotation);
        Some(Pose::new(rotation, a.translation.lerp(&b.translation, u)))
    }
}

/// Pairs `(i, j)` of the stamps nearest to each other, at most `max_difference_ns` apart.
///
/// Each stamp of the shorter list takes the nearest of the longer one (the first of two equally
/// near); a stamp of the longer list may serve twice. Both lists must increase. This is the rule
/// of the evo tool, so that figures agree with it.
pub fn associate(first: &[Stamp], second: &[Stamp], max_difference_ns: u64) -> Vec<(usize, usize)> {
    let first_is_longer = second.len() <= first.len();
    let (short, long) = if first_is_longer {
        (second, first)
    } else {
        (first, second)
    };
    let nearest = |stamp: Stamp| -> Option<usize> {
        let after = long.partition_point(|&s| s < stamp);
        [after.checked_sub(1), (after < long.len()).then_some(after)]
            .into_iter()
            .flatten()
            .min_by_key(|&j| long[j].abs_diff_ns(stamp))
            .filter(|&j| long[j].abs_diff_ns(stamp) <= max_difference_ns)
    };
    short
        .iter()
        .enumerate()
        .filter_map(|(i, &stamp)| nearest(stamp).map(|j| (i, j)))
        .map(|(i, j)| if first_is_longer { (j, i) } else { (i, j) })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    fn ns(values: &[i64]) -> Vec<Stamp> {
        values.iter().map(|&v| Stamp::from_ns(v)).collect()
    }

    fn turned(angle: f64, x: f64) -> Pose {
        Pose::new(
            UnitQuaternion::from_scaled_axis(Vector3::y() * angle),
            Vector3::new(x, 0.0, 0.0),
        )
    }

    #[test]
    fn trajectory_with_repeated_stamp_is_an_error_with_index() {
        let error = Trajectory::from_vecs(ns(&[0, 5, 5]), vec![Pose::identity(); 3]).unwrap_err();
        assert!(
            matches!(error, Error::TimeOrder { index: 2, .. }),
            "{error}"
        );
        let mut trajectory = Trajectory::new();
        trajectory
            .push(Stamp::from_ns(1), Pose::identity())
            .unwrap();
        assert!(
            trajectory
                .push(Stamp::from_ns(1), Pose::identity())
                .is_err()
        );
        assert_eq!(trajectory.len(), 1);
    }

    #[test]
    fn trajectory_interpolation_halves_angle_and_path_and_refuses_gaps() {
        let second = 1_000_000_000;
        let trajectory = Trajectory::from_vecs(
            ns(&[0, second, 5 * second]),
            vec![turned(0.0, 0.0), turned(0.8, 2.0), turned(0.0, 0.0)],
        )
        .unwrap();
        let middle = trajectory
            .interpolate(Stamp::from_ns(second / 2), 2.0)
            .unwrap();
        let (d, a) = middle.distance_and_angle(&turned(0.4, 1.0));
        assert!(d < 1e-14 && a < 1e-7, "{d} {a}");
        assert_eq!(
            trajectory.interpolate(Stamp::from_ns(second), 0.0),
            Some(turned(0.8, 2.0))
        );
        assert!(
            trajectory
                .interpolate(Stamp::from_ns(2 * second), 2.0)
                .is_none()
        );
        assert!(trajectory.interpolate(Stamp::from_ns(-1), 2.0).is_none());
        assert!(
            trajectory
                .interpolate(Stamp::from_ns(6 * second), 2.0)
                .is_none()
        );
    }

    #[test]
    fn associate_pairs_nearest_within_limit_in_either_order() {
        let (a, b) = (ns(&[0, 10, 20, 30]), ns(&[1, 22, 90]));
        assert_eq!(associate(&a, &b, 5), [(0, 0), (2, 1)]);
        assert_eq!(associate(&b, &a, 5), [(0, 0), (1, 2)]);
        assert!(associate(&a, &[], 5).is_empty());
    }
}
