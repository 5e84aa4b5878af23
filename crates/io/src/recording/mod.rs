//! Recordings: folders of RGB-D frames, inertial samples and truth, behind one interface.
//!
//! [`open_recording`] reads the index, the truth and the inertial samples, and checks them; images
//! are decoded when asked for ([`Recording::frame`]) or ahead of time ([`Recording::stream`]).

mod association;
mod calibrate;
mod euroc;
mod index;
mod open;
mod samples;
mod scale_check;
mod seven_scenes;
mod stream;
mod sync;
mod tum;

pub use open::{OpenOptions, open_recording};
pub(crate) use samples::{imu_table, mag_table};
pub use stream::FrameStream;
pub use sync::SyncStatistics;

use crate::images::{depth_from_raw, range_from_raw, read_colour, read_raw_depth};
use crate::{CalibrationFile, Error, Result, Warnings};
use nalgebra::Vector3;
use sphereflow_core::{
    Error as CoreError, ImuSample, MagSample, Plane, RgbdFrame, Stamp, Trajectory,
};
use sphereflow_sphere::{Camera, DepthCorrector};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// What kind of folder a recording is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordingKind {
    /// TUM RGB-D: `rgb.txt`, `depth.txt`, `groundtruth.txt`, `accelerometer.txt`; also our own
    /// recordings, which add `imu.csv`, `mag.csv` and `calibration.toml`.
    TumRgbd,
    /// 7-Scenes: `frame-NNNNNN.{color,depth,pose}.*`.
    SevenScenes,
    /// EuRoC: inertial samples and truth only.
    EurocImu,
}

impl fmt::Display for RecordingKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TumRgbd => "TUM RGB-D",
            Self::SevenScenes => "7-Scenes",
            Self::EurocImu => "EuRoC (inertial only)",
        })
    }
}

/// Where the images of one frame are.
#[derive(Clone, Debug)]
struct FrameFiles {
    depth: PathBuf,
    colour: Option<PathBuf>,
}

/// A camera with the calibration it comes from.
#[derive(Debug)]
struct Calibrated {
    calibration: CalibrationFile,
    camera: Camera,
    /// Where the calibration has a correction of depth.
    corrector: Option<DepthCorrector>,
    source: String,
}

/// What the openers of the kinds put together.
#[derive(Debug)]
struct Contents {
    kind: RecordingKind,
    path: PathBuf,
    stamps: Vec<Stamp>,
    files: Vec<FrameFiles>,
    calibrated: Option<Calibrated>,
    colour_registered: bool,
    truth: Option<Trajectory>,
    imu: Vec<ImuSample>,
    mag: Vec<MagSample>,
    gravity_in_world: Option<Vector3<f64>>,
    sync: Option<SyncStatistics>,
    warnings: Warnings,
    /// What is found when colour images are decoded.
    colour_warnings: Mutex<Warnings>,
    notes: Vec<String>,
}

/// An opened recording. Cloning shares it.
#[derive(Clone, Debug)]
pub struct Recording(Arc<Contents>);

impl Recording {
    /// What kind of folder it is.
    pub fn kind(&self) -> RecordingKind {
        self.0.kind
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.0.path
    }

    /// Number of frames; 0 for inertial recordings.
    pub fn len(&self) -> usize {
        self.0.files.len()
    }

    /// True without frames.
    pub fn is_empty(&self) -> bool {
        self.0.files.is_empty()
    }

    /// Stamps of the frames, increasing: those of the depth images.
    pub fn stamps(&self) -> &[Stamp] {
        &self.0.stamps
    }

    /// The camera of the depth images; `None` for inertial recordings.
    pub fn camera(&self) -> Option<&Camera> {
        self.0.calibrated.as_ref().map(|known| &known.camera)
    }

    /// The calibration that the camera is of; `None` for inertial recordings.
    pub fn calibration(&self) -> Option<&CalibrationFile> {
        self.0.calibrated.as_ref().map(|known| &known.calibration)
    }

    /// What is known of the device, with the colour camera where it is registered. `None` without
    /// images. The frames' depth is already corrected by its field.
    ///
    /// # Errors
    /// None in practice: the calibration was checked when it was read.
    pub fn device(&self) -> Result<Option<CalibrationFile>> {
        let Some(known) = self.0.calibrated.as_ref() else {
            return Ok(None);
        };
        let mut file = known.calibration.clone();
        if self.colour_registered() && file.colour.is_none() {
            file.colour = Some(file.depth.clone());
            file.colour_from_depth = Some(sphereflow_core::Pose::identity());
        }
        Ok(Some(file))
    }

    /// Which calibration that is, and where it comes from.
    pub fn calibration_source(&self) -> String {
        match &self.0.calibrated {
            Some(known) => known.source.clone(),
            None => "none: the recording has no images".into(),
        }
    }

    /// Counts of the depth images per metre; `None` for inertial recordings.
    pub fn depth_scale(&self) -> Option<f64> {
        self.calibration()
            .map(|calibration| calibration.depth_scale)
    }

    /// Rolling shutter: read-out time in seconds, 0 where the calibration gives none; see
    /// [`CalibrationFile::readout_s`].
    pub fn readout_s(&self) -> f64 {
        let calibration = self.calibration();
        calibration.and_then(|c| c.readout_s).unwrap_or(0.0)
    }

    /// True where the calibration corrects depth: the frames' depth is then not the stored one.
    pub fn depth_corrected(&self) -> bool {
        let known = self.0.calibrated.as_ref();
        known.is_some_and(|known| known.corrector.is_some())
    }

    /// True poses. TUM: world from the colour camera's optical frame. 7-Scenes: world from depth
    /// camera. EuRoC: world from body, the body being the IMU.
    pub fn truth(&self) -> Option<&Trajectory> {
        self.0.truth.as_ref()
    }

    /// All inertial samples, stamps increasing, on the recording's own clock; an accelerometer
    /// alone has NaN for the gyro.
    pub fn imu(&self) -> &[ImuSample] {
        &self.0.imu
    }

    /// All magnetic samples, stamps increasing.
    pub fn mag(&self) -> &[MagSample] {
        &self.0.mag
    }

    /// True where colour and depth pixels see the same points (7-Scenes: they do not).
    pub fn colour_registered(&self) -> bool {
        self.0.colour_registered
    }

    /// Gravity in the world of the truth, m/s^2, pointing down, where that is known.
    pub fn gravity_in_world(&self) -> Option<Vector3<f64>> {
        self.0.gravity_in_world
    }

    /// How far the stamps of colour and depth are apart; `None` where no frame has colour or the
    /// recording has no time.
    pub fn sync(&self) -> Option<&SyncStatistics> {
        self.0.sync.as_ref()
    }

    /// What was left out or looks wrong, counted; what is found when frames are read comes last.
    pub fn warnings(&self) -> Warnings {
        let mut all = self.0.warnings.clone();
        all.extend(
            &self
                .0
                .colour_warnings
                .lock()
                .unwrap_or_else(PoisonError::into_inner),
        );
        all
    }

    /// Says what becomes of the colour images, by the first.
    fn look_at_colour(&self) {
        let first = self
            .0
            .files
            .iter()
            .find_map(|files| files.colour.as_deref());
        if let (Some(path), Some(camera)) = (first, self.camera()) {
            self.colour_of(path, (camera.width(), camera.height()));
        }
    }

    /// The colour image at the size of the depth image, or none, with a warning: depth needs no
    /// colour.
    fn colour_of(&self, path: &Path, size: (usize, usize)) -> Option<Plane<[u8; 3]>> {
        let warn = |text: &str, first: String| {
            let lock = self.0.colour_warnings.lock();
            let mut warnings = lock.unwrap_or_else(PoisonError::into_inner);
            warnings.add(text, || first);
        };
        let read = match read_colour(path) {
            Ok(read) => read,
            Err(error) => {
                warn(
                    "colour image left out: it cannot be read",
                    error.to_string(),
                );
                return None;
            }
        };
        if read.size() == size {
            return Some(read);
        }
        let (width, height) = read.size();
        let found = format!(
            "{}: {width}x{height} pixels, depth {}x{}",
            path.display(),
            size.0,
            size.1
        );
        if width * size.1 != height * size.0 {
            warn("colour left out: its shape is not that of depth", found);
            return None;
        }
        warn("colour resampled to the size of depth", found);
        resampled(&read, size)
    }

    /// What one should know that is not wrong (nominal stamps, frames of the truth, ...).
    pub fn notes(&self) -> &[String] {
        &self.0.notes
    }

    /// Read frame `index`: decode its images and collect the samples after the previous frame's
    /// stamp, up to its own (the first frame has all samples up to its stamp).
    ///
    /// # Errors
    /// [`Error::Core`] where `index` is not below [`Recording::len`]; [`Error::Content`] naming
    /// the depth image that is corrupt or of another size than the camera's. Colour that cannot be
    /// used is left out, with a warning.
    pub fn frame(&self, index: usize) -> Result<RgbdFrame> {
        let inside = self.0.files.get(index).zip(self.0.stamps.get(index));
        let (Some((files, &stamp)), Some(known)) = (inside, &self.0.calibrated) else {
            let expected = format!("a frame index below {}", self.len());
            return Err(CoreError::value("index", expected, index).into());
        };
        let raw = read_raw_depth(&files.depth)?;
        let size = (known.camera.width(), known.camera.height());
        check_size(&files.depth, size, raw.size())?;
        let colour = files.colour.as_deref();
        let colour = colour.and_then(|path| self.colour_of(path, size));
        let scale = known.calibration.depth_scale;
        let (depth, range) = if known.camera.wraps_around() {
            (None, Some(range_from_raw(&raw, scale)?))
        } else {
            let depth = depth_from_raw(&raw, scale)?;
            let depth = match &known.corrector {
                Some(corrector) => corrector.apply(depth)?,
                None => depth,
            };
            (Some(depth), None)
        };
        let before = index.checked_sub(1).map(|previous| self.0.stamps[previous]);
        Ok(RgbdFrame {
            stamp,
            colour,
            depth,
            range,
            imu: between(&self.0.imu, |sample| sample.stamp, before, stamp).to_vec(),
            mag: between(&self.0.mag, |sample| sample.stamp, before, stamp).to_vec(),
            ..RgbdFrame::default()
        })
    }
}

/// The image at another size of the same shape: the nearest pixel of each.
fn resampled(image: &Plane<[u8; 3]>, size: (usize, usize)) -> Option<Plane<[u8; 3]>> {
    let (width, height) = image.size();
    let nearest = |k: usize, to: usize, from: usize| ((2 * k + 1) * from / (2 * to)).min(from - 1);
    let pixels = (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y)));
    let pixels = pixels.map(|(x, y)| {
        let (column, row) = (nearest(x, size.0, width), nearest(y, size.1, height));
        image.data()[row * width + column]
    });
    Plane::from_vec(size.0, size.1, pixels.collect()).ok()
}

fn check_size(path: &Path, camera: (usize, usize), image: (usize, usize)) -> Result<()> {
    if camera == image {
        return Ok(());
    }
    Err(Error::content(
        path,
        format!("an image of the camera's {}x{} pixels", camera.0, camera.1),
        format!("{}x{}", image.0, image.1),
    ))
}

/// The samples with `before < stamp <= until`; all up to `until` where there is no `before`.
fn between<T>(
    samples: &[T],
    stamp_of: impl Fn(&T) -> Stamp,
    before: Option<Stamp>,
    until: Stamp,
) -> &[T] {
    let start = match before {
        Some(before) => samples.partition_point(|sample| stamp_of(sample) <= before),
        None => 0,
    };
    let end = samples.partition_point(|sample| stamp_of(sample) <= until);
    samples.get(start..end).unwrap_or(&[])
}
