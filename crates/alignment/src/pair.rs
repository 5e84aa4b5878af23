//! Two images as inverse ranges on the same rays.

use crate::binning::InverseDepth;
use crate::sphere_table::SphereTable;

/// Inverse range of both images on the same rays, 1/m; NaN where either is unknown.
#[derive(Clone, Debug, Default)]
pub struct Pair {
    /// Mean of the two.
    pub mean: Vec<f32>,
    /// Half of second minus first.
    pub half: Vec<f32>,
}

impl Pair {
    /// Inverse ranges from inverse depths, known in both images.
    pub fn fill(&mut self, table: &SphereTable, first: &InverseDepth, second: &InverseDepth) {
        self.mean.resize(table.area.len(), f32::NAN);
        self.half.resize(table.area.len(), f32::NAN);
        pulp::Arch::new().dispatch(FillPair {
            values: [&first.values, &second.values],
            lengths: [first, second].map(|image| &table.rays(image.axis).length[..]),
            area: &table.area,
            pair: self,
        });
    }

    /// Share of rays known in both images.
    pub fn known_share(&self) -> f64 {
        let known = self.mean.iter().filter(|v| v.is_finite()).count();
        known as f64 / self.mean.len().max(1) as f64
    }
}

/// A struct instead of a closure: only so is the body compiled for the processor at hand.
struct FillPair<'a> {
    values: [&'a [f32]; 2],
    lengths: [&'a [f32]; 2],
    area: &'a [f32],
    pair: &'a mut Pair,
}

impl pulp::WithSimd for FillPair<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let [first, second] = self.values;
        let [length0, length1] = self.lengths;
        let lengths = length0.iter().zip(length1).zip(self.area);
        let inputs = first.iter().zip(second).zip(lengths);
        let outputs = self.pair.mean.iter_mut().zip(&mut self.pair.half);
        for (((&a, &b), ((length0, length1), area)), (mean, half)) in inputs.zip(outputs) {
            let seen = 0.0 * area; // NaN outside the camera's view
            let (a, b) = (a / length0, b / length1);
            *mean = 0.5 * (a + b) + seen;
            *half = 0.5 * (b - a) + seen;
        }
    }
}
