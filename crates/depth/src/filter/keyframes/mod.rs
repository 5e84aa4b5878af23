//! Surfaces that left the view or were hidden, remembered until they are seen again.
//!
//! What the state knew of ranges is kept for some poses of the past. A pixel that comes into view is looked up
//! in the keyframes in which it should be, and begins with what one of them saw there.

mod recall;
#[cfg(test)]
mod tests;
mod tiles;

use super::lattice::{Lattice, LensCall};
use super::lens::Lens;
use super::splat::seen_again;
use super::state::{Drift, Node};
use super::step::{Step, relative};
use recall::Recall;
use sphereflow_core::Pose;

/// Keyframes that are looked into in a step.
const ASKED: usize = 2;

/// A keyframe is added where the image has moved by this share of its width against all there are.
const APART: f32 = 0.06;

/// One that is closer is replaced after so many frames.
const RENEWED: usize = 24;

/// Of the new pixels each so many'th tells which keyframes saw them.
const EVERY: usize = 8;

/// So many of these are worth to look a keyframe through.
const WORTH: usize = 4;

/// Pixels to a side of the grid whose motion says how far keyframes are apart.
const GRID: usize = 3;

/// Uncertainty of places in a keyframe, pixels, beyond which it is not asked.
const LARGEST_DOUBT_PX: f32 = 2.0;

/// Zeta and its variance.
type Known = [f32; 2];

/// What was known at a pose.
#[derive(Clone, Debug)]
struct Keyframe {
    known: Vec<Known>,
    at: Present,
    frame: usize,
}

/// Pose of a frame and its uncertainty.
#[derive(Clone, Copy, Debug)]
pub(super) struct Present {
    pub world_from_camera: Pose,
    pub drift: Drift,
    pub noise: Drift,
}

/// The keyframes, and scratch to look into them.
#[derive(Clone, Debug)]
pub(super) struct Keyframes {
    most: usize,
    kept: Vec<Keyframe>,
    /// Frames so far.
    frame: usize,
    /// Pixels that come into view.
    new: Vec<u32>,
    nearest: Vec<f32>,
}

impl Keyframes {
    /// None are kept where `most` is zero. Beyond it the oldest gives way.
    pub fn new(most: usize) -> Self {
        Self {
            most,
            kept: Vec::new(),
            frame: 0,
            new: Vec::new(),
            nearest: Vec::new(),
        }
    }

    /// Keeps a state that is measured, if no keyframe of late is close.
    pub fn keep(&mut self, lattice: &Lattice, nodes: &[Node], present: &Present) {
        if self.most == 0 {
            return;
        }
        let mut closest = (APART * lattice.width as f32, None);
        for (i, kept) in self.kept.iter().enumerate() {
            let moved = lattice.lens.with(Moved {
                lattice,
                nodes,
                step: relative(&present.world_from_camera, &kept.at.world_from_camera),
            });
            if moved < closest.0 {
                closest = (moved, Some(i));
            }
        }
        let place = match closest.1 {
            Some(i) if self.frame - self.kept[i].frame < RENEWED => return,
            Some(i) => i,
            None if self.kept.len() < self.most => self.kept.len(),
            None => self.oldest(),
        };
        let buffer = self.kept.get_mut(place).map(|kept| &mut kept.known);
        let mut known = buffer.map(std::mem::take).unwrap_or_default();
        known.clear();
        known.extend(nodes.iter().map(|node| [node[0], node[3]]));
        let keyframe = Keyframe {
            known,
            at: *present,
            frame: self.frame,
        };
        match self.kept.get_mut(place) {
            Some(kept) => *kept = keyframe,
            None => self.kept.push(keyframe),
        }
    }

    fn oldest(&self) -> usize {
        let ages = 0..self.kept.len();
        ages.min_by_key(|i| self.kept[*i].frame).unwrap_or(0)
    }

    /// Sets the nodes of pixels that come into view to what keyframes saw there. `nearest` is what moved to each
    /// pixel from the frame before, `memory` the share of information that survives a frame.
    pub fn recall(
        &mut self,
        lattice: &Lattice,
        (nodes, nearest): (&mut [Node], &[f32]),
        present: &Present,
        memory: f32,
    ) {
        self.frame += 1;
        if self.kept.is_empty() {
            return;
        }
        self.new.clear();
        let width = lattice.width;
        for (y, row) in nearest.chunks_exact(width).enumerate() {
            for (x, zeta) in row.iter().enumerate() {
                if *zeta <= 0.0 && seen_again(lattice, nearest, (x, y)) == 0.0 {
                    self.new.push((y * width + x) as u32);
                }
            }
        }
        self.nearest.resize(nodes.len(), 0.0);
        for _ in 0..ASKED {
            let Some(most) = self.that_saw_most(lattice, nodes, present) else {
                return;
            };
            let kept = &self.kept[most];
            let age = (self.frame - kept.frame) as f32;
            lattice.lens.with(Recall {
                lattice,
                step: relative(&present.world_from_camera, &kept.at.world_from_camera),
                known: &kept.known,
                nodes,
                new: &mut self.new,
                nearest: &mut self.nearest,
                memory: memory.powf(age),
                drift: present.against(&kept.at),
            });
        }
    }

    /// The keyframe in which most of the new pixels should be.
    fn that_saw_most(&self, lattice: &Lattice, nodes: &[Node], present: &Present) -> Option<usize> {
        let saw = |kept: &Keyframe| {
            let doubt = present.against(&kept.at).rotation.sqrt() * lattice.focal_px;
            // Also false for NaN.
            if doubt <= LARGEST_DOUBT_PX {
                lattice.lens.with(Inside {
                    lattice,
                    nodes,
                    new: &self.new,
                    step: relative(&present.world_from_camera, &kept.at.world_from_camera),
                })
            } else {
                0
            }
        };
        let all = self.kept.iter().enumerate();
        let most = all
            .map(|(i, kept)| (saw(kept), kept.frame, i))
            .max_by_key(|(saw, frame, _)| (*saw, *frame));
        most.filter(|(saw, ..)| *saw >= WORTH).map(|(.., i)| i)
    }
}

impl Present {
    /// Variance of this pose against an earlier one.
    fn against(&self, earlier: &Self) -> Drift {
        let drift = self.drift.since(&earlier.drift);
        drift.plus(&self.noise).plus(&earlier.noise)
    }
}

/// How far the image has moved, pixels, in the mean; infinite where all of it is out of view.
struct Moved<'a> {
    lattice: &'a Lattice,
    nodes: &'a [Node],
    step: Step,
}

impl LensCall<f32> for Moved<'_> {
    fn call<L: Lens>(self, lens: &L) -> f32 {
        let (lattice, mut sum, mut count) = (self.lattice, 0.0, 0.0);
        for i in 0..GRID * GRID {
            let x = (2 * (i % GRID) + 1) * lattice.width / (2 * GRID);
            let y = (2 * (i / GRID) + 1) * lattice.height / (2 * GRID);
            let at = y * lattice.width + x;
            let there = self.step.there(&lattice.ray[at], self.nodes[at][0]);
            let place = lens.project(&there);
            let across = (place[0] - x as f32).abs();
            let around = lattice.width as f32 - across;
            let across = if lattice.wraps && around < across {
                around
            } else {
                across
            };
            let moved = across.hypot(place[1] - y as f32);
            if moved.is_finite() {
                (sum, count) = (sum + moved, count + 1.0);
            }
        }
        if count > 0.0 {
            sum / count
        } else {
            f32::INFINITY
        }
    }
}

/// How many of some of the new pixels should have been in view from another pose.
struct Inside<'a> {
    lattice: &'a Lattice,
    nodes: &'a [Node],
    new: &'a [u32],
    step: Step,
}

impl LensCall<usize> for Inside<'_> {
    fn call<L: Lens>(self, lens: &L) -> usize {
        let inside = |at: &&u32| {
            let at = **at as usize;
            let there = self.step.there(&self.lattice.ray[at], self.nodes[at][0]);
            self.lattice.around(lens.project(&there)).is_some()
        };
        self.new.iter().step_by(EVERY).filter(inside).count()
    }
}
