//! The clock of one stream of frames: ticks of 32 bits to the host's time.

use super::{ClockFit, ClockState, TickFaults, Ticks};
use sphereflow_core::Stamp;

/// Ticks and fit of one stream. Each stream has its own: frames of two streams overtake each other.
#[derive(Clone, Debug)]
pub struct StreamClock {
    ticks: Ticks,
    fit: ClockFit,
}

impl StreamClock {
    /// For ticks at this rate.
    ///
    /// # Errors
    /// Where the rate is not positive.
    pub fn new(rate_hz: f64) -> crate::Result<Self> {
        Ok(Self {
            ticks: Ticks::new(rate_hz)?,
            fit: ClockFit::new(),
        })
    }

    /// Host time of a frame; its arrival, where its ticks are missing or make no sense.
    pub fn stamp(&mut self, ticks: Option<u32>, arrived: Stamp) -> Stamp {
        let device_ns = ticks.and_then(|ticks| self.ticks.device_ns(ticks, arrived));
        device_ns.map_or(arrived, |ns| self.fit.stamp(ns, arrived))
    }

    /// Drift and jitter.
    pub fn state(&self) -> ClockState {
        self.fit.state()
    }

    /// Steps and wraps.
    pub fn faults(&self) -> TickFaults {
        self.ticks.faults()
    }
}
