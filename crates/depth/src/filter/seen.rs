//! Pixels of the new image as a past one shows them.

use super::lattice::{Around, TOGETHER, read};
use super::lens::Lens;
use super::pair::Pair;
use super::state::Node;
use super::surfaces::HIDES;

/// Pixels of a row in the past image: places, their derivative by zeta, and what is there.
pub(super) struct Seen {
    pub place: [[f32; TOGETHER]; 2],
    pub along: [[f32; TOGETHER]; 2],
    gauge: [f32; TOGETHER],
    around: Around<TOGETHER>,
    /// Brightness, slopes and variance of reading in the past image; NaN where it does not show the pixel.
    pub past: [[f32; 4]; TOGETHER],
}

impl Seen {
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            place: [[0.0; TOGETHER]; 2],
            along: [[0.0; TOGETHER]; 2],
            gauge: [0.0; TOGETHER],
            around: Around::new(),
            past: [[f32::NAN; 4]; TOGETHER],
        }
    }

    #[inline(always)]
    pub fn place<L: Lens>(&mut self, lens: &L, pair: &Pair<'_>, first: usize, nodes: &[Node]) {
        let (turn, step) = (&pair.step.rotation, &pair.step.translation);
        let rays = &pair.lattice.ray[first..first + nodes.len()];
        for (i, (node, ray)) in nodes.iter().zip(rays).enumerate() {
            let there = turn * ray + step * node[0];
            let (place, along) = lens.project_along(&there, step);
            (self.place[0][i], self.place[1][i]) = (place[0], place[1]);
            (self.along[0][i], self.along[1][i]) = (along[0], along[1]);
            self.gauge[i] = lens.gauge(&there);
        }
    }

    #[inline(always)]
    pub fn read(&mut self, pair: &Pair<'_>, nodes: &[Node]) {
        let width = pair.lattice.width;
        pair.lattice.around_each(&self.place, &mut self.around);
        if !pair.surface.is_empty() {
            for (i, node) in nodes.iter().enumerate() {
                let nearest = pair.surface[self.around.nearest[i] as usize];
                let hidden = nearest * self.gauge[i] > HIDES * node[0];
                self.around.across[i] = if hidden {
                    f32::NAN
                } else {
                    self.around.across[i]
                };
            }
        }
        for i in 0..nodes.len() {
            let (s, t) = (self.around.across[i], self.around.down[i]);
            self.past[i] = read(&pair.past.pixel, self.around.four(width, i), s, t);
        }
    }

    /// Notes the least lag at which pixels were out of view.
    #[inline(always)]
    pub fn date(&self, pair: &Pair<'_>, since: &mut [f32]) {
        let lag = pair.lag as f32;
        let lattice = pair.lattice;
        // What is carried is read between pixels.
        let margin = pair.past.margin + 1.0;
        let right = (lattice.width - 1) as f32 - margin;
        let bottom = (lattice.height - 1) as f32 - margin;
        let shown = |i: usize| {
            let (x, y) = (self.place[0][i], self.place[1][i]);
            (x >= margin) & (x <= right) & (y >= margin) & (y <= bottom)
        };
        // Most blocks are wholly inside.
        let all = (0..since.len()).fold(true, |all, i| all & shown(i));
        if all {
            return;
        }
        for (i, since) in since.iter_mut().enumerate() {
            let shown = shown(i) | (*since > 0.0);
            *since = if shown { *since } else { lag };
        }
    }
}
