//! A motion between two images whose second was read out row by row.

use nalgebra::{Matrix3, Vector3};
use sphereflow_core::Pose;
use sphereflow_sphere::RollingShutter;

/// The motion to one row of the second image and back, for arithmetic in single precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowMotion {
    /// `second_from_first`.
    pub to: Rigid,
    /// `first_from_second`.
    pub back: Rigid,
}

/// `x -> rotation x + translation`, rows first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rigid {
    /// Rows of the matrix.
    pub rotation: [[f32; 3]; 3],
    /// Metres.
    pub translation: [f32; 3],
}

impl Rigid {
    fn new(pose: &Pose) -> Self {
        let m: Matrix3<f64> = *pose.rotation.to_rotation_matrix().matrix();
        let t: Vector3<f64> = pose.translation;
        Self {
            rotation: [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[(i, j)] as f32)),
            translation: [t.x as f32, t.y as f32, t.z as f32],
        }
    }

    /// Entry by entry, times a factor.
    #[inline(always)]
    pub fn minus(&self, other: &Self, factor: f32) -> Self {
        let mut out = *self;
        for i in 0..3 {
            for j in 0..3 {
                out.rotation[i][j] = (self.rotation[i][j] - other.rotation[i][j]) * factor;
            }
            out.translation[i] = (self.translation[i] - other.translation[i]) * factor;
        }
        out
    }

    /// `rotation v`.
    #[inline(always)]
    pub fn turn(&self, v: [f32; 3]) -> [f32; 3] {
        self.rotation
            .map(|r| r[0] * v[0] + r[1] * v[1] + r[2] * v[2])
    }
}

/// Fills `rows` with the motion to every row of the second image of `height` rows: a single entry
/// where all rows are exposed at once.
pub fn fill(
    rows: &mut Vec<RowMotion>,
    first_from_second: &Pose,
    shutter: &RollingShutter,
    height: usize,
) {
    rows.clear();
    let one = |pose: Pose| RowMotion {
        to: Rigid::new(&pose.inverse()),
        back: Rigid::new(&pose),
    };
    if shutter.is_global() {
        rows.push(one(*first_from_second));
    } else {
        let at = |y| *first_from_second * shutter.stamp_from_row(y, height);
        rows.extend((0..height).map(|y| one(at(y))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sphereflow_core::Twist;

    #[test]
    fn rows_are_exposed_around_the_stamp() {
        let twist = Twist::from_vector(&[0.0, 0.0, 0.0, 2.0, 0.0, 0.0].into());
        let shutter = RollingShutter {
            twist,
            readout_s: 0.03,
        };
        let mut rows = Vec::new();
        fill(&mut rows, &Pose::identity(), &shutter, 480);
        assert_eq!(rows.len(), 480);
        let along = |y: usize| rows[y].back.translation[0];
        assert!((along(0) + along(479)).abs() < 1e-9, "symmetric");
        // 2 m/s for 30 ms, less one row
        let whole = 0.06 * 479.0 / 480.0;
        assert!((along(479) - along(0) - whole).abs() < 1e-6);
        fill(
            &mut rows,
            &Pose::identity(),
            &RollingShutter::default(),
            480,
        );
        assert_eq!(rows.len(), 1);
    }
}
