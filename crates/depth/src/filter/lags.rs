//! Which past frames an image is compared with.

use super::DepthFilter;
use super::state::Past;

/// Images that are compared with the oldest one and not yet forgotten: one to four, while it stands in for a lag.
const REPEATS: f32 = 3.0;

/// A frame says more than the longest lag that is there if it is so many times as old.
const OLDER: f32 = 1.5;

impl DepthFilter {
    /// Past frames at the lags that are there and usable.
    pub(super) fn compared(&self) -> impl Iterator<Item = (usize, &Past)> {
        let there = self.lags_there().chain(self.first_lag());
        let frames = there.filter_map(|lag| Some((lag, self.past.get(lag - 1)?)));
        frames.filter(|(_, past)| !past.image.pixel.is_empty())
    }

    /// Lags as long as there are past frames.
    fn lags_there(&self) -> impl Iterator<Item = usize> {
        let lags = self.config.lags.iter().copied();
        lags.take_while(|lag| *lag <= self.past.len())
    }

    /// That of the oldest frame, which stands in for the lags that are not there yet: what a start lacks is baseline.
    /// Not for long: its noise is the same for all images that are compared with it, and is forgotten early on only.
    fn first_lag(&self) -> Option<usize> {
        let oldest = self.past.len();
        let longest = self.lags_there().last().unwrap_or(0);
        let lacking = self.config.lags.iter().any(|lag| *lag > oldest);
        let early = self.updates < self.config.start_frames;
        let older = oldest > longest && oldest as f32 >= OLDER * longest as f32;
        (lacking && early && older).then_some(oldest)
    }

    /// Images, not yet forgotten, that have been compared with the same one as that of a lag.
    pub(super) fn repeats(&self, lag: usize) -> f32 {
        if self.config.lags.contains(&lag) {
            1.0
        } else {
            REPEATS
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to
mod tests {
    use super::*;
    use crate::DepthFilterConfig;
    use nalgebra::{UnitQuaternion, Vector3};
    use sphereflow_core::{Plane, Pose, Stamp};
    use sphereflow_sphere::Camera;

    /// A filter that has seen `past` images of a camera that moves before a painted wall.
    fn filter_after(past: usize, config: &DepthFilterConfig) -> DepthFilter {
        let camera = Camera::pinhole(60.0, 60.0, 31.5, 23.5, 64, 48).unwrap();
        let mut filter = DepthFilter::new(&camera, config.clone()).unwrap();
        for index in 0..past {
            let x_m = 0.01 * index as f64;
            let image = Plane::from_fn(64, 48, |x, y| {
                let (x, y) = (x as f64 + 60.0 * x_m, y as f64);
                (128.0 + 40.0 * (0.4 * x + 0.2 * y).sin() + 30.0 * (0.5 * y - 0.3 * x).sin()) as f32
            });
            let pose = Pose::new(UnitQuaternion::identity(), Vector3::new(x_m, 0.0, 0.0));
            let stamp = Stamp::from_ns(1 + index as i64);
            filter.step(&image, &pose, stamp).unwrap();
        }
        filter
    }

    /// The lags that the next image would be compared with.
    fn lags_after(past: usize, config: &DepthFilterConfig) -> Vec<usize> {
        let filter = filter_after(past, config);
        filter.compared().map(|(lag, _)| lag).collect()
    }

    #[test]
    fn the_first_image_stands_in_for_lags_that_are_not_there_yet() {
        let config = DepthFilterConfig::default();
        let expected: [(usize, &[usize]); 8] = [
            (0, &[]),
            (1, &[1]),
            (2, &[1, 2]),
            (4, &[1, 3]),
            (5, &[1, 3, 5]),
            (10, &[1, 3, 7]),
            (11, &[1, 3, 7, 11]),
            (24, &[1, 3, 7, 16, 24]),
        ];
        for (past, lags) in expected {
            assert_eq!(lags_after(past, &config), lags, "after {past}");
        }
        // Not for long, and not where no longer lag is wanted.
        assert_eq!(lags_after(50, &config), [1, 3, 7, 16, 32]);
        let lags = vec![1, 3];
        assert_eq!(
            lags_after(20, &DepthFilterConfig { lags, ..config }),
            [1, 3]
        );
    }

    #[test]
    fn noise_of_the_first_image_counts_more_than_once_while_it_stands_in() {
        let config = DepthFilterConfig::default();
        let filter = filter_after(11, &config);
        let repeats: Vec<f32> = filter
            .compared()
            .map(|(lag, _)| filter.repeats(lag))
            .collect();
        assert_eq!(repeats, [1.0, 1.0, 1.0, REPEATS]);
    }
}
