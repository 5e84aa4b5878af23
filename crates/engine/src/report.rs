//! What became of a run, in numbers: statuses, segments, coverage.

use crate::world::World;
use sphereflow_core::{Reason, Stamp, TrackStatus};
use sphereflow_slam::GraphReport;

/// A chain of measurements that hang together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Its number.
    pub index: u32,
    /// Stamp of its first frame with a pose.
    pub first: Stamp,
    /// Stamp of its last.
    pub last: Stamp,
    /// Frames with a pose.
    pub frames: usize,
}

/// The numbers of a run so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Frames pushed.
    pub frames: usize,
    /// Frames with a measured pose, repeated images among them.
    pub with_pose: usize,
    /// Those of them whose motion is poorly determined.
    pub weak: usize,
    /// Frames left out on purpose that have no pose: stamps that do not increase.
    pub left_out: usize,
    /// Keyframes made.
    pub keyframes: usize,
    /// The chains of measurements.
    pub segments: Vec<Segment>,
    /// The world's axes.
    pub world: World,
    /// What comparing the keyframes gave; `None` before [`crate::Engine::finish`], and where there
    /// was nothing to compare.
    pub graph: Option<GraphReport>,
}

impl Report {
    pub(crate) fn new(world: World) -> Self {
        Self {
            frames: 0,
            with_pose: 0,
            weak: 0,
            left_out: 0,
            keyframes: 0,
            segments: Vec::new(),
            world,
            graph: None,
        }
    }

    /// Share of the frames that have a pose, those left out on purpose not counted; 0 without frames.
    pub fn coverage(&self) -> f64 {
        share(self.with_pose, self.frames - self.left_out)
    }

    /// Share of the frames whose pose is weak.
    pub fn coverage_weak(&self) -> f64 {
        share(self.weak, self.frames - self.left_out)
    }

    pub(crate) fn note(&mut self, stamp: Stamp, status: &TrackStatus, segment: u32) {
        self.frames += 1;
        let left_out =
            matches!(status, TrackStatus::Skipped(reason) if *reason != Reason::DuplicateFrame);
        self.left_out += usize::from(left_out);
        if !status.has_pose() {
            return;
        }
        self.with_pose += 1;
        self.weak += usize::from(matches!(status, TrackStatus::Weak(_)));
        match self
            .segments
            .last_mut()
            .filter(|last| last.index == segment)
        {
            Some(last) => {
                last.last = stamp;
                last.frames += 1;
            }
            None => self.segments.push(Segment {
                index: segment,
                first: stamp,
                last: stamp,
                frames: 1,
            }),
        }
    }
}

fn share(part: usize, whole: usize) -> f64 {
    if whole == 0 {
        return 0.0;
    }
    part as f64 / whole as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> Report {
        Report::new(World::GravityAligned)
    }

    #[test]
    fn report_counts_poses_weak_ones_and_leaves_out_what_was_skipped() {
        let mut report = report();
        let unobservable = TrackStatus::Weak(Reason::Unobservable { score: 0.01 });
        let statuses = [
            TrackStatus::Started,
            TrackStatus::Tracked,
            unobservable,
            TrackStatus::Skipped(Reason::DuplicateFrame),
            TrackStatus::Skipped(Reason::StampNotIncreasing),
            TrackStatus::Lost(Reason::NoDepth),
        ];
        for (i, status) in statuses.iter().enumerate() {
            report.note(Stamp::from_ns(i as i64), status, 0);
        }
        assert_eq!(report.coverage(), 4.0 / 5.0);
        assert_eq!(report.coverage_weak(), 1.0 / 5.0);
    }

    #[test]
    fn report_has_a_segment_for_each_chain() {
        let mut report = report();
        for (ns, segment) in [(0, 0), (1, 0), (5, 1), (6, 1), (7, 1)] {
            report.note(Stamp::from_ns(ns), &TrackStatus::Tracked, segment);
        }
        let frames: Vec<usize> = report.segments.iter().map(|s| s.frames).collect();
        assert_eq!(frames, [2, 3]);
        assert_eq!(report.segments[1].first, Stamp::from_ns(5));
    }

    #[test]
    fn report_without_frames_covers_nothing() {
        assert_eq!(report().coverage(), 0.0);
    }
}
