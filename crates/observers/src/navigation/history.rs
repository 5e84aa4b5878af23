//! The last samples and what was believed after each, so that a late one can still be put in place.

use super::config::NavigationConfig;
use super::measurement::Measurement;
use super::state::{Belief, THETA};
use crate::checks::saturated;
use crate::{Reason, Sensor};
use nalgebra::Vector3;
use sphereflow_core::Stamp;
use std::collections::VecDeque;

/// What came in.
#[allow(clippy::large_enum_variant)] // boxed, every measurement would allocate
#[derive(Clone, Copy, Debug)]
pub enum Input {
    /// Gyro and accelerometer.
    Imu(Vector3<f64>, Vector3<f64>),
    /// Anything else.
    Measurement(Measurement),
}

impl Input {
    fn sensor(&self) -> Sensor {
        match self {
            Self::Imu(..) => Sensor::Accel,
            Self::Measurement(measurement) => measurement.sensor(),
        }
    }
}

/// A sample and the belief after it.
#[derive(Clone, Copy, Debug)]
struct Event {
    stamp: Stamp,
    input: Input,
    after: Belief,
}

/// What is unknown of a gap between inertial readings: rad/s and m/s^2.
const GAP_RATE: f64 = 1.0;
const GAP_ACCEL: f64 = 3.0;

/// After a longer gap the motion in it is no continuation of what was before, seconds.
const LONG_GAP_S: f64 = 5.0;

/// Of a saturated gyro: the true rate exceeds the limit by about this part of it.
const BEYOND_LIMIT: f64 = 0.5;

/// Samples in the order of their stamps.
#[derive(Clone, Debug)]
pub struct History {
    start: Belief,
    events: VecDeque<Event>,
}

impl History {
    /// Beginning with a belief.
    pub fn new(start: Belief) -> Self {
        Self {
            start,
            events: VecDeque::new(),
        }
    }

    /// The newest belief.
    pub fn newest(&self) -> &Belief {
        self.events.back().map_or(&self.start, |event| &event.after)
    }

    /// The earliest stamp that can still be put in place.
    pub fn earliest(&self) -> Stamp {
        self.start.stamp
    }

    /// The belief at the last sample that is not after `stamp`.
    pub fn before(&self, stamp: Stamp) -> &Belief {
        let index = self.events.partition_point(|event| event.stamp <= stamp);
        self.belief_before(index)
    }

    fn belief_before(&self, index: usize) -> &Belief {
        match index.checked_sub(1).and_then(|last| self.events.get(last)) {
            Some(event) => &event.after,
            None => &self.start,
        }
    }

    /// True where an inertial reading has this very stamp.
    pub fn has_imu_at(&self, stamp: Stamp) -> bool {
        let index = self.events.partition_point(|event| event.stamp < stamp);
        self.events
            .range(index..)
            .take_while(|event| event.stamp == stamp)
            .any(|event| matches!(event.input, Input::Imu(..)))
    }

    /// Put a sample in its place and do again what follows. The outcome is that of this sample; a
    /// rejected measurement is not kept. The measurement's stamp must not be before
    /// [`History::earliest`].
    pub fn insert(
        &mut self,
        stamp: Stamp,
        input: Input,
        config: &NavigationConfig,
    ) -> Result<(), Reason> {
        let index = self.events.partition_point(|event| event.stamp <= stamp);
        let mut belief = *self.belief_before(index);
        apply(&mut belief, stamp, &input, config)?;
        if !belief.is_finite() {
            // Bounded inputs cannot lead here; if they do, the state before stays.
            let sensor = input.sensor();
            return Err(Reason::NotFinite { sensor });
        }
        let event = Event {
            stamp,
            input,
            after: belief,
        };
        if index == self.events.len() {
            self.events.push_back(event);
        } else {
            self.events.insert(index, event);
            self.redo(index + 1, config);
        }
        self.forget(config);
        Ok(())
    }

    /// Multiply the newest covariance: the filter doubts itself, within what can be at all.
    pub fn doubt(&mut self, factor: f64, config: &NavigationConfig) {
        let belief = match self.events.back_mut() {
            Some(event) => &mut event.after,
            None => &mut self.start,
        };
        belief.covariance *= factor;
        belief.bound(config);
    }

    fn redo(&mut self, from: usize, config: &NavigationConfig) {
        let mut belief = *self.belief_before(from);
        for event in self.events.range_mut(from..) {
            // A measurement that no longer fits is passed over.
            let mut tried = belief;
            let done = apply(&mut tried, event.stamp, &event.input, config);
            if done.is_ok() && tried.is_finite() {
                belief = tried;
            } else {
                forward(&mut belief, event.stamp, None, config);
            }
            event.after = belief;
        }
    }

    /// Drop what is older than the delay.
    fn forget(&mut self, config: &NavigationConfig) {
        let newest = self.newest().stamp;
        while let Some(event) = self.events.front() {
            if newest.seconds_since(event.stamp) <= config.max_delay_s {
                break;
            }
            self.start = event.after;
            self.events.pop_front();
        }
    }
}

/// Bring a belief to `stamp` and use the input there.
fn apply(
    belief: &mut Belief,
    stamp: Stamp,
    input: &Input,
    config: &NavigationConfig,
) -> Result<(), Reason> {
    match input {
        Input::Imu(gyro, accel) => {
            forward(belief, stamp, Some((gyro, accel)), config);
            (belief.gyro, belief.accel) = (*gyro, *accel);
            Ok(())
        }
        Input::Measurement(measurement) => {
            forward(belief, stamp, None, config);
            measurement.apply(belief, config)
        }
    }
}

/// Predict to `stamp`: with the mean of the last reading and the next, or with the last one held.
pub fn forward(
    belief: &mut Belief,
    stamp: Stamp,
    next: Option<(&Vector3<f64>, &Vector3<f64>)>,
    config: &NavigationConfig,
) {
    let dt_s = stamp.seconds_since(belief.stamp);
    if dt_s <= 0.0 {
        return;
    }
    let (gyro, accel) = match next {
        Some((gyro, accel)) => ((belief.gyro + gyro) * 0.5, (belief.accel + accel) * 0.5),
        None => (belief.gyro, belief.accel),
    };
    if dt_s > LONG_GAP_S {
        belief.lose_motion(config, &accel, dt_s);
        belief.stamp = stamp;
        belief.coasting_s += dt_s;
        return;
    }
    belief.predict(config, &gyro, &accel, dt_s);
    let limit = config.gyro_limit_rad_s;
    if next.is_some_and(|(gyro, _)| saturated(gyro, limit).is_some()) {
        // The true rate lies anywhere beyond the limit.
        belief.add_variance(THETA, (BEYOND_LIMIT * limit * dt_s).powi(2));
    }
    if dt_s > config.max_gap_s {
        belief.add_variance(THETA, (GAP_RATE * dt_s).powi(2));
        belief.add_acceleration(GAP_ACCEL, dt_s);
    }
    belief.stamp = stamp;
}
