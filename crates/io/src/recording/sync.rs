//! Which colour image belongs to which depth image: the nearest within a tolerance.

use sphereflow_core::Stamp;

/// Differences between the stamps of depth and colour that were accepted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SyncStatistics {
    /// Frames with colour.
    pub pairs: usize,
    /// Median absolute difference, seconds.
    pub median_s: f64,
    /// Largest absolute difference, seconds.
    pub max_s: f64,
    /// The tolerance that was applied, seconds.
    pub tolerance_s: f64,
}

/// The tolerance for a list of one stamp, which has no interval: half of 30 Hz.
const LONE_FRAME_TOLERANCE_NS: u64 = 16_666_667;

/// Half the median interval of the stamps, nanoseconds.
pub(super) fn half_median_interval_ns(stamps: &[Stamp]) -> u64 {
    let mut intervals: Vec<u64> = stamps
        .windows(2)
        .map(|pair| pair[1].abs_diff_ns(pair[0]))
        .collect();
    intervals.sort_unstable();
    match intervals.get(intervals.len() / 2) {
        Some(median) => median / 2,
        None => LONE_FRAME_TOLERANCE_NS,
    }
}

/// For each stamp of `clock` the index of the nearest of `others` (both increasing), the earlier
/// of two equally near, where it is at most `tolerance_ns` away.
pub(super) fn nearest(clock: &[Stamp], others: &[Stamp], tolerance_ns: u64) -> Vec<Option<usize>> {
    let of = |stamp: Stamp| {
        let after = others.partition_point(|&other| other < stamp);
        [
            after.checked_sub(1),
            (after < others.len()).then_some(after),
        ]
        .into_iter()
        .flatten()
        .min_by_key(|&index| others[index].abs_diff_ns(stamp))
        .filter(|&index| others[index].abs_diff_ns(stamp) <= tolerance_ns)
    };
    clock.iter().map(|&stamp| of(stamp)).collect()
}

/// Statistics of the pairs that [`nearest`] made; `None` without pairs.
pub(super) fn statistics(
    clock: &[Stamp],
    others: &[Stamp],
    pairs: &[Option<usize>],
    tolerance_ns: u64,
) -> Option<SyncStatistics> {
    let mut differences: Vec<u64> = clock
        .iter()
        .zip(pairs)
        .filter_map(|(stamp, pair)| pair.map(|index| others[index].abs_diff_ns(*stamp)))
        .collect();
    differences.sort_unstable();
    let median = differences.get(differences.len() / 2)?;
    Some(SyncStatistics {
        pairs: differences.len(),
        median_s: *median as f64 * 1e-9,
        max_s: *differences.last()? as f64 * 1e-9,
        tolerance_s: tolerance_ns as f64 * 1e-9,
    })
}
