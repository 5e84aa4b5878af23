//! Which magnetic fields may say where gravity is: those of a steady norm, at a likely angle to it.

use crate::Reason;
use crate::limits::refused_field;
use nalgebra::Vector3;

/// Relative change of the norm that is a disturbance.
const NORM_LIMIT: f64 = 0.1;
/// Difference of the cosine between field and gravity that is none of a poor estimate of gravity.
const DOT_LIMIT: f64 = 0.3;
/// Time constant with which the norm that is believed follows: a magnet passes, a new place stays.
const NORM_TAU_S: f64 = 20.0;

/// Knows the norm.
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldCheck {
    norm: Option<f64>,
}

impl FieldCheck {
    /// The unit field, or why it is left out. `down` is the estimated direction of gravity, `dot` what
    /// its product with the unit field should be, `since_s` the time since the last field.
    pub fn judge(
        &mut self,
        mag: &Vector3<f64>,
        down: &Vector3<f64>,
        dot: f64,
        since_s: f64,
    ) -> Result<Vector3<f64>, Reason> {
        if let Some(reason) = refused_field(mag) {
            return Err(reason);
        }
        let norm = mag.norm();
        let believed = self.norm.get_or_insert(norm);
        let off = norm / *believed - 1.0;
        *believed += (norm - *believed) * (1.0 - (-since_s.max(0.0) / NORM_TAU_S).exp());
        let unit = mag / norm;
        if off.abs() > NORM_LIMIT || (unit.dot(down) - dot).abs() > DOT_LIMIT {
            return Err(Reason::MagneticDisturbance);
        }
        Ok(unit)
    }
}
