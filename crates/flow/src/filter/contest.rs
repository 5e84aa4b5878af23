//! At depth edges, a pixel belongs to the surface whose depth explains the images better.

use super::lattice::{LensCall, read};
use super::lens::Lens;
use super::predict::fresh;
use super::state::Node;
use super::update::{HIDES, Pair};
use rayon::prelude::*;

/// Asks pixels beside a depth edge whether the other surface suits them better.
pub(super) struct Contest<'a, 'b> {
    pub pairs: &'a [Pair<'b>],
    pub nodes: &'a mut [Node],
}

/// Neighbours whose zeta differs by more than this share are another surface.
const EDGE: f32 = 0.06;

/// Distances in pixels at which the other surface is looked for: beside an edge, and across a slope that
/// has grown where something came out from behind something.
const NEAR: usize = 2;
const REACH: usize = 10;

/// Images of fewer columns than this many times the reach have a smaller one.
const COLUMNS_PER_REACH: usize = 32;

/// Information of a pixel that has changed sides, against that of one seen for the first time.
const CHOSEN: f32 = 4.0;

/// The other surface must explain the images this much better, and the pixel's own must do so poorly: a perfect
/// one has a cost of 1.
const BETTER: f32 = 0.7;
const POOR: f32 = 1.3;

/// Squared residuals in units of the noise count up to here.
const MOST: f32 = 16.0;

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
                    better.then(|| {
                        let mut node = fresh(other, false);
                        node[2] *= CHOSEN;
                        (here, node)
                    })
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
    let at = |x: usize, y: usize| nodes[y * width + x][0];
    let mut other = own;
    for r in [NEAR, reach] {
        let (left, right) = (x.saturating_sub(r), (x + r).min(width - 1));
        let (up, down) = (y.saturating_sub(r), (y + r).min(height - 1));
        for [before, after] in [[at(left, y), at(right, y)], [at(x, up), at(x, down)]] {
            // A slope is no edge.
            if (before + after - 2.0 * own).abs() > EDGE * own {
                for zeta in [before, after] {
                    let farther = (zeta - own).abs() > (other - own).abs();
                    other = if farther { zeta } else { other };
                }
            }
        }
    }
    let differs = (other - own).abs() > EDGE * own.max(other);
    (differs && other > 0.0).then_some(other)
}

/// Mean squared residuals, in units of the noise, over the pixel and its four neighbours in all pairs: with its own
/// zeta, and with another. Where its own would have been hidden the past image does not say; `None` where
/// none does.
fn costs<L: Lens>(
    lens: &L,
    pairs: &[Pair<'_>],
    here: usize,
    (own, other): (f32, f32),
    width: usize,
) -> Option<(f32, f32)> {
    let (mut sums, mut count) = ([0.0_f32; 2], 0.0_f32);
    for pair in pairs {
        let gain = pair.gain[here / width];
        let noise = pair.new.sigma.powi(2) + (gain * pair.past.sigma).powi(2);
        for place in [here, here - 1, here + 1, here - width, here + width] {
            let squared = |zeta: f32, may_hide: bool| {
                let ray = &pair.lattice.ray[place];
                let there = pair.step.rotation * ray + pair.step.translation * zeta;
                let (four, s, t) = pair.lattice.around(lens.project(&there))?;
                let nearest = four[usize::from(s > 0.5) + 2 * usize::from(t > 0.5)];
                let surface = pair.surface.get(nearest).copied().unwrap_or(0.0);
                if may_hide && surface * lens.gauge(&there) > HIDES * zeta {
                    return None;
                }
                let [value, _, _, variance] = read(&pair.past.pixel, four, s, t);
                let residual = gain * value - pair.new.pixel[place][0];
                let expected = noise + gain * gain * variance;
                let cost = residual * residual / expected;
                cost.is_finite().then_some(cost.min(MOST))
            };
            if let (Some(a), Some(b)) = (squared(own, true), squared(other, false)) {
                sums = [sums[0] + a, sums[1] + b];
                count += 1.0;
            }
        }
    }
    (count > 0.0).then(|| (sums[0] / count, sums[1] / count))
}
