//! The depth noise of a structured-light camera (Kinect v1), as measured on real recordings.

use super::correlated::{self, CorrelationScale};
use super::depth::{NoiseWorkspace, check_size, edit};
use super::distortion::InverseDepthDistortion;
use super::stream::{Purpose, Streams};
use super::{checks, holes};
use crate::rounding::nearest;
use nalgebra::Vector3;
use rayon::prelude::*;
use sphereflow_core::{DepthMap, Error, Result};
use sphereflow_sphere::camera::Camera;

/// Parameters of [`KinectNoise`]; the defaults are those of two real Kinects.
#[derive(Clone, Debug, PartialEq)]
pub struct KinectParameters {
    /// Standard deviation of 1/Z, 1/m, flat in range, **with** the quantisation's share
    /// `quantum^2 / 12` of its variance: what a recording shows. 0 leaves the quantisation alone.
    pub sigma_inv_m: f64,
    /// Step of 1/Z, 1/m; 0 switches the quantisation off.
    pub quantum_inv_m: f64,
    /// Correlation of the noise before quantisation. The default gives, after quantisation with the
    /// default step, the measured autocorrelation .77, .6, .4, .22, .1 at 1, 2, 4, 8, 16 pixels.
    pub correlation: Vec<CorrelationScale>,
    /// Share of pixels lost in blobs, 0 to below 1.
    pub hole_share: f64,
    /// Place of the projector to the right of the camera, metres (negative: left); 0 switches the
    /// shadow off.
    pub projector_right_m: f64,
    /// Smallest depth that is reported, metres.
    pub min_range_m: f64,
    /// Largest depth that is reported, metres.
    pub max_range_m: f64,
    /// Smooth distortion of 1/Z; `None` for a calibrated camera.
    pub distortion: Option<InverseDepthDistortion>,
}

impl Default for KinectParameters {
    fn default() -> Self {
        let scale = |variance_share, decay_per_px| CorrelationScale {
            variance_share,
            decay_per_px,
        };
        Self {
            sigma_inv_m: 1.8e-3,
            quantum_inv_m: 2.85e-3,
            correlation: vec![scale(0.78, 0.62), scale(0.22, 0.92)],
            hole_share: 0.02,
            projector_right_m: 0.075,
            min_range_m: 0.4,
            max_range_m: 6.0,
            distortion: Some(InverseDepthDistortion::default()),
        }
    }
}

/// Turns a true depth map into what a Kinect would have read.
///
/// Order: shadow (true geometry), distortion, correlated noise, quantisation, range, holes. Unknown
/// pixels stay unknown.
#[derive(Clone, Debug, PartialEq)]
pub struct KinectNoise {
    parameters: KinectParameters,
    seed: u64,
}

impl KinectNoise {
    /// # Errors
    /// [`Error::Value`] naming the parameter out of range.
    pub fn new(parameters: KinectParameters, seed: u64) -> Result<Self> {
        let p = &parameters;
        checks::non_negative("sigma_inv_m", p.sigma_inv_m)?;
        checks::non_negative("quantum_inv_m", p.quantum_inv_m)?;
        correlated::check(&p.correlation)?;
        checks::share("hole_share", p.hole_share)?;
        checks::finite("projector_right_m", p.projector_right_m)?;
        checks::positive("min_range_m", p.min_range_m)?;
        checks::positive("max_range_m", p.max_range_m)?;
        if p.max_range_m <= p.min_range_m {
            return Err(Error::value(
                "max_range_m",
                format!("more than min_range_m = {}", p.min_range_m),
                p.max_range_m,
            ));
        }
        if let Some(distortion) = &p.distortion {
            distortion.check()?;
        }
        Ok(Self { parameters, seed })
    }

    /// The parameters.
    pub fn parameters(&self) -> &KinectParameters {
        &self.parameters
    }

    /// What the sensor reads of `depth` in frame `frame_index`.
    ///
    /// # Errors
    /// See [`KinectNoise::apply_in_place`].
    pub fn apply(&self, depth: &DepthMap, camera: &Camera, frame_index: u64) -> Result<DepthMap> {
        let mut noisy = depth.clone();
        let mut workspace = NoiseWorkspace::default();
        self.apply_in_place(&mut noisy, camera, frame_index, &mut workspace)?;
        Ok(noisy)
    }

    /// [`KinectNoise::apply`] without a new image; allocates only where `workspace` has not yet seen
    /// this camera.
    ///
    /// # Errors
    /// [`Error::Shape`] where the map is not of the camera's size, [`Error::Value`] for a camera
    /// that has no focal length ahead (a panorama). The map is then unchanged.
    pub fn apply_in_place(
        &self,
        depth: &mut DepthMap,
        camera: &Camera,
        frame_index: u64,
        workspace: &mut NoiseWorkspace,
    ) -> Result<()> {
        check_size(depth, camera)?;
        let focal_px = focal_length(camera)?;
        edit(depth, |metres| {
            self.corrupt(metres, camera, focal_px, frame_index, workspace);
        });
        Ok(())
    }

    /// The whole model on row-major metres.
    fn corrupt(
        &self,
        metres: &mut [f32],
        camera: &Camera,
        focal_px: f64,
        frame_index: u64,
        workspace: &mut NoiseWorkspace,
    ) {
        let p = &self.parameters;
        let (width, height) = (camera.width(), camera.height());
        let streams = |purpose| Streams::new(self.seed, purpose, frame_index);
        metres.par_chunks_mut(width).for_each(invert);
        if p.projector_right_m != 0.0 {
            let disparity = (focal_px * p.projector_right_m) as f32;
            let nearest = (1.0 / p.min_range_m) as f32;
            workspace.shadow.cast(metres, width, disparity, nearest);
        }
        let factors = match &p.distortion {
            Some(distortion) => workspace.factors.of(camera, distortion),
            None => &[],
        };
        let sigma = self.sigma_before_quantisation();
        let field: &[f32] = if sigma > 0.0 {
            workspace.correlated.generate(
                width,
                height,
                &p.correlation,
                &streams(Purpose::CorrelatedDepth),
            )
        } else {
            &[]
        };
        metres
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(y, row)| {
                multiply(row, row_of(factors, y, width));
                add(row, row_of(field, y, width), sigma);
                quantise(row, p.quantum_inv_m as f32);
                to_depth(row, p.min_range_m as f32, p.max_range_m as f32);
            });
        if p.hole_share > 0.0 {
            holes::punch(metres, width, p.hole_share, &streams(Purpose::Holes));
        }
    }

    /// Standard deviation that the quantisation raises to `sigma_inv_m`.
    fn sigma_before_quantisation(&self) -> f32 {
        let p = &self.parameters;
        let variance = p.sigma_inv_m.powi(2) - p.quantum_inv_m.powi(2) / 12.0;
        variance.max(0.0).sqrt() as f32
    }
}

/// Pixels per unit x/z ahead of the camera.
fn focal_length(camera: &Camera) -> Result<f64> {
    let ahead = camera.project_with_jacobian(&Vector3::z());
    match ahead {
        Some((_, jacobian)) if !camera.wraps_around() => Ok(jacobian[(0, 0)]),
        _ => Err(Error::value(
            "camera",
            "a camera that looks ahead, as structured light needs",
            "a panorama",
        )),
    }
}

/// Row `y` of an optional plane: empty where there is none.
fn row_of(plane: &[f32], y: usize, width: usize) -> &[f32] {
    plane.get(y * width..(y + 1) * width).unwrap_or(&[])
}

fn invert(row: &mut [f32]) {
    row.iter_mut().for_each(|v| *v = 1.0 / *v);
}

fn multiply(row: &mut [f32], factors: &[f32]) {
    row.iter_mut().zip(factors).for_each(|(v, f)| *v *= f);
}

fn add(row: &mut [f32], field: &[f32], sigma: f32) {
    row.iter_mut().zip(field).for_each(|(v, n)| *v += sigma * n);
}

/// Rounds 1/Z to multiples of `quantum`; 0 leaves it. Beyond 4 million quanta, where `f32` has no
/// digits left, to several of them.
pub(crate) fn quantise(row: &mut [f32], quantum: f32) {
    if quantum > 0.0 {
        let per_quantum = 1.0 / quantum;
        row.iter_mut()
            .for_each(|v| *v = nearest(*v * per_quantum) * quantum);
    }
}

/// Inverse depth to depth; NaN outside the range (NaN fails both comparisons).
fn to_depth(row: &mut [f32], min_m: f32, max_m: f32) {
    for value in row {
        let depth = 1.0 / *value;
        *value = if depth >= min_m && depth <= max_m {
            depth
        } else {
            f32::NAN
        };
    }
}
