//! Frames as they would be had all rows been exposed at once.

use super::{Aligner, FINE_STEPS};
use crate::pyramid::FramePyramid;
use crate::warp::Warp;
use sphereflow_core::Pose;
use sphereflow_sphere::RollingShutter;

impl Aligner {
    /// The image of a frame as it would be had all rows been exposed at the stamp, given the
    /// camera's velocity during the exposure. Only the finest level that the frame has is looked up;
    /// the coarser ones are averaged from it. Of a frame of another camera's size `out` is left
    /// empty.
    pub fn undo_rolling_shutter(
        &mut self,
        frame: &FramePyramid,
        shutter: RollingShutter,
        out: &mut FramePyramid,
    ) {
        let Some(finest) = self.stack.finest_level(frame) else {
            out.levels.clear();
            return;
        };
        out.levels
            .resize_with(self.stack.levels.len(), Default::default);
        out.levels[..finest].fill_with(Default::default);
        let tables = &self.stack.levels[finest];
        Warp {
            camera: &tables.camera,
            plane: tables.plane.as_ref(),
            table: &tables.table,
            second: &frame.levels[finest],
            motion: Pose::identity(),
            shutter,
            max_jump: self.config.max_jump as f32,
            steps: FINE_STEPS,
        }
        .fill(
            &frame.levels[finest],
            &mut self.rows,
            &mut out.levels[finest],
        );
        self.stack.coarsen(out, finest);
    }
}
