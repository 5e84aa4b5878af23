//! One set of parameter values made ready: rays, fields and row times of the averaged images.

use super::parameters::Calibrated;
use crate::Result;
use sphereflow_alignment::Axis;
use sphereflow_alignment::binning::InverseDepth;
use sphereflow_alignment::sphere_table::SphereTable;
use sphereflow_sphere::Camera;
use std::sync::Arc;

/// What the images mean for one set of values.
#[derive(Clone, Debug)]
pub(super) struct ImageModel {
    /// Camera of the averaged image.
    pub(super) binned: Camera,
    pub(super) table: Arc<SphereTable>,
    /// Factor of the measured 1/Z, block by block.
    pub(super) factor: Vec<f32>,
    /// What is added to it, 1/m.
    offset: Vec<f32>,
    /// Time from a row of blocks to the next, seconds, and that of the first row after the stamp.
    row_s: f64,
    first_row_s: f64,
}

impl ImageModel {
    /// With tables of its own, or those of a model with the same rays.
    pub(super) fn new(
        calibrated: &Calibrated,
        block: usize,
        same_rays: Option<&Self>,
    ) -> Result<Self> {
        let camera = &calibrated.camera;
        let table = match same_rays {
            Some(other) => Arc::clone(&other.table),
            None => Arc::new(SphereTable::new(camera, block)?),
        };
        let fields = table.rays(Axis::Optical).direction.iter().map(|ray| {
            let [x, y, z] = ray.map(f64::from);
            let (factor, offset) = calibrated.correction.factor_and_offset(x / z, y / z);
            (factor as f32, offset as f32)
        });
        let (factor, offset) = fields.unzip();
        let per_pixel = calibrated.readout_s / camera.height() as f64;
        let middle = (block as f64 - 1.0) / 2.0;
        Ok(Self {
            binned: camera.binned(block)?,
            table,
            factor,
            offset,
            row_s: per_pixel * block as f64,
            first_row_s: per_pixel * middle - 0.5 * calibrated.readout_s,
        })
    }

    /// When row `y` of the averaged image is exposed, seconds after the stamp.
    pub(super) fn row_time_s(&self, y: f64) -> f64 {
        self.first_row_s + y * self.row_s
    }

    /// Corrected 1/Z of a measured image.
    pub(super) fn correct(&self, measured: &InverseDepth, out: &mut InverseDepth) {
        out.axis = measured.axis;
        out.values.clear();
        let fields = self.factor.iter().zip(&self.offset);
        let values = measured.values.iter().zip(fields);
        out.values.extend(values.map(|(&value, (factor, offset))| {
            let corrected = factor * value + offset;
            if corrected > 0.0 { corrected } else { f32::NAN }
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sphereflow_sphere::DepthCorrection;

    #[test]
    fn row_times_are_those_of_the_rows_middles() {
        let calibrated = Calibrated {
            camera: Camera::pinhole(50.0, 50.0, 31.5, 23.5, 64, 48).unwrap(),
            correction: DepthCorrection::default(),
            readout_s: 0.03,
        };
        let model = ImageModel::new(&calibrated, 4, None).unwrap();
        // rows 20, 21, 22, 23 of 48: (21.5 / 48 - 1/2) 30 ms
        let expected = (21.5 / 48.0 - 0.5) * 0.03;
        assert!((model.row_time_s(5.0) - expected).abs() < 1e-15);
    }
}
