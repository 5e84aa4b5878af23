//! Samples of two streams brought together: exact, nearest, or interpolated, with what differs.

use sphereflow_core::{ImuSample, Stamp};
use std::collections::VecDeque;

/// Samples that are held while the other stream is behind; older ones are dropped and counted.
const HELD: usize = 256;

/// What a synchroniser did so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PairCounts {
    /// Pairs that came out.
    pub pairs: u64,
    /// Samples of the first stream without a partner.
    pub single_first: u64,
    /// Samples of the second stream without a partner.
    pub single_second: u64,
    /// Largest difference within a pair, nanoseconds.
    pub largest_ns: u64,
}

/// Two samples that belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pair<A, B> {
    /// Of the first stream.
    pub first: A,
    /// Of the second stream.
    pub second: B,
    /// Stamp of the second less that of the first, nanoseconds.
    pub difference_ns: i64,
}

/// Pairs each sample of a first stream with the nearest one of a second, no further than a limit; a
/// limit of 0 asks for equal stamps. No sample is used twice; stamps of each stream must increase.
#[derive(Clone, Debug)]
pub struct Synchroniser<A, B> {
    limit_ns: u64,
    first: VecDeque<(Stamp, A)>,
    second: VecDeque<(Stamp, B)>,
    counts: PairCounts,
}

impl<A, B> Synchroniser<A, B> {
    /// With a largest difference of `limit_ns` nanoseconds.
    pub fn new(limit_ns: u64) -> Self {
        let (first, second) = (VecDeque::new(), VecDeque::new());
        Self {
            limit_ns,
            first,
            second,
            counts: PairCounts::default(),
        }
    }

    /// What became of the samples so far; those still held are not among them.
    pub fn counts(&self) -> PairCounts {
        self.counts
    }

    /// A sample of the first stream.
    pub fn push_first(&mut self, stamp: Stamp, sample: A) {
        self.first.push_back((stamp, sample));
        if self.first.len() > HELD {
            self.first.pop_front();
            self.counts.single_first += 1;
        }
    }

    /// A sample of the second stream.
    pub fn push_second(&mut self, stamp: Stamp, sample: B) {
        self.second.push_back((stamp, sample));
        if self.second.len() > HELD {
            self.second.pop_front();
            self.counts.single_second += 1;
        }
    }

    /// The next pair, once no sample to come can be nearer.
    pub fn next_pair(&mut self) -> Option<Pair<A, B>> {
        loop {
            let (a, b) = (self.first.front()?.0, self.second.front()?.0);
            let distance = a.abs_diff_ns(b);
            if distance > self.limit_ns {
                if a < b {
                    self.first.pop_front();
                    self.counts.single_first += 1;
                } else {
                    self.second.pop_front();
                    self.counts.single_second += 1;
                }
                continue;
            }
            // the later one's next neighbour may be nearer to the earlier one's stamp
            if b < a && distance > 0 {
                match self.second.get(1) {
                    None => return None,
                    Some((next, _)) if a.abs_diff_ns(*next) < distance => {
                        self.second.pop_front();
                        self.counts.single_second += 1;
                        continue;
                    }
                    Some(_) => {}
                }
            } else if a < b {
                match self.first.get(1) {
                    None => return None,
                    Some((next, _)) if b.abs_diff_ns(*next) < distance => {
                        self.first.pop_front();
                        self.counts.single_first += 1;
                        continue;
                    }
                    Some(_) => {}
                }
            }
            let ((a, first), (b, second)) = (self.first.pop_front()?, self.second.pop_front()?);
            self.counts.pairs += 1;
            self.counts.largest_ns = self.counts.largest_ns.max(distance);
            let difference_ns = b.ns().saturating_sub(a.ns());
            return Some(Pair {
                first,
                second,
                difference_ns,
            });
        }
    }
}

/// The inertial sample at `stamp` between two others, by a straight line; the second value is the
/// distance to the nearer of them, seconds. `None` where `stamp` is not between them.
pub fn interpolate_imu(
    before: &ImuSample,
    after: &ImuSample,
    stamp: Stamp,
) -> Option<(ImuSample, f64)> {
    if stamp < before.stamp || stamp > after.stamp {
        return None;
    }
    let (from, to) = (
        stamp.seconds_since(before.stamp),
        after.stamp.seconds_since(stamp),
    );
    let share = if from + to > 0.0 {
        from / (from + to)
    } else {
        0.0
    };
    let sample = ImuSample {
        stamp,
        gyro_rad_s: before.gyro_rad_s.lerp(&after.gyro_rad_s, share),
        accel_m_s2: before.accel_m_s2.lerp(&after.accel_m_s2, share),
    };
    Some((sample, from.min(to)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn pairs(limit: u64, first: &[i64], second: &[i64]) -> (Vec<(i64, i64)>, PairCounts) {
        let mut both = Synchroniser::new(limit);
        let mut found = Vec::new();
        for i in 0..first.len().max(second.len()) {
            if let Some(ns) = first.get(i) {
                both.push_first(Stamp::from_ns(*ns), *ns);
            }
            if let Some(ns) = second.get(i) {
                both.push_second(Stamp::from_ns(*ns), *ns);
            }
            while let Some(pair) = both.next_pair() {
                assert_eq!(pair.difference_ns, pair.second - pair.first);
                found.push((pair.first, pair.second));
            }
        }
        (found, both.counts())
    }

    #[test]
    fn synchroniser_pairs_the_nearest_and_counts_the_rest() {
        let (found, counts) = pairs(20, &[100, 200, 300, 400], &[95, 190, 205, 350, 410, 600]);
        assert_eq!(found, [(100, 95), (200, 205)]);
        // 400 and 410 wait: a later first sample might be nearer to 410
        assert_eq!((counts.pairs, counts.largest_ns), (2, 5));
        assert_eq!((counts.single_first, counts.single_second), (1, 2));
    }

    #[test]
    fn synchroniser_with_no_difference_allowed_is_exact() {
        let (found, counts) = pairs(0, &[1, 2, 3], &[2, 3, 5]);
        assert_eq!(found, [(2, 2), (3, 3)]);
        assert_eq!(counts.single_first, 1);
    }

    #[test]
    fn synchroniser_of_one_stream_alone_holds_a_bounded_number() {
        let mut both: Synchroniser<i64, i64> = Synchroniser::new(5);
        for ns in 0..10_000 {
            both.push_first(Stamp::from_ns(ns), ns);
        }
        assert_eq!(both.counts().single_first as usize + HELD, 10_000);
    }

    #[test]
    fn interpolated_imu_lies_between_and_tells_its_distance() {
        let sample = |ns, v| ImuSample {
            stamp: Stamp::from_ns(ns),
            gyro_rad_s: Vector3::repeat(v),
            accel_m_s2: Vector3::repeat(2.0 * v),
        };
        let (a, b) = (sample(0, 1.0), sample(8_000_000, 3.0));
        let (middle, distance) = interpolate_imu(&a, &b, Stamp::from_ns(2_000_000)).unwrap();
        assert_eq!((middle.gyro_rad_s.x, middle.accel_m_s2.y), (1.5, 3.0));
        assert!((distance - 0.002).abs() < 1e-12);
        assert!(interpolate_imu(&a, &b, Stamp::from_ns(9_000_000)).is_none());
    }
}
