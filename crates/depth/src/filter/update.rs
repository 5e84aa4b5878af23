//! The state corrected by comparing the new image with those of the past.

use super::doubt::Views;
use super::judge::{Judge, Tally, asked};
use super::lattice::{LensCall, TOGETHER};
use super::lens::Lens;
use super::pair::Pair;
use super::prepare::Prepared;
use super::seen::Seen;
use super::state::Node;
use rayon::prelude::*;

/// The correction of the nodes by an image's pairs, the shortest first.
pub(super) struct Update<'a, 'b> {
    pub pairs: &'a [Pair<'b>],
    pub nodes: &'a mut [Node],
    /// How well baselines fit, 0 to 1: where short ones do not, a longer one meets the wrong
    /// piece of texture, and would drown them by its weight.
    pub trust: &'a mut [f32],
    /// What the pairs say of each pixel's time in view.
    pub views: Views<'a>,
}

/// Rows from one whose residuals are compared with those expected to the next: a quarter says as much of the image.
const SAMPLED: usize = 4;

/// Information fades where the shortest baselines do not fit: to this share where nothing is trusted.
const FADE: f32 = 0.85;

/// Old mistakes are forgotten where the images speak against them. The mean stays. Where `views` holds the
/// information of before the image, it is what the image gave afterwards.
pub(super) fn fade(nodes: &mut [Node], trust: &[f32], views: Views<'_>) {
    for ((node, trust), gained) in nodes.iter_mut().zip(trust).zip(views.gained) {
        *gained = node[2] - *gained;
        let keep = FADE + (1.0 - FADE) * (2.0 * trust).min(1.0);
        node[1] *= keep;
        node[2] *= keep;
    }
}

impl LensCall<Tally> for Update<'_, '_> {
    fn call<L: Lens>(self, lens: &L) -> Tally {
        let Self {
            pairs,
            nodes,
            trust,
            views,
        } = self;
        trust.fill(1.0);
        let Some(first) = pairs.first() else {
            return Tally::default();
        };
        let (width, arch) = (first.lattice.width, pulp::Arch::new());
        let rows: Vec<Tally> = nodes
            .par_chunks_mut(width)
            .zip(trust.par_chunks_mut(width))
            .zip(views.since.par_chunks_mut(width))
            .zip(views.gained.par_chunks_mut(width))
            .enumerate()
            .map(|(y, (((row, trust), since), gained))| {
                arch.dispatch(UpdateRow {
                    lens,
                    new: first.new,
                    pairs,
                    y,
                    row,
                    trust,
                    views: Views { since, gained },
                })
            })
            .collect();
        let mut all = Tally::default();
        rows.iter().for_each(|row| all.add(row));
        all
    }
}

/// One row, compiled for wide vectors.
struct UpdateRow<'a, 'b, L: Lens> {
    lens: &'a L,
    /// The image of all pairs.
    new: &'a Prepared,
    pairs: &'a [Pair<'b>],
    y: usize,
    row: &'a mut [Node],
    trust: &'a mut [f32],
    views: Views<'a>,
}

impl<L: Lens> pulp::WithSimd for UpdateRow<'_, '_, L> {
    type Output = Tally;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Tally {
        let mut tally = Tally::default();
        let mut first = self.y * self.row.len();
        let before = self.views.gained.iter_mut().zip(&*self.row);
        before.for_each(|(gained, node)| *gained = node[2]);
        let mut seen = Seen::new();
        let pixels = self.row.chunks_mut(TOGETHER);
        let pixels = pixels.zip(self.trust.chunks_mut(TOGETHER));
        for ((nodes, trust), since) in pixels.zip(self.views.since.chunks_mut(TOGETHER)) {
            let new = &self.new.pixel[first..][..nodes.len()];
            let asked = asked(new, nodes);
            for pair in self.pairs {
                let judge = Judge::new(pair, self.y, self.pairs.len());
                if !judge.matters(asked) {
                    continue;
                }
                seen.place(self.lens, pair, first, nodes);
                seen.read(pair, nodes);
                tally.add(&match self.y % SAMPLED {
                    0 => judge.correct::<true>(&seen, new, nodes, trust),
                    _ => judge.correct::<false>(&seen, new, nodes, trust),
                });
                if !pair.lattice.wraps {
                    seen.date(pair, since);
                }
            }
            first += nodes.len();
        }
        tally
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to
mod tests {
    use super::*;
    use crate::filter::doubt::Doubt;
    use crate::filter::lattice::Lattice;
    use crate::filter::prepare::Preparation;
    use crate::filter::state::Drift;
    use crate::filter::step::Step;
    use nalgebra::{Matrix3, Vector3};
    use sphereflow_core::Plane;
    use sphereflow_sphere::Camera;

    const WIDTH: usize = 80;
    const HEIGHT: usize = 60;
    const FOCAL_PX: f64 = 75.0;
    /// The painted wall stands this far before both cameras, metres.
    const WALL_M: f64 = 2.0;
    const STEP_M: f64 = 0.08;
    /// Brightness that no other of the paint has.
    const STRANGE: f32 = 60.0;

    /// What a camera at (x, 0, 0) sees of the wall, made brighter.
    fn view(lattice: &Lattice, x_m: f64, brighter: f32) -> Prepared {
        let image = Plane::from_fn(WIDTH, HEIGHT, |x, y| {
            let ray = lattice.ray[y * WIDTH + x].cast::<f64>();
            let (x, y) = (ray.x / ray.z * WALL_M + x_m, ray.y / ray.z * WALL_M);
            brighter + (128.0 + 40.0 * (9.0 * x + 3.0 * y).sin()) as f32
        });
        let mut preparation = Preparation::new(WIDTH, HEIGHT, 1);
        preparation.prepare(&image, lattice, Some(1.0), Prepared::empty())
    }

    /// Information that pairs give in all, one for each of the past images, which are brighter by so much.
    fn information(brighter: &[f32], drift: Drift, repeats: f32) -> f32 {
        information_told(brighter, drift, repeats, 1.0)
    }

    /// The same where rows tell this share of their ranges.
    fn information_told(brighter: &[f32], drift: Drift, repeats: f32, told: f32) -> f32 {
        let camera = Camera::pinhole(FOCAL_PX, FOCAL_PX, 39.5, 29.5, WIDTH, HEIGHT).unwrap();
        let lattice = Lattice::new(&camera).unwrap();
        let new = view(&lattice, STEP_M, 0.0);
        let past: Vec<Prepared> = brighter
            .iter()
            .map(|brighter| view(&lattice, 0.0, *brighter))
            .collect();
        let pair = |(index, past)| Pair {
            lattice: &lattice,
            step: Step {
                rotation: Matrix3::identity(),
                translation: Vector3::new(STEP_M as f32, 0.0, 0.0),
            },
            new: &new,
            past,
            surface: &[],
            gain: vec![1.0; HEIGHT],
            told: vec![told; HEIGHT],
            drift,
            lag: index + 1,
            repeats,
        };
        let pairs: Vec<Pair<'_>> = past.iter().enumerate().map(pair).collect();
        let pixels = WIDTH * HEIGHT;
        let (mut nodes, mut trust) = (vec![[0.5, 0.0, 1.0, 1e-6]; pixels], vec![1.0; pixels]);
        let mut doubt = Doubt::new(pixels);
        lattice.lens.with(Update {
            pairs: &pairs,
            nodes: &mut nodes,
            trust: &mut trust,
            views: doubt.views(),
        });
        nodes.iter().map(|node| node[2] - 1.0).sum()
    }

    #[test]
    fn pairs_that_share_the_error_of_a_pose_say_no_more_than_one_of_them() {
        let none = Drift::default();
        let [one, six] = [1, 6].map(|count| information(&vec![0.0; count], none, 1.0));
        assert!((six / one - 6.0).abs() < 0.01, "{one}, {six}");
        // Paint moves by more than a pixel: that rules out noise as what limits.
        let turned = Drift {
            rotation: 1e-3,
            translation: 0.0,
        };
        let [one, six] = [1, 6].map(|count| information(&vec![0.0; count], turned, 1.0));
        assert!(six > 0.99 * one && six < 1.1 * one, "{one}, {six}");
    }

    #[test]
    fn noise_that_is_met_again_counts_as_often() {
        let none = Drift::default();
        let [once, often] = [1.0, 5.0].map(|repeats| information(&[0.0], none, repeats));
        // Both images have the same noise, and some is left for reading between pixels.
        let least = (1.0 + 1.0) / (1.0 + 5.0);
        let share = often / once;
        assert!(share > least && share < 1.5 * least, "{once}, {often}");
    }

    #[test]
    fn a_pair_counts_for_as_much_as_its_rows_tell_of_their_ranges() {
        let told = |told: f32| information_told(&[0.0], Drift::default(), 1.0, told);
        let share = told(0.3) / told(1.0);
        assert!((share - 0.3).abs() < 1e-3, "{share}");
        assert_eq!(told(0.0), 0.0);
    }

    #[test]
    fn a_pair_counts_for_less_where_a_shorter_one_did_not_fit() {
        let none = Drift::default();
        let alone = information(&[0.0], none, 1.0);
        let fitting_first = information(&[0.0, STRANGE], none, 1.0);
        let strange_first = information(&[STRANGE, 0.0], none, 1.0);
        assert!(fitting_first > alone, "{fitting_first}, {alone}");
        assert!(strange_first < 0.5 * alone, "{strange_first}, {alone}");
    }
}
