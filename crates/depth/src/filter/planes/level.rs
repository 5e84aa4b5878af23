//! A level of the pyramid: cells with one surface or two, summed to coarser cells and fitted by finer ones.

use super::fit::Fit;
use super::moments::{Face, Moments};
use super::rivals::{Prior, best};
use crate::filter::surfaces::ONE_SURFACE;
use nalgebra::Vector3;
use rayon::prelude::*;

/// A surface in a cell.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    pub moments: Moments,
    pub fit: Fit,
    /// The cell it is in.
    cell: usize,
    /// The surface of the coarser level that it is part of.
    parent: usize,
    /// What is expected of its plane.
    prior: Prior,
}

/// All cells of a size.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub width: usize,
    pub height: usize,
    /// One of each cell, in order; then the second ones.
    pub surfaces: Vec<Surface>,
    /// The second surface of each cell; 0 for none.
    pub second: Vec<usize>,
}

/// Variance of the coarsest planes before anything is seen, 1/m^2.
const WIDE: f64 = 1.0;

/// Cells of a level that a plane may go on by.
const SWEEPS: usize = 4;

impl Surface {
    fn new(cell: usize, moments: Moments) -> Self {
        Self {
            moments,
            fit: Fit::UNKNOWN,
            cell,
            parent: 0,
            prior: Prior::UNKNOWN,
        }
    }

    /// Fits the plane to the moments and what is expected.
    fn refit(&mut self, prior: Prior, noise: f64) {
        self.prior = prior;
        let Prior { plane, spread } = prior;
        let unknown = Fit {
            plane,
            misfit: spread,
            variance: spread,
        };
        self.fit = Fit::new(&self.moments, &plane, spread, noise).unwrap_or(unknown);
    }
}

impl Level {
    pub fn new(width: usize, height: usize) -> Self {
        let surfaces = (0..width * height).map(|cell| Surface::new(cell, Moments::NOTHING));
        Self {
            width,
            height,
            surfaces: surfaces.collect(),
            second: vec![0; width * height],
        }
    }

    /// Sets the moments of each cell. The surface with more pixels is the first.
    pub fn collect(&mut self, of: impl Fn(usize) -> (Moments, Option<Moments>) + Sync) {
        let cells = self.width * self.height;
        self.surfaces.truncate(cells);
        let width = self.width;
        // Few cells have a second surface.
        let found: Vec<Vec<(usize, Moments)>> = self
            .surfaces
            .par_chunks_mut(width)
            .enumerate()
            .map(|(row, surfaces)| {
                let mut seconds = Vec::new();
                for (column, surface) in surfaces.iter_mut().enumerate() {
                    let cell = row * width + column;
                    let (moments, second) = of(cell);
                    surface.moments = moments;
                    seconds.extend(second.map(|second| (cell, second)));
                }
                seconds
            })
            .collect();
        self.second.fill(0);
        for (cell, second) in found.into_iter().flatten() {
            self.set_second(cell, second);
        }
    }

    /// Adds a cell's second surface, where there is one.
    fn set_second(&mut self, cell: usize, mut second: Moments) {
        if second.pixels == 0.0 {
            return;
        }
        let first = &mut self.surfaces[cell].moments;
        if second.pixels > first.pixels {
            std::mem::swap(first, &mut second);
        }
        if second.pixels > 0.0 {
            self.second[cell] = self.surfaces.len();
            self.surfaces.push(Surface::new(cell, second));
        }
    }

    /// Sums the surfaces of the finer cells.
    pub fn sum(&mut self, fine: &mut Self) {
        self.surfaces.truncate(self.width * self.height);
        self.second.fill(0);
        let mut kids = Vec::with_capacity(8);
        for cell in 0..self.width * self.height {
            kids.clear();
            let (x, y) = (2 * (cell % self.width), 2 * (cell / self.width));
            for row in y..(y + 2).min(fine.height) {
                for column in x..(x + 2).min(fine.width) {
                    let at = row * fine.width + column;
                    for surface in [Some(at), Some(fine.second[at]).filter(|i| *i > 0)] {
                        let there = surface.filter(|i| fine.surfaces[*i].moments.pixels > 0.0);
                        kids.extend(there.map(|i| (i, fine.surfaces[i].moments.face())));
                    }
                }
            }
            let groups = two_surfaces(&kids);
            let mut sums = [Moments::NOTHING; 2];
            for ((kid, _), group) in kids.iter().zip(groups) {
                sums[usize::from(group)].add(&fine.surfaces[*kid].moments);
            }
            let swapped = sums[1].pixels > sums[0].pixels;
            let [first, second] = sums;
            self.surfaces[cell].moments = first;
            self.set_second(cell, second);
            for ((kid, _), group) in kids.iter().zip(groups) {
                let is_first = group == swapped;
                fine.surfaces[*kid].parent = if is_first { cell } else { self.second[cell] };
            }
        }
    }

    /// Fits all planes, with those of the coarser cells around as prior; `rough` is what planes of neighbouring
    /// coarser cells differ by, 1/m^2.
    pub fn fit(&mut self, coarse: Option<&Self>, wraps: bool, rough: f64, noise: f64) {
        let width = self.width;
        self.surfaces.par_chunks_mut(width).for_each(|surfaces| {
            for surface in surfaces {
                let (plane, misfit) = match coarse {
                    Some(coarse) => coarse.read(surface, width, wraps, rough),
                    None => (surface.fit.plane, WIDE),
                };
                let spread = misfit + rough;
                surface.refit(Prior { plane, spread }, noise);
            }
        });
    }

    /// Lets planes go on from cell to cell, where the pixels there are explained better by them.
    pub fn propagate(&mut self, wraps: bool, rough: f64, noise: f64) {
        for _ in 0..SWEEPS {
            let better: Vec<(usize, Prior)> = self
                .surfaces
                .par_iter()
                .enumerate()
                .filter_map(|(i, surface)| {
                    let beside = self.beside(surface.cell, wraps);
                    let rivals = beside.map(|fit| Prior::of(fit, rough));
                    let prior = best(surface.prior, rivals, |prior| prior, &surface.moments);
                    (prior.plane != surface.prior.plane).then_some((i, prior))
                })
                .collect();
            if better.is_empty() {
                return;
            }
            for (i, prior) in better {
                self.surfaces[i].refit(prior, noise);
            }
        }
    }

    /// The planes of all surfaces in a cell.
    fn fits(&self, cell: usize) -> impl Iterator<Item = &Fit> {
        let second = Some(self.second[cell]).filter(|second| *second > 0);
        let both = std::iter::once(cell).chain(second);
        both.map(|surface| &self.surfaces[surface].fit)
    }

    /// The planes of all surfaces in the four cells beside one.
    fn beside(&self, cell: usize, wraps: bool) -> impl Iterator<Item = &Fit> {
        let (x, y) = (cell % self.width, cell / self.width);
        let (width, height) = (self.width, self.height);
        let left = (x > 0 || wraps).then(|| y * width + (x + width - 1) % width);
        let right = (x + 1 < width || wraps).then(|| y * width + (x + 1) % width);
        let above = (y > 0).then(|| cell - width);
        let below = (y + 1 < height).then(|| cell + width);
        let cells = [left, right, above, below].into_iter().flatten();
        cells.flat_map(|cell| self.fits(cell))
    }

    /// Plane and misfit between the middles of the four cells around a finer cell's middle, of the surface that it
    /// is part of.
    fn read(
        &self,
        finer: &Surface,
        finer_width: usize,
        wraps: bool,
        rough: f64,
    ) -> (Vector3<f64>, f64) {
        let near = |i: usize, size: usize, wraps: bool| {
            let own = (i / 2).min(size - 1);
            let other = match (i % 2, wraps) {
                (0, true) => (own + size - 1) % size,
                (0, false) => own.saturating_sub(1),
                (_, true) => (own + 1) % size,
                (_, false) => (own + 1).min(size - 1),
            };
            (own, other)
        };
        let (x, y) = (finer.cell % finer_width, finer.cell / finer_width);
        let ((x0, x1), (y0, y1)) = (near(x, self.width, wraps), near(y, self.height, false));
        let around = [(x1, y0, 0.1875), (x0, y1, 0.1875), (x1, y1, 0.0625)];
        let around = around.map(|(column, row, share)| (row * self.width + column, share));
        let known = finer.moments.pixels > 0.0;
        let own = match known {
            true => &self.surfaces[finer.parent].fit,
            false => &self.surfaces[y0 * self.width + x0].fit,
        };
        let rivals = around.iter().flat_map(|(cell, _)| self.fits(*cell));
        let own = best(own, rivals, |fit| Prior::of(fit, rough), &finer.moments);
        let (mut plane, mut misfit, mut total) = (own.plane * 0.5625, own.misfit * 0.5625, 0.5625);
        let ray = if known {
            finer.moments.ray()
        } else {
            Vector3::zeros()
        };
        let here = own.plane.dot(&ray);
        let gap = |fit: &Fit| (fit.plane.dot(&ray) - here).abs();
        for (cell, share) in around {
            let mut fit = &self.surfaces[cell].fit;
            if self.second[cell] > 0 {
                let second = &self.surfaces[self.second[cell]].fit;
                fit = if gap(second) < gap(fit) { second } else { fit };
            }
            let doubt = 4.0 * (own.variance + fit.variance);
            if gap(fit) <= (ONE_SURFACE * here).max(doubt.sqrt()) {
                plane += fit.plane * share;
                misfit += fit.misfit * share;
                total += share;
            }
        }
        (plane / total, misfit / total)
    }
}

/// Which of a coarser cell's surfaces are of its second one: where two lie apart, each goes with the closer of
/// the two that lie farthest apart.
fn two_surfaces(kids: &[(usize, Face)]) -> [bool; 8] {
    let mut groups = [false; 8];
    let (mut most, mut ends) = (1.0, None);
    for (i, (_, a)) in kids.iter().enumerate() {
        for (_, b) in &kids[i + 1..] {
            let apart = a.apart(b);
            if apart > most {
                (most, ends) = (apart, Some((a, b)));
            }
        }
    }
    if let Some((a, b)) = ends {
        for ((_, face), group) in kids.iter().zip(&mut groups) {
            *group = face.apart(b) < face.apart(a);
        }
    }
    groups
}

#[cfg(test)]
#[allow(clippy::float_cmp)] // cells' numbers come back as they were
mod tests {
    use super::*;

    #[test]
    fn beside_a_cell_are_both_surfaces_of_the_four_around_it_and_across_the_seam() {
        let mut level = Level::new(4, 3);
        let second = level.surfaces.len();
        level.surfaces.push(Surface::new(5, Moments::NOTHING));
        level.second[5] = second;
        for (i, surface) in level.surfaces.iter_mut().enumerate() {
            surface.fit.misfit = i as f64;
        }
        let beside = |cell, wraps| {
            let mut found: Vec<f64> = level.beside(cell, wraps).map(|fit| fit.misfit).collect();
            found.sort_by(f64::total_cmp);
            found
        };
        assert_eq!(beside(0, false), [1.0, 4.0]);
        assert_eq!(beside(0, true), [1.0, 3.0, 4.0]);
        assert_eq!(beside(11, true), [7.0, 8.0, 10.0]);
        assert_eq!(beside(6, false), [2.0, 5.0, 7.0, 10.0, 12.0]);
    }
}
