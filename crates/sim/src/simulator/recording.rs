//! A simulation as a recording on disk, to be read like any other.

use super::Simulator;
use crate::{Result, SimConfig};
use sphereflow_io::{CalibrationFile, ImuNoise, RecordingWriter};
use std::ops::ControlFlow;
use std::path::Path;

/// Counts of the stored depth per metre: TUM's, a fifth of a millimetre.
const DEPTH_SCALE: f64 = 5000.0;

impl Simulator {
    /// Write all frames, the truth and the calibration as a recording at `path`, which must not
    /// exist or be empty. Depth is rounded to 1/5000 m; nothing else is lost.
    ///
    /// # Errors
    /// Those of the writer; the recording is then left as `<path>.partial`.
    pub fn write(&self, path: &Path) -> Result<()> {
        self.write_with(path, |_| ControlFlow::Continue(()))
    }

    /// Remove what [`Simulator::write_with`] left of a recording that was stopped.
    fn remove_partial(path: &Path) {
        let mut name = path.file_name().unwrap_or_default().to_os_string();
        name.push(".partial");
        // What cannot be removed is named by the next attempt to write here.
        let _ = std::fs::remove_dir_all(path.with_file_name(name));
    }

    /// [`Simulator::write`], telling the number of frames written after each; `progress` may break
    /// it off, and nothing is then left of the recording.
    ///
    /// # Errors
    /// As [`Simulator::write`].
    pub fn write_with(
        &self,
        path: &Path,
        mut progress: impl FnMut(usize) -> ControlFlow<()>,
    ) -> Result<()> {
        let mut writer = RecordingWriter::create(path, self.config.calibration()?)?;
        writer.set_truth(self.truth()?);
        for simulated in self.frames() {
            writer.push(&simulated?.frame)?;
            if progress(writer.len()).is_break() {
                drop(writer);
                Self::remove_partial(path);
                return Ok(());
            }
        }
        writer.finish()?;
        Ok(())
    }
}

impl SimConfig {
    /// The calibration that a perfect calibration of these sensors would find.
    ///
    /// # Errors
    /// Those of [`CalibrationFile::of_camera`].
    pub fn calibration(&self) -> Result<CalibrationFile> {
        let mut calibration = CalibrationFile::of_camera(&self.camera, DEPTH_SCALE)?;
        calibration.readout_s = (self.readout_s != 0.0).then_some(self.readout_s);
        calibration.gravity_in_world_m_s2 = Some(crate::sensors::GRAVITY_M_S2);
        if let Some(imu) = &self.imu {
            calibration.gravity_in_world_m_s2 = Some(imu.gravity_m_s2);
            calibration.camera_from_imu = Some(imu.camera_from_imu);
            calibration.imu_noise = Some(ImuNoise {
                gyroscope_noise_density: imu.gyroscope_noise_density,
                gyroscope_random_walk: imu.gyroscope_random_walk,
                accelerometer_noise_density: imu.accelerometer_noise_density,
                accelerometer_random_walk: imu.accelerometer_random_walk,
            });
        }
        Ok(calibration)
    }
}
