//! Rolling shutter: where a point of one row is when the middle row is exposed.

use nalgebra::{Vector3, Vector6};
use sphereflow_sphere::row_time_s;

/// Row `y` of `height` is exposed `((y + 1/2) / height - 1/2) * readout_s` after the frame's stamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowMotion {
    omega: Vector3<f64>,
    v: Vector3<f64>,
    readout_s: f64,
    height: f64,
}

impl RowMotion {
    /// Of a camera with the twist [omega, v], body frame, while the rows are read.
    pub fn new(twist: &Vector6<f64>, readout_s: f64, height: usize) -> Self {
        Self {
            omega: twist.fixed_rows::<3>(0).into_owned(),
            v: twist.fixed_rows::<3>(3).into_owned(),
            readout_s,
            height: height as f64,
        }
    }

    /// True where all rows see the same camera.
    pub fn is_still(&self) -> bool {
        self.readout_s == 0.0
    }

    /// When row `y` is exposed, seconds after the stamp.
    fn time_s(&self, y: f64) -> f64 {
        row_time_s(y, self.height, self.readout_s)
    }

    /// A static point seen from row `y`, in the frame of the stamp.
    pub fn to_stamp(self, point: &Vector3<f64>, y: f64) -> Vector3<f64> {
        self.moved(point, self.time_s(y))
    }

    /// A static point of the stamp's frame, in the frame of row `y`.
    pub fn to_row(self, point: &Vector3<f64>, y: f64) -> Vector3<f64> {
        self.moved(point, -self.time_s(y))
    }

    /// `exp([omega, v] t)` on a point, to second order: the rest is 1e-5 of a turn of 0.05 rad.
    fn moved(&self, point: &Vector3<f64>, t_s: f64) -> Vector3<f64> {
        let first = (self.omega.cross(point) + self.v) * t_s;
        point + first + self.omega.cross(&first) * (0.5 * t_s)
    }
}
