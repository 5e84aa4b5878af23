//! At depth edges, a pixel belongs to the surface whose depth explains the images better.

use super::lattice::{LensCall, read};
use super::lens::Lens;
use super::predict::fresh;
use super::state::Node;
use super::update::Pair;
use rayon::prelude::*;

/// Asks pixels beside a depth edge whether the other surface suits them better.
pub(super) struct Contest<'a, 'b> {
    pub pairs: &'a [Pair<'b>],
    pub nodes: &'a mut [Node],
}

/// Neighbours whose zeta differs by more than this share are another surface.
const EDGE: f32 = 0.12;

/// Distances in pixels at which the other surface is looked for: beside an edge, and across a slope that
/// has grown where something came out from behind something.
const NEAR: usize = 2;
const REACH: usize = 10;

/// Information of a pixel that has changed sides, against that of one seen for the first time.
const CHOSEN: f32 = 4.0;

/// The other surface must explain the images this much better.
const BETTER: f32 = 0.6;

/// Squared residuals in units of the noise count up to here.
const MOST: f32 = 16.0;

impl LensCall<()> for Contest<'_, '_> {
    fn call<L: Lens>(self, lens: &L) {
        let Self { pairs, nodes } = self;
        let Some(first) = pairs.first() else {
            return;
        };
        let (width, height) = (first.lattice.width, first.lattice.height);
        let view = &*nodes;
        let zeta: Vec<f32> = view.iter().map(|node| node[0]).collect();
        let arch = pulp::Arch::new();
        let changes: Vec<Vec<(usize, Node)>> = (REACH..height.saturating_sub(REACH))
            .into_par_iter()
            .map(|y| {
                let beside = arch.dispatch(EdgesOfRow {
                    zeta: &zeta,
                    width,
                    y,
                });
                let ask = |x: usize| {
                    let here = y * width + x;
                    let other = other_surface(view, width, here)?;
                    let own = cost(lens, pairs, here, view[here][0], width);
                    let alternative = cost(lens, pairs, here, other, width);
                    // A pixel that nothing tells apart stays as it is.
                    let better = alternative < BETTER * own && own > 1.5;
                    better.then(|| {
                        let mut node = fresh(other, false);
                        node[2] *= CHOSEN;
                        (here, node)
                    })
                };
                let columns = beside.iter().enumerate().filter(|(_, beside)| **beside);
                columns.filter_map(|(i, _)| ask(REACH + i)).collect()
            })
            .collect();
        for (place, node) in changes.into_iter().flatten() {
            nodes[place] = node;
        }
    }
}

/// Which pixels of a row, from the `REACH`-th on, may lie beside another surface: compiled for wide
/// vectors, as few do.
struct EdgesOfRow<'a> {
    zeta: &'a [f32],
    width: usize,
    y: usize,
}

impl pulp::WithSimd for EdgesOfRow<'_> {
    type Output = Vec<bool>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Vec<bool> {
        let (width, first) = (self.width, self.y * self.width + REACH);
        let count = width.saturating_sub(2 * REACH);
        let row = |start: usize| &self.zeta[start..][..count];
        let around = |r: usize| [first - r, first + r, first - r * width, first + r * width];
        let near = around(NEAR).map(row);
        let far = around(REACH).map(row);
        let own = row(first);
        let mut beside = vec![false; count];
        for (i, beside) in beside[..count].iter_mut().enumerate() {
            let mut most = 0.0_f32;
            for other in near.iter().chain(&far) {
                let off = (other[i] - own[i]).abs();
                most = if off > most { off } else { most };
            }
            *beside = most > EDGE * own[i];
        }
        beside
    }
}

/// The zeta around a pixel that differs most from its own, where that is another surface.
#[inline]
fn other_surface(nodes: &[Node], width: usize, here: usize) -> Option<f32> {
    let own = nodes[here][0];
    let around = |r: usize| [here - r, here + r, here - r * width, here + r * width];
    let places = around(NEAR).into_iter().chain(around(REACH));
    let mut other = own;
    for place in places {
        let zeta = nodes[place][0];
        if (zeta - own).abs() > (other - own).abs() {
            other = zeta;
        }
    }
    let differs = (other - own).abs() > EDGE * own.max(other);
    (differs && other > 0.0).then_some(other)
}

/// Mean squared residual over the pixel and its four neighbours in all pairs, in units of the noise.
fn cost<L: Lens>(lens: &L, pairs: &[Pair<'_>], here: usize, zeta: f32, width: usize) -> f32 {
    let (mut sum, mut count) = (0.0_f32, 0.0_f32);
    for pair in pairs {
        let gain = pair.gain[here / width];
        let noise = pair.new.sigma.powi(2) + (gain * pair.past.sigma).powi(2);
        for place in [here, here - 1, here + 1, here - width, here + width] {
            let there = pair.step.rotation * pair.lattice.ray[place] + pair.step.translation * zeta;
            let Some((four, s, t)) = pair.lattice.around(lens.project(&there)) else {
                continue;
            };
            let residual = gain * read(&pair.past.pixel, four, s, t)[0] - pair.new.pixel[place][0];
            if residual.is_finite() {
                sum += (residual * residual / noise).min(MOST);
                count += 1.0;
            }
        }
    }
    sum / count.max(1.0)
}
