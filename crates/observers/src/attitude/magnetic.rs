//! Which magnetic field to believe: norm and dip of the undisturbed one are learnt, others wait.

use super::low_pass::{Decay, LowPass};
use super::small_angle::angle;
use nalgebra::Vector3;

/// Time constant of the low-pass of norm and dip, seconds.
const FIELD_TAU_S: f64 = 0.05;
/// Time constant with which the believed field follows, seconds.
const REFERENCE_TAU_S: f64 = 20.0;
/// Relative difference of the norm that is a disturbance.
const NORM_LIMIT: f64 = 0.1;
/// Difference of the dip that is a disturbance.
const DIP_LIMIT: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// A new field is believed after so many seconds of motion in it.
const NEW_S: f64 = 20.0;
/// The first field is believed after so many.
const FIRST_S: f64 = 5.0;
/// What counts as motion, rad/s.
const NEW_MIN_RATE: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// The field must be undisturbed for so long, seconds.
const UNDISTURBED_S: f64 = 0.5;
/// Disturbances are left out for so long, and after that only weighted down, seconds.
const REJECT_S: f64 = 60.0;
/// Weight of a disturbed field then is one over this.
const REJECT_FACTOR: f64 = 2.0;

/// What depends on the time between readings alone.
#[derive(Clone, Copy, Debug)]
pub struct FieldTable {
    /// The time, seconds.
    pub dt_s: f64,
    low_pass: Decay,
    follow: f64,
    /// Share of the heading's disagreement that one reading takes away.
    pub heading: f64,
}

impl FieldTable {
    /// For readings `dt_s` apart and the heading's time constant.
    pub fn new(tau_mag_s: f64, dt_s: f64) -> Self {
        Self {
            dt_s,
            low_pass: Decay::new(FIELD_TAU_S, dt_s),
            follow: 1.0 - (-dt_s / REFERENCE_TAU_S).exp(),
            heading: 1.0 - (-dt_s / tau_mag_s).exp(),
        }
    }
}

/// A field as the disturbance test sees it.
#[derive(Clone, Copy, Debug, Default)]
struct Field {
    norm: f64,
    dip: f64,
}

impl Field {
    fn is_near(&self, other: &Field) -> bool {
        (self.norm - other.norm).abs() < NORM_LIMIT * other.norm
            && (self.dip - other.dip).abs() < DIP_LIMIT
    }

    fn follow(&mut self, other: &Field, share: f64) {
        self.norm += share * (other.norm - self.norm);
        self.dip += share * (other.dip - self.dip);
    }
}

/// Where the dip was last far from before: dips nearby are small angles from it.
#[derive(Clone, Copy, Debug)]
struct DipAnchor {
    angle: f64,
    cos: f64,
    sin: f64,
}

/// Dips further than this from the anchor, rad, become the anchor.
const NEAR_ANCHOR: f64 = 0.1;

impl DipAnchor {
    /// The angle of a direction (cosine, sine), rad.
    #[inline]
    fn dip(&mut self, cos: f64, sin: f64) -> f64 {
        let by = angle(
            sin * self.cos - cos * self.sin,
            cos * self.cos + sin * self.sin,
        );
        let dip = self.angle + by;
        if by.abs() > NEAR_ANCHOR {
            (self.sin, self.cos) = dip.sin_cos();
            self.angle = dip;
        }
        dip
    }
}

/// Judges fields.
#[derive(Clone, Copy, Debug)]
pub struct FieldJudge {
    anchor: DipAnchor,
    low_pass: LowPass<2>,
    believed: Option<Field>,
    candidate: Field,
    candidate_s: f64,
    undisturbed_s: f64,
    rejected_s: f64,
    disturbed: bool,
}

impl FieldJudge {
    /// Believes nothing yet.
    pub fn new() -> Self {
        Self {
            anchor: DipAnchor {
                angle: 0.0,
                cos: 1.0,
                sin: 0.0,
            },
            low_pass: LowPass::new(),
            believed: None,
            candidate: Field::default(),
            candidate_s: 0.0,
            undisturbed_s: 0.0,
            rejected_s: 0.0,
            disturbed: true,
        }
    }

    /// The next field: its norm, and the parts of it that lie flat and point down; `mean_gyro` is the
    /// rate of the turning body, rad/s.
    #[inline]
    pub fn step(
        &mut self,
        norm: f64,
        flat: f64,
        down: f64,
        mean_gyro: &Vector3<f64>,
        dt_s: f64,
        table: &FieldTable,
    ) {
        let scale = 1.0 / norm;
        let dip = self.anchor.dip(flat * scale, down * scale);
        let [norm, dip] = self.low_pass.step(&[norm, dip], &table.low_pass);
        let now = Field { norm, dip };
        let share = table.follow;
        match &mut self.believed {
            Some(field) if now.is_near(field) => {
                self.undisturbed_s += dt_s;
                if self.undisturbed_s >= UNDISTURBED_S {
                    self.disturbed = false;
                    field.follow(&now, share);
                }
            }
            _ => {
                self.undisturbed_s = 0.0;
                self.disturbed = true;
            }
        }
        if !now.is_near(&self.candidate) {
            self.candidate_s = 0.0;
            self.candidate = now;
            return;
        }
        if mean_gyro.norm_squared() >= NEW_MIN_RATE * NEW_MIN_RATE {
            self.candidate_s += dt_s;
        }
        self.candidate.follow(&now, share);
        let needed = if self.believed.is_some() {
            NEW_S
        } else {
            FIRST_S
        };
        if self.disturbed && self.candidate_s >= needed {
            self.believed = Some(self.candidate);
            self.disturbed = false;
            self.undisturbed_s = UNDISTURBED_S;
        }
    }

    /// The weight of the heading's correction, 0 to 1, for this field.
    pub fn weight(&mut self, dt_s: f64) -> f64 {
        if !self.disturbed {
            self.rejected_s = (self.rejected_s - REJECT_FACTOR * dt_s).max(0.0);
            1.0
        } else if self.rejected_s <= REJECT_S {
            self.rejected_s += dt_s;
            0.0
        } else {
            1.0 / REJECT_FACTOR
        }
    }

    /// True where a field is believed and this is another.
    pub fn is_disturbed(&self) -> bool {
        self.disturbed && self.believed.is_some()
    }
}
