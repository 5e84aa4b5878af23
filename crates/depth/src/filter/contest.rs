//! At depth edges, a pixel belongs to the surface whose depth explains the images better.

use super::lattice::{LensCall, read};
use super::lens::Lens;
use super::pair::Pair;
use super::state::{Node, fresh};
use super::surfaces::{EDGE, HIDES};
use rayon::prelude::*;

/// Asks pixels beside a depth edge whether the other surface suits them better.
pub(super) struct Contest<'a, 'b> {
    pub pairs: &'a [Pair<'b>],
    pub nodes: &'a mut [Node],
}

/// Distances in pixels at which the other surface is looked for: beside an edge, and across a slope that
/// has grown where something came out from behind something.
const NEAR: usize = 2;
const REACH: usize = 6;

/// Images of fewer columns than this many times the reach have a smaller one.
const COLUMNS_PER_REACH: usize = 32;

/// Relative deviation up to which the other surface may offer itself: what hardly anything is
/// known of spreads otherwise.
const CREDIBLE: f32 = 0.1;

/// The other surface must explain the images this much better, and the pixel's own must do so poorly: a perfect
/// one has a cost of 1.
const BETTER: f32 = 0.7;
const POOR: f32 = 1.3;

/// An image that both surfaces explain worse than this does not show the pixel.
const NEITHER: f32 = 2.0;

/// Squared residuals in units of the noise count up to here.
const MOST: f32 = 6.0;

impl LensCall<()> for Contest<'_, '_> {
    fn call<L: Lens>(self, lens: &L) {
        let Self { pairs, nodes } = self;
        let Some(first) = pairs.first() else {
            return;
        };
        let (width, height) = (first.lattice.width, first.lattice.height);
        let reach = (width / COLUMNS_PER_REACH).clamp(NEAR + 1, REACH);
        let view = &*nodes;
        let zeta: Vec<f32> = view.iter().map(|node| node[0]).collect();
        let arch = pulp::Arch::new();
        let changes: Vec<Vec<(usize, Node)>> = (1..height.saturating_sub(1))
            .into_par_iter()
            .map(|y| {
                let inner = y >= reach && y + reach < height && width > 2 * reach;
                let beside = match inner {
                    true => arch.dispatch(EdgesOfRow {
                        zeta: &zeta,
                        width,
                        y,
                        reach,
                    }),
                    false => Vec::new(),
                };
                let ask = |x: usize| {
                    let here = y * width + x;
                    let other = other_surface(view, (width, height), (x, y), reach)?;
                    let (own, alternative) =
                        costs(lens, pairs, here, (view[here][0], other), width)?;
                    // A pixel that nothing tells apart stays as it is.
                    let better = alternative < BETTER * own && own > POOR;
                    better.then(|| (here, fresh(other, false)))
                };
                // Near the border every pixel is asked.
                let asked = |x: &usize| match x.checked_sub(reach).and_then(|x| beside.get(x)) {
                    Some(beside) => *beside,
                    None => true,
                };
                (1..width - 1).filter(asked).filter_map(ask).collect()
            })
            .collect();
        for (place, node) in changes.into_iter().flatten() {
            nodes[place] = node;
        }
    }
}

/// Which pixels of a row, from the `reach`-th on, may lie beside another surface: compiled for wide
/// vectors, as few do.
struct EdgesOfRow<'a> {
    zeta: &'a [f32],
    width: usize,
    y: usize,
    reach: usize,
}

impl pulp::WithSimd for EdgesOfRow<'_> {
    type Output = Vec<bool>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Vec<bool> {
        let (width, reach) = (self.width, self.reach);
        let first = self.y * width + reach;
        let count = width.saturating_sub(2 * reach);
        let row = |start: usize| &self.zeta[start..][..count];
        let across = [NEAR, reach, NEAR * width, reach * width];
        let sides = across.map(|r| [row(first - r), row(first + r)]);
        let own = row(first);
        let mut beside = vec![false; count];
        for (i, beside) in beside[..count].iter_mut().enumerate() {
            let mut most = 0.0_f32;
            for [before, after] in &sides {
                let bend = (before[i] + after[i] - 2.0 * own[i]).abs();
                most = if bend > most { bend } else { most };
            }
            *beside = most > EDGE * own[i];
        }
        beside
    }
}

/// The zeta around a pixel that differs most from its own, where that is another surface.
#[inline]
fn other_surface(
    nodes: &[Node],
    (width, height): (usize, usize),
    (x, y): (usize, usize),
    reach: usize,
) -> Option<f32> {
    let own = nodes[y * width + x][0];
    let at = |x: usize, y: usize| &nodes[y * width + x];
    let mut other = own;
    for r in [NEAR, reach] {
        let (left, right) = (x.saturating_sub(r), (x + r).min(width - 1));
        let (up, down) = (y.saturating_sub(r), (y + r).min(height - 1));
        for [before, after] in [[at(left, y), at(right, y)], [at(x, up), at(x, down)]] {
            // A slope is no edge.
            if (before[0] + after[0] - 2.0 * own).abs() > EDGE * own {
                for [zeta, _, _, variance] in [before, after] {
                    let credible = *variance < (CREDIBLE * zeta).powi(2);
                    let farther = (zeta - own).abs() > (other - own).abs();
                    other = if credible && farther { *zeta } else { other };
                }
            }
        }
    }
    let differs = (other - own).abs() > EDGE * own.max(other);
    (differs && other > 0.0).then_some(other)
}

/// Mean squared residuals, in units of the noise, over the pixel and its four neighbours in all pairs: with its own
/// zeta, and with another. Where its own would have been hidden the past image does not say; `None` where
/// none does, or its own explains the images well, as most do.
fn costs<L: Lens>(
    lens: &L,
    pairs: &[Pair<'_>],
    here: usize,
    (own, other): (f32, f32),
    width: usize,
) -> Option<(f32, f32)> {
    let places = [here, here - 1, here + 1, here - width, here + width];
    let samples = || {
        let all = pairs.iter().map(|pair| (pair, pair.gain[here / width]));
        all.flat_map(|(pair, gain)| places.map(|place| (pair, gain, place)))
    };
    let own_of = |(pair, gain, place)| squared(lens, pair, gain, place, (own, true));
    let (mut sum, mut count) = (0.0_f32, 0.0_f32);
    for cost in samples().filter_map(own_of) {
        (sum, count) = (sum + cost, count + 1.0);
    }
    if sum <= POOR * count {
        return None;
    }
    let (mut sums, mut count) = ([0.0_f32; 2], 0.0_f32);
    for pair in pairs {
        let gain = pair.gain[here / width];
        let (mut of_pair, mut compared) = ([0.0_f32; 2], 0.0_f32);
        for place in places {
            let of_other = squared(lens, pair, gain, place, (other, false));
            if let (Some(a), Some(b)) = (own_of((pair, gain, place)), of_other) {
                of_pair = [of_pair[0] + a, of_pair[1] + b];
                compared += 1.0;
            }
        }
        // Where neither surface explains the image, the pixel was hidden in it.
        if of_pair[0].min(of_pair[1]) <= NEITHER * compared {
            sums = [sums[0] + of_pair[0], sums[1] + of_pair[1]];
            count += compared;
        }
    }
    (count > 0.0).then(|| (sums[0] / count, sums[1] / count))
}

/// Squared residual of a place, in units of the noise, if it had this zeta; `None` where the past image does not
/// show it, or, for a surface that may be hidden, where it was.
#[inline]
fn squared<L: Lens>(
    lens: &L,
    pair: &Pair<'_>,
    gain: f32,
    place: usize,
    (zeta, may_hide): (f32, bool),
) -> Option<f32> {
    let noise = pair.new.sigma.powi(2) + (gain * pair.past.sigma).powi(2);
    let there = pair.step.rotation * pair.lattice.ray[place] + pair.step.translation * zeta;
    let (four, s, t) = pair.lattice.around(lens.project(&there))?;
    let nearest = four[usize::from(s > 0.5) + 2 * usize::from(t > 0.5)];
    let surface = pair.surface.get(nearest).copied().unwrap_or(0.0);
    if may_hide && surface * lens.gauge(&there) > HIDES * zeta {
        return None;
    }
    let [value, _, _, variance] = read(&pair.past.pixel, four, s, t);
    let residual = gain * value - pair.new.pixel[place][0];
    let cost = residual * residual / (noise + gain * gain * variance);
    cost.is_finite().then_some(cost.min(MOST))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to
mod tests {
    use super::*;
    use crate::filter::lattice::Lattice;
    use crate::filter::prepare::{Preparation, Prepared};
    use crate::filter::state::Drift;
    use crate::filter::step::Step;
    use nalgebra::{Matrix3, Vector3};
    use sphereflow_core::Plane;
    use sphereflow_sphere::Camera;

    const WIDTH: usize = 160;
    const HEIGHT: usize = 120;
    /// A wall that ends in the middle of the image, before another, metres.
    const NEAR_M: f64 = 1.0;
    const FAR_M: f64 = 2.0;
    /// The first column behind the edge.
    const EDGE_COLUMN: usize = 80;
    /// Columns beside the edge that are taken for the near wall; smoothing blurs the edge itself.
    const WRONG: std::ops::Range<usize> = EDGE_COLUMN + 2..EDGE_COLUMN + 6;
    /// At the edge itself, which smoothing blurs, half a pixel of each row may change.
    const BLURRED: usize = HEIGHT / 2;
    /// Where the new camera is in the past one: what is left of the edge hides nothing more of the far wall.
    const PLACE: Vector3<f64> = Vector3::new(-0.06, 0.02, 0.0);

    fn zeta(x: usize) -> f32 {
        let metres = if x < EDGE_COLUMN { NEAR_M } else { FAR_M };
        (1.0 / metres) as f32
    }

    /// What a camera sees that is at `place` in the new one.
    fn view(lattice: &Lattice, place: &Vector3<f64>, contrast: f64) -> Plane<f32> {
        let edge_x = f64::from(lattice.ray[EDGE_COLUMN].x + lattice.ray[EDGE_COLUMN - 1].x) / 2.0;
        let paint = |point: &Vector3<f64>| {
            let (x, y) = (point.x, point.y);
            let waves = (23.0 * x + 9.0 * y).sin() + (17.0 * y - 8.0 * x).sin();
            (128.0 + contrast * waves) as f32
        };
        Plane::from_fn(WIDTH, HEIGHT, |x, y| {
            let ray = lattice.ray[y * WIDTH + x].cast::<f64>();
            let near = ray * NEAR_M + place;
            if near.x < edge_x * NEAR_M {
                paint(&near)
            } else {
                paint(&(ray * FAR_M + place))
            }
        })
    }

    /// Columns' pixels that changed to within a tenth of the far wall, and all that changed.
    fn changed(wrong: std::ops::Range<usize>, contrast: f64) -> (usize, usize) {
        let camera = Camera::pinhole(150.0, 150.0, 79.5, 59.5, WIDTH, HEIGHT).unwrap();
        let lattice = Lattice::new(&camera).unwrap();
        let mut preparation = Preparation::new(WIDTH, HEIGHT, 1);
        let mut prepare =
            |image| preparation.prepare(image, &lattice, Some(1.0), Prepared::empty());
        let (new, past) = (
            view(&lattice, &Vector3::zeros(), contrast),
            view(&lattice, &-PLACE, contrast),
        );
        let (new, past) = (prepare(&new), prepare(&past));
        let pair = Pair {
            lattice: &lattice,
            step: Step {
                rotation: Matrix3::identity(),
                translation: PLACE.cast(),
            },
            new: &new,
            past: &past,
            surface: &[],
            gain: vec![1.0; HEIGHT],
            told: vec![1.0; HEIGHT],
            drift: Drift::default(),
            lag: 1,
            repeats: 1.0,
        };
        let column = |i: usize| i % WIDTH;
        let told = |x: usize| if wrong.contains(&x) { zeta(0) } else { zeta(x) };
        let before: Vec<Node> = (0..WIDTH * HEIGHT)
            .map(|i| [told(column(i)), 0.0, 1e4, 1e-4])
            .collect();
        let mut nodes = before.clone();
        lattice.lens.with(Contest {
            pairs: &[pair],
            nodes: &mut nodes,
        });
        let far = zeta(WIDTH);
        let moved = |i: &usize| nodes[*i][0] != before[*i][0];
        let right =
            |i: &usize| wrong.contains(&column(*i)) && (nodes[*i][0] / far - 1.0).abs() < 0.1;
        let all = (0..nodes.len()).filter(moved);
        (all.clone().filter(right).count(), all.count())
    }

    #[test]
    fn contest_of_pixels_on_the_wrong_side_gives_them_to_the_surface_that_explains_them() {
        let asked = WRONG.len() * HEIGHT;
        let (right, all) = changed(WRONG, 50.0);
        assert!(right * 10 > 9 * asked, "{right} of {asked}");
        assert!(all < right + BLURRED, "{right} of {all}");
    }

    #[test]
    fn contest_of_a_true_state_changes_next_to_nothing() {
        let (_, all) = changed(0..0, 50.0);
        assert!(all < BLURRED, "{all}");
    }

    #[test]
    fn a_surface_offers_itself_where_it_is_known_and_not_where_it_is_a_guess() {
        let offered = |variance: f32| {
            let mut nodes = vec![[0.5, 0.0, 1e4, 1e-6]; 20 * 20];
            nodes[10 * 20 + 12] = [0.2, 0.0, 0.1, variance];
            other_surface(&nodes, (20, 20), (10, 10), REACH)
        };
        let most = (CREDIBLE * 0.2).powi(2);
        assert_eq!(offered(0.9 * most), Some(0.2));
        assert_eq!(offered(1.1 * most), None);
    }

    #[test]
    fn contest_of_what_nothing_tells_apart_changes_nothing() {
        assert_eq!(changed(WRONG, 0.0), (0, 0));
    }
}
