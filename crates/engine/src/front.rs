//! The front: what is done for every frame.

use nalgebra::Matrix6;
use sphereflow_core::{DepthMap, Plane, Pose, RangeMap, Result, RgbdFrame, Stamp};
use sphereflow_odometry::{DepthOdometry, OdometryConfig, OdometryResult};
use sphereflow_slam::Distances;
use sphereflow_slam::map::covariance;
use sphereflow_sphere::{Calibration, Camera, DepthCorrector};

/// The odometry with what it needs of the calibration.
#[derive(Clone, Debug)]
pub struct Front {
    camera: Camera,
    odometry: DepthOdometry,
    corrector: Option<DepthCorrector>,
    /// The last measured pose, its covariance and time: predicted poses go on from there.
    last: Option<(Pose, Matrix6<f64>, Stamp)>,
}

impl Front {
    /// For a calibrated camera that begins at `start`.
    ///
    /// # Errors
    /// A core value error where the calibration has no depth camera or a setting is out of range.
    pub fn new(calibration: &Calibration, config: OdometryConfig) -> Result<Self> {
        let Some(camera) = calibration.depth.clone() else {
            let (expected, found) = ("a depth camera", "none");
            return Err(sphereflow_core::Error::value(
                "calibration.depth",
                expected,
                found,
            ));
        };
        let config = OdometryConfig {
            readout_s: calibration.readout_s.unwrap_or(config.readout_s),
            emit_keyframes: true,
            ..config
        };
        let field = calibration.depth_field.filter(|field| !field.is_identity());
        Ok(Self {
            odometry: DepthOdometry::new(&camera, config)?,
            corrector: field
                .map(|field| DepthCorrector::new(&camera, &field))
                .transpose()?,
            camera,
            last: None,
        })
    }

    /// The depth camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The odometry.
    pub fn odometry(&self) -> &DepthOdometry {
        &self.odometry
    }

    /// The world of the poses to come: `world_from_first`, before the first frame.
    pub fn begin_at(&mut self, world_from_first: Pose) {
        self.odometry.begin_at(world_from_first);
    }

    /// The keyframe in use was moved by the graph: later frames go on from there.
    pub fn rebase(&mut self, world_from_keyframe: &Pose) {
        let correction = self.odometry.rebase(world_from_keyframe);
        if let Some((pose, _, _)) = &mut self.last {
            *pose = correction * *pose;
        }
    }

    /// The frame's distances as the estimators want them: masked, and corrected by the calibration.
    ///
    /// # Errors
    /// A core shape error where an image is not of the camera's size.
    pub fn prepared(&self, frame: &mut RgbdFrame) -> Result<()> {
        if let Some(mask) = frame.mask.take() {
            frame.depth = frame
                .depth
                .take()
                .map(|d| masked(d.into_plane(), &mask))
                .transpose()?
                .map(DepthMap::new);
            frame.range = frame
                .range
                .take()
                .map(|r| masked(r.into_plane(), &mask))
                .transpose()?
                .map(RangeMap::new);
        }
        if let Some(corrector) = &self.corrector {
            let corrected = frame.depth.take().map(|depth| corrector.apply(depth));
            frame.depth = corrected.transpose()?;
        }
        Ok(())
    }

    /// Motion of the frame against its keyframe.
    ///
    /// # Errors
    /// As [`DepthOdometry::push`]; the front is as before.
    pub fn track(&mut self, frame: &RgbdFrame) -> Result<OdometryResult> {
        match distances_of(frame) {
            None => Ok(self.odometry.push_without_depth(frame.stamp)),
            Some(Distances::Depth(depth)) => self.odometry.push(depth, frame.stamp),
            Some(Distances::Range(range)) => self.odometry.push(range, frame.stamp),
        }
    }

    /// Covariance of the frame's pose relative to the start of its segment; `measured` is that of its
    /// measurement, `None` where it was not measured.
    pub fn covariance(
        &mut self,
        result: &OdometryResult,
        measured: Option<Matrix6<f64>>,
    ) -> Matrix6<f64> {
        if result.status.has_pose() {
            let repeated = result.keyframe_motion.is_none();
            let known = self.last.filter(|_| repeated).map(|(_, c, _)| c);
            let covariance = measured.or(known).unwrap_or_else(Matrix6::zeros);
            self.last = Some((result.world_from_camera, covariance, result.stamp));
            return covariance;
        }
        match &self.last {
            None => Matrix6::repeat(f64::NAN), // nothing was measured yet
            Some((pose, known, stamp)) => {
                let moved = pose.inverse() * result.world_from_camera;
                let dt_s = result.stamp.seconds_since(*stamp).max(0.0);
                covariance::predicted(known, &moved, dt_s)
            }
        }
    }
}

/// What the frame has of distances: depth, or else range.
pub fn distances_of(frame: &RgbdFrame) -> Option<Distances<'_>> {
    let depth = frame.depth.as_ref().map(Distances::Depth);
    depth.or(frame.range.as_ref().map(Distances::Range))
}

/// The plane with NaN where the mask is true.
fn masked(mut plane: Plane<f32>, mask: &Plane<bool>) -> Result<Plane<f32>> {
    if plane.size() != mask.size() {
        let text = |(w, h): (usize, usize)| format!("{w}x{h}");
        let (expected, found) = (text(plane.size()), text(mask.size()));
        return Err(sphereflow_core::Error::shape("mask", expected, found));
    }
    for (value, ignored) in plane.data_mut().iter_mut().zip(mask.data()) {
        if *ignored {
            *value = f32::NAN;
        }
    }
    Ok(plane)
}
