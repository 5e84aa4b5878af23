//! How much of a surface stays in view, and how far it moves in the image.

use super::Aligner;
use crate::pyramid::FramePyramid;
use nalgebra::{Vector2, Vector3};
use sphereflow_core::Pose;
use sphereflow_core::statistics::median_mut;

impl Aligner {
    /// Share of the keyframe's surface within another frame's image, 0 to 1, and the median
    /// displacement in pixels of the full image, were the motion `keyframe_from_frame`. Looked at on
    /// the coarsest level; the frame's own image is not needed. Of a keyframe of another camera's
    /// size, or one without depth: 0 and infinity.
    pub fn overlap_and_flow(
        &mut self,
        keyframe: &FramePyramid,
        keyframe_from_frame: &Pose,
    ) -> (f64, f64) {
        if self.stack.finest_level(keyframe).is_none() {
            return (0.0, f64::INFINITY);
        }
        let coarsest = self.coarsest;
        let (tables, image) = (&self.stack.levels[coarsest], &keyframe.levels[coarsest]);
        let rays = tables.table.rays(image.axis);
        let block = (self.stack.finest_block << coarsest) as f64;
        let second_from_first = keyframe_from_frame.inverse();
        let (mut known, mut inside) = (0_usize, 0_usize);
        self.flows.clear();
        let width = tables.table.width;
        for y in (0..tables.table.height).step_by(FLOW_STRIDE) {
            for x in (0..width).step_by(FLOW_STRIDE) {
                let i = y * width + x;
                let value = image.values[i];
                if value.is_nan() || value <= 0.0 {
                    continue;
                }
                known += 1;
                let range = f64::from(rays.length[i] / value);
                let ray = Vector3::from(rays.direction[i].map(f64::from));
                let point = second_from_first.transform(&(ray * range));
                let Some(pixel) = self.camera.project(&point) else {
                    continue;
                };
                if self.camera.contains(&pixel) {
                    inside += 1;
                    let from = Vector2::new(x as f64 + 0.5, y as f64 + 0.5) * block;
                    self.flows.push((pixel - from.add_scalar(-0.5)).norm());
                }
            }
        }
        match median_mut(&mut self.flows) {
            Some(median) => (inside as f64 / known as f64, median),
            None => (0.0, f64::INFINITY),
        }
    }
}

/// Every so many blocks of the coarsest level are looked at for overlap and flow.
const FLOW_STRIDE: usize = 2;
