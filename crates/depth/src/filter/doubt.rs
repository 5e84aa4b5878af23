//! What makes a pixel's range more or less certain than its variance says.

use super::judge::Tally;
use super::lattice::Lattice;
use super::state::Node;

/// How long pixels have been in view, as the pairs of an image say.
pub(super) struct Views<'a> {
    /// The least lag at which a pixel was outside the past image, frames; 0 where it always was inside.
    pub since: &'a mut [f32],
    /// Information that the image gave, m^2. Until its last pair has spoken, the information before.
    pub gained: &'a mut [f32],
}

/// Doubts of all pixels.
#[derive(Clone, Debug, Default)]
pub(super) struct Doubt {
    /// As of [`Views`], of the last image.
    since: Vec<f32>,
    gained: Vec<f32>,
    /// Squared residuals over those expected, as measured.
    misfit: f32,
}

/// Share of an image's misfit in the measure of it.
const MEMORY: f32 = 0.1;

/// Residuals do not show all errors: noise is taken for no smaller share of what is expected, as a variance.
const LEAST_MISFIT: f32 = 0.04;

/// Relative deviation up to which noise is what makes it; larger ones are doubts about the surface.
const BY_NOISE: f32 = 0.02;

/// A pixel that came into view may have gained this many times what the last image gave, by each image since.
const SLACK: f32 = 2.0;

/// Relative deviation of a pixel that is taken for a part of the surface beside it, as of planes that are continued.
const OTHER: f32 = 0.04;

impl Doubt {
    pub fn new(pixels: usize) -> Self {
        Self {
            since: vec![0.0; pixels],
            gained: vec![0.0; pixels],
            misfit: 1.0,
        }
    }

    /// Before any pair of an image has spoken. Its outermost `margin` pixels are not compared: what stands there now
    /// is not known, however well known that was which stood there before.
    pub fn begin(&mut self, lattice: &Lattice, margin: usize) {
        let (width, height) = (lattice.width, lattice.height);
        let sides = if lattice.wraps { 0 } else { margin };
        for (y, row) in self.since.chunks_exact_mut(width).enumerate() {
            let whole = y < margin || y + margin >= height;
            row.fill(if whole { 1.0 } else { 0.0 });
            row[..sides].fill(1.0);
            row[width - sides..].fill(1.0);
        }
    }

    pub fn views(&mut self) -> Views<'_> {
        Views {
            since: &mut self.since,
            gained: &mut self.gained,
        }
    }

    /// What an image's residuals say of the noise.
    pub fn learn(&mut self, tally: &Tally) {
        let misfit = tally.misfit / tally.information;
        if misfit.is_finite() {
            self.misfit += MEMORY * (misfit - self.misfit);
        }
    }

    /// Relative variance of every pixel on top of the state's.
    pub fn of_pixels(&self, nodes: &[Node], trust: &[f32]) -> Vec<f32> {
        let views = self.since.iter().zip(&self.gained);
        let pixels = nodes.iter().zip(trust).zip(views);
        pixels
            .map(|((node, trust), (since, gained))| {
                against(*trust) + unproven(node, *since, *gained)
            })
            .collect()
    }

    /// The state's variance as it is where the noise is as measured. `square` is zeta^2.
    #[inline(always)]
    pub fn of_noise(&self, variance: f32, square: f32) -> f32 {
        let most = BY_NOISE * BY_NOISE * square;
        let by_noise = variance * most / (variance + most);
        variance - (1.0 - self.misfit.clamp(LEAST_MISFIT, 1.0)) * by_noise
    }
}

/// Relative variance of a pixel that the images speak against, however sure the planes around it are.
#[inline(always)]
fn against(trust: f32) -> f32 {
    /// Where nothing is trusted.
    const ELSEWHERE: f32 = 0.3;
    let doubt = 1.0 - 2.0 * trust;
    let doubt = ELSEWHERE * if doubt > 0.0 { doubt } else { 0.0 };
    doubt * doubt
}

/// Relative variance of a pixel that came into view lately: until its own images have shown its range, it
/// may be another surface than the one beside it. What the state has there is that one's.
#[inline(always)]
fn unproven(node: &Node, since: f32, gained: f32) -> f32 {
    let most = SLACK * since * gained;
    let own = if node[2] < most { node[2] } else { most };
    let square = node[0] * node[0];
    let variance = 1.0 / (1.0 / (OTHER * OTHER) + own * square);
    if since > 0.0 { variance } else { 0.0 }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to
mod tests {
    use super::*;
    use crate::{DepthFilter, DepthFilterConfig};
    use nalgebra::{UnitQuaternion, Vector3};
    use sphereflow_core::{Plane, Pose, Stamp};
    use sphereflow_sphere::Camera;

    /// Single precision of a few operations.
    const ROUNDING: f32 = 1e-4;
    const WIDTH: usize = 80;
    const HEIGHT: usize = 60;

    /// Images enough for the misfit to be known to a thousandth.
    fn measured(misfit: f32) -> Doubt {
        let mut doubt = Doubt::new(1);
        let tally = Tally {
            information: 4.0,
            misfit: 4.0 * misfit,
            ..Tally::default()
        };
        (0..200).for_each(|_| doubt.learn(&tally));
        doubt
    }

    fn close(found: f32, expected: f32) {
        assert!(
            (found - expected).abs() < ROUNDING * expected,
            "{found}, expected {expected}"
        );
    }

    #[test]
    fn misfit_below_one_shrinks_what_is_noise_and_no_other_variance() {
        let zeta = 0.5_f32;
        let square = zeta * zeta;
        let doubt = measured(0.25);
        // A deviation of a twentieth of what is noise at most, and one of 25 times as much.
        let (small, large) = ((1e-3 * zeta).powi(2), (0.5 * zeta).powi(2));
        let part = 1.0 / (1.0 + (1e-3_f32 / BY_NOISE).powi(2));
        close(doubt.of_noise(small, square), small * (1.0 - 0.75 * part));
        let found = doubt.of_noise(large, square);
        assert!(found > 0.99 * large && found <= large);
        // However well residuals fit.
        let least = measured(0.0).of_noise(small, square);
        close(least, small * (1.0 - (1.0 - LEAST_MISFIT) * part));
    }

    #[test]
    fn pixels_of_the_border_that_are_not_compared_may_be_another_surface_however_well_known() {
        let camera = Camera::pinhole(60.0, 60.0, 39.5, 29.5, WIDTH, HEIGHT).unwrap();
        let lattice = Lattice::new(&camera).unwrap();
        let mut doubt = Doubt::new(WIDTH * HEIGHT);
        doubt.begin(&lattice, 2);
        let (nodes, trust) = (
            vec![[0.5, 0.0, 1e6, 1e-9]; WIDTH * HEIGHT],
            vec![1.0; WIDTH * HEIGHT],
        );
        for (i, found) in doubt.of_pixels(&nodes, &trust).iter().enumerate() {
            let (x, y) = (i % WIDTH, i / WIDTH);
            let inner = (2..WIDTH - 2).contains(&x) && (2..HEIGHT - 2).contains(&y);
            let expected = if inner { 0.0 } else { OTHER * OTHER };
            assert!((found - expected).abs() <= ROUNDING * expected, "{x}, {y}");
        }
    }

    #[test]
    fn misfit_above_one_or_of_no_residuals_leaves_variances_as_they_are() {
        close(measured(3.0).of_noise(1e-6, 0.25), 1e-6);
        let mut doubt = Doubt::new(1);
        doubt.learn(&Tally::default());
        close(doubt.of_noise(1e-6, 0.25), 1e-6);
    }

    #[test]
    fn pixels_lately_in_view_begin_as_another_surface_and_end_with_their_own_information() {
        let node = [0.5, 0.0, 4e6, 2.5e-7];
        close(unproven(&node, 1.0, 0.0), OTHER * OTHER);
        // Doubt only falls as the pixel is in view for longer, down to what the state knows of it.
        let gained = 100.0;
        let doubts = [1.0, 4.0, 12.0, 24.0].map(|since| unproven(&node, since, gained));
        assert!(doubts.windows(2).all(|two| two[1] < two[0]), "{doubts:?}");
        let own = 1.0 / (1.0 / (OTHER * OTHER) + 4e6 * 0.25);
        close(unproven(&node, 24.0, 1e9), own);
    }

    #[test]
    fn pixels_always_in_view_are_in_no_doubt_but_for_their_trust() {
        let node = [0.5, 0.0, 4e6, 2.5e-7];
        for gained in [0.0, 1.0, 1e9] {
            assert_eq!(unproven(&node, 0.0, gained), 0.0);
        }
        let doubt = Doubt::new(3);
        let found = doubt.of_pixels(&[node; 3], &[1.0, 0.5, 0.0]);
        assert_eq!(found[..2], [0.0, 0.0]);
        // Where nothing is trusted: 30 %.
        close(found[2], 0.09);
    }

    /// After 40 images of a painted wall, 2 m away, along which the camera goes to the right by 4 pixels an image.
    fn passing() -> DepthFilter {
        let camera = Camera::pinhole(80.0, 80.0, 39.5, 29.5, WIDTH, HEIGHT).unwrap();
        let config = DepthFilterConfig {
            binning: 1,
            initial_range_m: 2.0,
            lags: vec![1, 2, 4],
            ..DepthFilterConfig::default()
        };
        let mut filter = DepthFilter::new(&camera, config).unwrap();
        for index in 0..40 {
            let place = 0.1 * f64::from(index);
            let image = Plane::from_fn(WIDTH, HEIGHT, |x, y| {
                let (x, y) = ((x as f64 - 39.5) / 40.0 + place, (y as f64 - 29.5) / 40.0);
                let waves = (9.0 * x + 3.0 * y).sin() + (7.0 * y - 2.0 * x).sin();
                (128.0 + 40.0 * waves) as f32
            });
            let pose = Pose::new(UnitQuaternion::identity(), Vector3::new(place, 0.0, 0.0));
            let stamp = Stamp::from_ns(i64::from(index) + 1);
            filter.step(&image, &pose, stamp).unwrap();
        }
        filter
    }

    #[test]
    fn pixels_at_the_border_ahead_came_into_view_as_many_images_ago_as_their_distance_says() {
        let filter = passing();
        let row = &filter.doubt.since[30 * WIDTH..31 * WIDTH];
        // Of what is seen now, the past images had less by 4, 8 and 16 pixels and by their margin.
        let margin = filter.past[0].image.margin as usize + 1;
        for (x, since) in row.iter().enumerate() {
            // Between both a pixel's rounding decides.
            let ahead = WIDTH - 1 - x;
            let expected = match ahead {
                _ if ahead + 1 < margin + 4 => 1.0,
                _ if ahead > margin + 4 && ahead + 1 < margin + 8 => 2.0,
                _ if ahead > margin + 8 && ahead + 1 < margin + 16 => 4.0,
                _ if ahead > margin + 16 && x > margin + 1 => 0.0,
                _ => continue,
            };
            assert_eq!(*since, expected, "column {x}");
        }
        // What the image gave stays below what the state has, and above nothing where there is texture.
        let gained = &filter.doubt.gained[30 * WIDTH + 20..30 * WIDTH + 50];
        let nodes = &filter.nodes[30 * WIDTH + 20..30 * WIDTH + 50];
        let pairs = || gained.iter().zip(nodes);
        assert!(pairs().all(|(gained, node)| (0.0..=1.01 * node[2]).contains(gained)));
        assert!(gained.iter().sum::<f32>() > 0.0);
    }

    #[test]
    fn deviation_ahead_is_larger_than_where_the_wall_has_been_seen_for_long() {
        let (range, std) = passing().range();
        let relative = |x: usize| std[(x, 30)] / range[(x, 30)];
        assert!(relative(WIDTH - 2) > 0.5 * OTHER);
        assert!(relative(WIDTH / 2) < 0.25 * OTHER);
    }
}
