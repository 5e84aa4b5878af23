//! The elimination of some of the poses, and their steps from those of the points.

use crate::bundle::layout::Layout;
use crate::linear::BlockPattern;
use crate::minimise::damping_term;
use crate::options::Damping;

/// Where the normal matrix of a pose by a point or by intrinsics is kept.
#[derive(Clone, Copy)]
pub(super) enum Source {
    /// Pose by point, 6 x 3 by columns: part of the points, and the first number there.
    Chunk(usize, usize),
    /// Intrinsics by pose, by columns, among the directly measured blocks.
    Direct(usize),
}

/// What a pose shares with a block of the reduced system.
#[derive(Clone, Copy)]
pub(super) struct Coupling {
    pub block: u32,
    size: usize,
    source: Source,
}

impl Coupling {
    pub fn new(block: u32, size: usize, source: Source) -> Self {
        Self {
            block,
            size,
            source,
        }
    }

    /// Numbers of a row of `z`: points are padded to a whole vector.
    fn stride(&self) -> usize {
        if self.size == 3 { 4 } else { self.size }
    }
}

/// Consecutive poses with everything that their elimination needs.
pub(super) struct Part {
    /// Block of the first pose.
    pub first: usize,
    starts: Vec<usize>,
    couplings: Vec<Coupling>,
    /// Offsets in the reduced matrix of the pairs of couplings of each pose.
    pairs: Vec<u32>,
    /// First scalar row of each coupling's block.
    rows: Vec<u32>,
    /// Cholesky factors of the poses' damped matrices, by rows.
    factors: Vec<[f64; 36]>,
    /// The couplings of one pose over its factor, six rows each.
    z: Vec<f64>,
    pub reduced: Vec<f64>,
    pub rhs: Vec<f64>,
    pub steps: Vec<f64>,
    pub singular: bool,
}

impl Part {
    pub fn new(first: usize, of_poses: &[Vec<Coupling>], pattern: &BlockPattern) -> Self {
        let (mut starts, mut couplings, mut pairs) = (vec![0], Vec::new(), Vec::new());
        let mut widest = 0;
        for of_pose in of_poses {
            for (a, column) in of_pose.iter().enumerate() {
                for row in &of_pose[a..] {
                    // any two of a pose's couplings have a block
                    let offset = pattern.offset(row.block as usize, column.block as usize);
                    pairs.push(offset.map_or(0, |offset| offset as u32));
                }
            }
            widest = widest.max(of_pose.iter().map(|c| 6 * c.stride()).sum());
            couplings.extend_from_slice(of_pose);
            starts.push(couplings.len());
        }
        let rows = couplings
            .iter()
            .map(|c| pattern.start(c.block as usize) as u32);
        Self {
            first,
            rows: rows.collect(),
            factors: vec![[0.0; 36]; of_poses.len()],
            z: vec![0.0; widest],
            reduced: vec![0.0; pattern.len()],
            rhs: vec![0.0; pattern.dimension()],
            steps: vec![0.0; 6 * of_poses.len()],
            singular: false,
            starts,
            couplings,
            pairs,
        }
    }

    /// Subtracts the poses' part of the Schur complement.
    pub fn eliminate(&mut self, known: (&Layout, &[f64], &[f64]), damping: (Damping, f64)) {
        self.reduced.fill(0.0);
        self.rhs.fill(0.0);
        self.singular = false;
        pulp::Arch::new().dispatch(Eliminate(self, known, damping));
    }

    #[inline(always)]
    fn eliminate_inner(
        &mut self,
        (layout, direct, gradient): (&Layout, &[f64], &[f64]),
        (damping, lambda): (Damping, f64),
    ) {
        let mut pair = 0;
        for pose in 0..self.factors.len() {
            let block = self.first + pose;
            let mut u = [0.0; 36];
            u.copy_from_slice(&direct[layout.direct.diagonal[block]..][..36]);
            for k in 0..6 {
                u[7 * k] += damping_term(damping, lambda, u[7 * k]);
            }
            if !factor(&mut u) {
                self.singular = true;
                return;
            }
            self.factors[pose] = u;
            let mut g = [0.0; 6];
            g.copy_from_slice(&gradient[layout.pattern.start(block)..][..6]);
            forward(&u, &mut g, 1);
            let range = self.starts[pose]..self.starts[pose + 1];
            let mut at = 0;
            for k in range.clone() {
                let (coupling, row) = (self.couplings[k], self.rows[k] as usize);
                let stride = coupling.stride();
                let z = &mut self.z[at..at + 6 * stride];
                load(z, &coupling, layout, direct);
                match z.first_chunk_mut::<24>() {
                    Some(z) if stride == 4 => forward(&u, z, 4),
                    _ => forward(&u, z, stride),
                }
                for (r, rhs) in self.rhs[row..row + coupling.size].iter_mut().enumerate() {
                    *rhs += (0..6).map(|k| z[k * stride + r] * g[k]).sum::<f64>();
                }
                at += 6 * stride;
            }
            self.subtract_pairs(range, &mut pair);
        }
    }

    #[inline(always)]
    fn subtract_pairs(&mut self, range: std::ops::Range<usize>, pair: &mut usize) {
        let couplings = &self.couplings[range];
        let mut first = 0;
        for (a, column) in couplings.iter().enumerate() {
            let (width, z) = (column.stride(), &self.z[first..]);
            let mut at = first;
            for row in &couplings[a..] {
                let (height, offset) = (row.stride(), self.pairs[*pair] as usize);
                let s = &mut self.reduced[offset..offset + row.size * column.size];
                match (
                    s.first_chunk_mut(),
                    self.z[at..].first_chunk(),
                    z.first_chunk(),
                ) {
                    (Some(s), Some(row), Some(column)) if width == 4 && height == 4 => {
                        subtract_3_3(s, row, column);
                    }
                    _ => subtract(
                        (s, row.size),
                        &self.z[at..],
                        z,
                        (height, width, column.size),
                    ),
                }
                at += 6 * height;
                *pair += 1;
            }
            first += 6 * width;
        }
    }

    /// The poses' steps from those of points and intrinsics.
    pub fn substitute(
        &mut self,
        (layout, direct, gradient): (&Layout, &[f64], &[f64]),
        pattern: &BlockPattern,
        step: &[f64],
    ) {
        for pose in 0..self.factors.len() {
            let mut b = [0.0; 6];
            b.copy_from_slice(&gradient[layout.pattern.start(self.first + pose)..][..6]);
            for coupling in &self.couplings[self.starts[pose]..self.starts[pose + 1]] {
                let start = pattern.start(coupling.block as usize);
                let d = &step[start..start + coupling.size];
                for (k, b) in b.iter_mut().enumerate() {
                    let entry = |c: usize| coupling.entry(layout, direct, k, c);
                    *b += d.iter().enumerate().map(|(c, d)| entry(c) * d).sum::<f64>();
                }
            }
            let l = &self.factors[pose];
            forward(l, &mut b, 1);
            for k in (0..6).rev() {
                for j in k + 1..6 {
                    b[k] -= l[6 * j + k] * b[j];
                }
                b[k] *= l[7 * k];
            }
            for (step, b) in self.steps[6 * pose..6 * pose + 6].iter_mut().zip(b) {
                *step = -b;
            }
        }
    }
}

impl Coupling {
    /// Pose row `k`, point or intrinsic `c`.
    #[inline(always)]
    fn entry(&self, layout: &Layout, direct: &[f64], k: usize, c: usize) -> f64 {
        match self.source {
            Source::Chunk(part, first) => layout.chunks[part].number(first + 6 * c + k),
            Source::Direct(first) => direct[first + k * self.size + c],
        }
    }
}

#[inline(always)]
fn load(z: &mut [f64], coupling: &Coupling, layout: &Layout, direct: &[f64]) {
    let stride = coupling.stride();
    for (k, row) in z.chunks_exact_mut(stride).enumerate() {
        for (c, entry) in row[..coupling.size].iter_mut().enumerate() {
            *entry = coupling.entry(layout, direct, k, c);
        }
        row[coupling.size..].fill(0.0);
    }
}

/// Cholesky factor by rows in place, with the inverses of its diagonal; false where the matrix is
/// not positive definite.
#[inline(always)]
fn factor(u: &mut [f64; 36]) -> bool {
    for k in 0..6 {
        let mut d = u[7 * k];
        for j in 0..k {
            d -= u[6 * k + j] * u[6 * k + j];
        }
        // a NaN is not positive either
        if d.is_nan() || d <= 0.0 {
            return false;
        }
        let inverse = 1.0 / d.sqrt();
        u[7 * k] = inverse;
        for r in k + 1..6 {
            let mut sum = u[6 * r + k];
            for j in 0..k {
                sum -= u[6 * r + j] * u[6 * k + j];
            }
            u[6 * r + k] = sum * inverse;
        }
    }
    true
}

/// `L^-1 z` in place, `z` of six rows.
#[inline(always)]
fn forward(l: &[f64; 36], z: &mut [f64], stride: usize) {
    for k in 0..6 {
        let (above, rest) = z.split_at_mut(k * stride);
        let row = &mut rest[..stride];
        for (j, other) in above.chunks_exact(stride).enumerate() {
            for (entry, other) in row.iter_mut().zip(other) {
                *entry -= l[6 * k + j] * other;
            }
        }
        for entry in row {
            *entry *= l[7 * k];
        }
    }
}

/// `s -= row^T column` of two points.
#[inline(always)]
fn subtract_3_3(s: &mut [f64; 9], row: &[f64; 24], column: &[f64; 24]) {
    for c in 0..3 {
        let mut sum = [0.0; 4];
        for k in 0..6 {
            for (r, sum) in sum.iter_mut().enumerate() {
                *sum += row[4 * k + r] * column[4 * k + c];
            }
        }
        for r in 0..3 {
            s[3 * c + r] -= sum[r];
        }
    }
}

fn subtract(
    (s, rows): (&mut [f64], usize),
    row: &[f64],
    column: &[f64],
    (height, width, columns): (usize, usize, usize),
) {
    for c in 0..columns {
        for r in 0..rows {
            let products = (0..6).map(|k| row[k * height + r] * column[k * width + c]);
            s[rows * c + r] -= products.sum::<f64>();
        }
    }
}

struct Eliminate<'a>(
    &'a mut Part,
    (&'a Layout, &'a [f64], &'a [f64]),
    (Damping, f64),
);

impl pulp::WithSimd for Eliminate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.0.eliminate_inner(self.1, self.2);
    }
}
