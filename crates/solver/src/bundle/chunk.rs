//! A fixed part of the points with their measurements: linearised, eliminated and put back alone.

mod eliminate;
mod linearise;
mod refine;

use super::ids::NONE;
use super::intrinsics::Intrinsics;
use super::measurement::{Losses, Measurement};
use super::normal::Normal;
use super::rows::{CameraState, RowMotion};
use super::state::ViewPose;
use crate::linear::BlockPattern;
use crate::options::Damping;
use nalgebra::Vector3;

/// Where the directly measured blocks (diagonal, and intrinsics by pose) are kept, apart from the
/// reduced matrix.
pub(super) struct Direct {
    /// Offset of each diagonal block; one more at the end.
    pub diagonal: Vec<usize>,
    /// Offset of the block intrinsics by pose of each view; `NONE` where there is none.
    pub cross: Vec<u32>,
    /// Offset here, offset in the reduced matrix, numbers.
    pub targets: Vec<(usize, usize, usize)>,
    pub len: usize,
}

/// The measurements of one point from one view.
#[derive(Clone, Copy)]
pub(super) struct Link {
    pub view: u32,
    pub camera: u32,
    /// One past its last measurement.
    pub observations: u32,
    pub view_block: u32,
    pub camera_block: u32,
    pub view_touch: u32,
    pub camera_touch: u32,
}

/// A block of the reduced system that a point's measurements depend on.
#[derive(Clone, Copy)]
pub(super) struct Touch {
    block: u32,
    size: u32,
    w: u32,
}

impl Touch {
    pub fn new(block: u32, size: usize) -> Self {
        Self {
            block,
            size: size as u32,
            w: 0,
        }
    }

    fn w(&self) -> std::ops::Range<usize> {
        self.w as usize..(self.w + 3 * self.size) as usize
    }
}

/// Where a point's data begin.
#[derive(Clone, Copy)]
struct Start {
    link: u32,
    observation: u32,
    touch: u32,
    pair: u32,
}

/// What residuals need of the current state or a candidate.
#[derive(Clone, Copy)]
pub(super) struct Scene<'a> {
    pub poses: &'a [ViewPose],
    pub intrinsics: &'a [Intrinsics],
    /// How the camera of each pose moves.
    pub rows: &'a [RowMotion],
    pub losses: &'a Losses,
}

impl<'a> Scene<'a> {
    #[inline(always)]
    fn camera(&self, link: &Link) -> CameraState<'a> {
        CameraState {
            intrinsics: &self.intrinsics[link.camera as usize],
            rows: &self.rows[link.view as usize],
        }
    }
}

/// What back substitution found.
#[derive(Clone, Copy, Default)]
pub(super) struct PointStep {
    pub promised: f64,
    pub squared: f64,
    pub state_squared: f64,
}

#[derive(Default)]
pub(super) struct Chunk {
    pub points: Vec<u32>,
    free: Vec<bool>,
    /// False where the points stay and the poses are eliminated.
    eliminates: bool,
    starts: Vec<Start>,
    links: Vec<Link>,
    observations: Vec<Measurement>,
    pub touches: Vec<Touch>,
    /// Offsets in the reduced matrix of the pairs of touches of each point.
    pub pairs: Vec<u32>,
    /// State and candidate, world, metres.
    pub current: Vec<Vector3<f64>>,
    pub candidate: Vec<Vector3<f64>>,
    /// Normal matrix `[xx, xy, xz, yy, yz, zz]`, its damped inverse and the gradient of each point.
    v: Vec<[f64; 6]>,
    inverse: Vec<[f64; 6]>,
    g: Vec<Vector3<f64>>,
    /// Normal matrix touch by point, by columns; and times the inverse, of one point.
    w: Vec<f64>,
    y: Vec<f64>,
    /// Sums of this part.
    pub reduced: Vec<f64>,
    pub rhs: Vec<f64>,
    pub direct: Vec<f64>,
    pub gradient: Vec<f64>,
    pub gradient_max: f64,
    pub singular: bool,
    pub step: PointStep,
    pub cost: Option<f64>,
}

/// Building.
impl Chunk {
    /// Without points; they are eliminated or stay.
    pub fn new(eliminates: bool) -> Self {
        Self {
            eliminates,
            ..Self::default()
        }
    }

    fn start(&self) -> Start {
        Start {
            link: self.links.len() as u32,
            observation: self.observations.len() as u32,
            touch: self.touches.len() as u32,
            pair: self.pairs.len() as u32,
        }
    }

    pub fn begin_point(&mut self, point: usize, free: bool) {
        self.starts.push(self.start());
        self.points.push(point as u32);
        self.free.push(free);
    }

    pub fn add_touch(&mut self, mut touch: Touch) {
        touch.w = self.w.len() as u32;
        self.w.resize(self.w.len() + 3 * touch.size as usize, 0.0);
        self.touches.push(touch);
    }

    pub fn add_observation(&mut self, mut link: Link, measurement: Measurement) {
        self.observations.push(measurement);
        link.observations = self.observations.len() as u32;
        let first = self.starts.last().map_or(0, |start| start.link) as usize;
        let camera = measurement.uses_camera();
        if !camera {
            link.camera_touch = NONE;
        }
        match self.links[first..].last_mut() {
            Some(last) if last.view == link.view => {
                last.observations = link.observations;
                if camera {
                    last.camera_touch = link.camera_touch;
                }
            }
            _ => self.links.push(link),
        }
    }

    pub fn allocate(&mut self, pattern: &BlockPattern, direct: &Direct) {
        self.starts.push(self.start());
        let points = self.points.len();
        self.current = vec![Vector3::zeros(); points];
        self.candidate = vec![Vector3::zeros(); points];
        self.v = vec![[0.0; 6]; points];
        self.inverse = vec![[0.0; 6]; points];
        self.g = vec![Vector3::zeros(); points];
        let widest = (0..points).map(|point| {
            let range = self.touch_range(point);
            self.touches[range]
                .iter()
                .map(|touch| 3 * touch.size as usize)
                .sum()
        });
        if self.eliminates {
            self.y = vec![0.0; widest.max().unwrap_or(0)];
            self.reduced = vec![0.0; pattern.len()];
            self.rhs = vec![0.0; pattern.dimension()];
        }
        self.gradient = vec![0.0; pattern.dimension()];
        self.direct = vec![0.0; direct.len];
    }

    fn touch_range(&self, point: usize) -> std::ops::Range<usize> {
        self.starts[point].touch as usize..self.starts[point + 1].touch as usize
    }
}

/// Numbers.
impl Chunk {
    pub fn has_free_point(&self) -> bool {
        self.free.iter().any(|free| *free)
    }

    /// False where the points stay.
    pub fn eliminates(&self) -> bool {
        self.eliminates
    }

    /// True where the point moves.
    pub fn is_free(&self, point: usize) -> bool {
        self.free[point]
    }

    /// The blocks that a point's measurements depend on, and where the numbers of each are.
    pub fn touched(
        &self,
        point: usize,
    ) -> impl Iterator<Item = (usize, std::ops::Range<usize>)> + '_ {
        let touches = &self.touches[self.touch_range(point)];
        touches
            .iter()
            .map(|touch| (touch.block as usize, touch.w()))
    }

    /// Numbers of a block by a point, by columns.
    pub fn numbers(&self, range: &std::ops::Range<usize>) -> &[f64] {
        &self.w[range.clone()]
    }

    /// One of these numbers.
    #[inline(always)]
    pub fn number(&self, k: usize) -> f64 {
        self.w[k]
    }

    /// Normal matrix `[xx, xy, xz, yy, yz, zz]` and gradient of a point.
    pub fn point_normal(&self, point: usize) -> ([f64; 6], Vector3<f64>) {
        (self.v[point], self.g[point])
    }

    #[cfg(test)]
    pub fn point_gradient(&self, point: usize) -> Vector3<f64> {
        self.g[point]
    }

    /// Half the sum of the losses at the current points or the candidates, into `cost`; `None`
    /// where a point is not seen. Candidates under robust losses are moved to where they cost less
    /// first.
    pub fn evaluate(&mut self, scene: &Scene, candidate: bool) {
        if candidate && scene.losses.robust() {
            self.cost = self.refine(scene);
            return;
        }
        self.cost = pulp::Arch::new().dispatch(Evaluate(self, scene, candidate));
    }

    #[inline(always)]
    fn evaluate_inner(&self, scene: &Scene, candidate: bool) -> Option<f64> {
        let points = if candidate {
            &self.candidate
        } else {
            &self.current
        };
        let (mut cost, mut k) = (0.0, 0);
        for (point, position) in points.iter().enumerate() {
            let links = self.starts[point].link as usize..self.starts[point + 1].link as usize;
            for link in &self.links[links] {
                let x = scene.poses[link.view as usize].transform(position);
                let camera = scene.camera(link);
                while k < link.observations as usize {
                    let measurement = &self.observations[k];
                    let squared = measurement.squared(camera, &x)?;
                    cost += measurement.loss(scene.losses).evaluate(squared).0;
                    k += 1;
                }
            }
        }
        Some(0.5 * cost)
    }

    /// Residuals and derivatives of every point, and its elimination with this damping.
    pub fn linearise(
        &mut self,
        scene: &Scene,
        (pattern, direct): (&BlockPattern, &Direct),
        (damping, lambda): (Damping, f64),
    ) {
        self.direct.fill(0.0);
        self.gradient.fill(0.0);
        self.gradient_max = 0.0;
        self.clear_reduced();
        let work = Linearise(self, scene, (pattern, direct), (damping, lambda));
        pulp::Arch::new().dispatch(work);
    }

    /// The elimination alone, with another damping.
    pub fn eliminate(&mut self, pattern: &BlockPattern, damping: Damping, lambda: f64) {
        self.clear_reduced();
        pulp::Arch::new().dispatch(Eliminate(self, pattern, (damping, lambda)));
    }

    fn clear_reduced(&mut self) {
        self.reduced.fill(0.0);
        self.rhs.fill(0.0);
        self.singular = false;
    }

    /// Whitened residual components of all measurements at the current state, appended to `all`.
    pub fn residuals(&self, scene: &Scene, all: &mut Vec<f64>) {
        let mut k = 0;
        for (point, position) in self.current.iter().enumerate() {
            let links = self.starts[point].link as usize..self.starts[point + 1].link as usize;
            for link in &self.links[links] {
                let x = scene.poses[link.view as usize].transform(position);
                let camera = scene.camera(link);
                while k < link.observations as usize {
                    self.observations[k].components(camera, &x, all);
                    k += 1;
                }
            }
        }
    }
}

/// Loops over the points of a chunk, compiled once for every width of vectors and chosen when they
/// run. A closure would do, were it certain to be inlined.
struct Evaluate<'a>(&'a Chunk, &'a Scene<'a>, bool);
struct Linearise<'a>(
    &'a mut Chunk,
    &'a Scene<'a>,
    (&'a BlockPattern, &'a Direct),
    (Damping, f64),
);
struct Eliminate<'a>(&'a mut Chunk, &'a BlockPattern, (Damping, f64));

impl pulp::WithSimd for Evaluate<'_> {
    type Output = Option<f64>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Option<f64> {
        self.0.evaluate_inner(self.1, self.2)
    }
}

impl pulp::WithSimd for Linearise<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self(chunk, scene, maps, (damping, lambda)) = self;
        let mut normal = Normal::new();
        for point in 0..chunk.points.len() {
            chunk.linearise_point(point, scene, maps, &mut normal);
            if chunk.eliminates {
                chunk.eliminate_point(point, maps.0, damping, lambda);
            }
        }
    }
}

impl pulp::WithSimd for Eliminate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self(chunk, pattern, (damping, lambda)) = self;
        for point in 0..chunk.points.len() {
            chunk.eliminate_point(point, pattern, damping, lambda);
        }
    }
}
