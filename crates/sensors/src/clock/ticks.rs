//! Ticks of a counter of 32 bits without its wraps, by the help of the host's clock.

use sphereflow_core::Stamp;
use sphereflow_core::checks::positive;

/// How far a device's clock and the host's may disagree about the time since the last tick and still
/// be taken for in step, seconds: arrivals are late by less, and a clock that steps by less cannot
/// be told from one that does not.
const STEP_S: f64 = 1.0;

/// What happened to a clock so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickFaults {
    /// Times that the counter stood still or stepped back.
    pub steps_back: u64,
    /// Times that it ran away from the host's clock by more than a second.
    pub jumps: u64,
    /// Times that it passed through 0 in the ordinary way.
    pub wraps: u64,
}

/// A counter of 32 bits that runs at a known rate.
#[derive(Clone, Debug)]
pub struct Ticks {
    rate_hz: f64,
    last: Option<(u32, Stamp, i64)>,
    faults: TickFaults,
}

impl Ticks {
    /// For a counter with so many ticks per second.
    ///
    /// # Errors
    /// Where the rate is not positive.
    pub fn new(rate_hz: f64) -> crate::Result<Self> {
        positive("rate_hz", rate_hz)?;
        Ok(Self {
            rate_hz,
            last: None,
            faults: TickFaults::default(),
        })
    }

    /// What happened so far.
    pub fn faults(&self) -> TickFaults {
        self.faults
    }

    /// Device time of a tick, nanoseconds since the counter was 0 before the first one; `arrived` is
    /// when the host got it, and says how many wraps lie between. `None` where the counter stood still,
    /// stepped back, or jumped: the device's time begins anew then, at the host's distance.
    pub fn device_ns(&mut self, ticks: u32, arrived: Stamp) -> Option<i64> {
        let ns_of = |ticks: f64| (ticks * 1e9 / self.rate_hz).round() as i64;
        let Some((last, before, last_ns)) = self.last else {
            let ns = ns_of(f64::from(ticks));
            self.last = Some((ticks, arrived, ns));
            return Some(ns);
        };
        let host_ticks = arrived.seconds_since(before) * self.rate_hz;
        let step = f64::from(ticks) - f64::from(last);
        let range = 4_294_967_296.0;
        // the number of wraps that brings the device nearest to the host
        let wraps = ((host_ticks - step) / range).round().max(0.0);
        let passed = step + wraps * range;
        let late = (host_ticks - passed) / self.rate_hz;
        let sound = passed > 0.0 && late.abs() <= STEP_S;
        if !sound {
            self.faults.steps_back += u64::from(passed <= 0.0);
            self.faults.jumps += u64::from(passed > 0.0);
        }
        let passed = if sound { passed } else { host_ticks.max(0.0) };
        self.faults.wraps += if sound { wraps as u64 } else { 0 };
        let ns = last_ns.saturating_add(ns_of(passed));
        self.last = Some((ticks, arrived, ns));
        sound.then_some(ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: f64) -> Stamp {
        Stamp::from_ns(1_000_000_000_000).plus_seconds(s)
    }

    #[test]
    fn ticks_over_wraps_go_on() {
        let mut ticks = Ticks::new(60e6).unwrap();
        let mut last: Option<i64> = None;
        for i in 0..6000_u32 {
            let s = f64::from(i) / 30.0;
            let late = f64::from(i % 7) * 2e-3;
            let raw = (4_000_000_000_u64 + 2_000_000 * u64::from(i)) as u32;
            let ns = ticks.device_ns(raw, at(s + late)).unwrap();
            if let Some(last) = last {
                assert!(
                    (ns - last - 33_333_333_i64).abs() <= 1,
                    "{i}: {}",
                    ns - last
                );
            }
            last = Some(ns);
        }
        assert_eq!(
            ticks.faults(),
            TickFaults {
                wraps: 3,
                ..TickFaults::default()
            }
        );
    }

    #[test]
    fn ticks_after_a_pause_of_several_wraps_are_right() {
        let mut ticks = Ticks::new(60e6).unwrap();
        let first = ticks.device_ns(5, at(0.0)).unwrap();
        let pause = 300.0;
        let raw = (5_u64 + 60_000_000 * 300) as u32;
        let ns = ticks.device_ns(raw, at(pause + 0.01)).unwrap();
        assert!((ns - first - 300_000_000_000_i64).abs() <= 1);
    }

    #[test]
    fn ticks_that_step_back_or_jump_are_counted_and_have_no_time() {
        let mut ticks = Ticks::new(60e6).unwrap();
        ticks.device_ns(1_000_000_000, at(0.0));
        assert_eq!(ticks.device_ns(999_000_000, at(0.03)), None);
        assert!(ticks.device_ns(1_001_000_000, at(0.06)).is_some());
        assert_eq!(ticks.device_ns(1_401_000_000, at(0.09)), None); // 6.7 s within 0.03 s
        assert_eq!((ticks.faults().steps_back, ticks.faults().jumps), (1, 1));
        assert!(Ticks::new(0.0).is_err());
    }
}
