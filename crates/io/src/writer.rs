//! Writing recordings: a TUM folder with `imu.csv`, `mag.csv` and `calibration.toml`.

use crate::images::{Image, JPEG_QUALITY, encode, raw_from_metres};
use crate::recording::{imu_table, mag_table};
use crate::trajectory::write_tum;
use crate::{CalibrationFile, Error, Result, beside};
use sphereflow_core::{
    Error as CoreError, ImuSample, MagSample, Plane, RgbdFrame, Stamp, Trajectory,
};
use std::fs;
use std::path::{Path, PathBuf};

/// How colour images are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColourFormat {
    /// Without loss.
    #[default]
    Png,
    /// Smaller, but slower to write, and with the loss of quality 92.
    Jpeg,
}

impl ColourFormat {
    fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg => "jpg",
        }
    }
}

/// Writes a recording that [`crate::recording::open_recording`] reads back: depth rounded to counts
/// of the calibration's `depth_scale`, everything else as it was (colour too, as PNG).
///
/// Where the calibration has a depth correction, push what the camera measured: readers apply it.
///
/// Until [`RecordingWriter::finish`] the folder is called `<path>.partial`: a recording that was cut
/// short is recognisable, and its images are there under their stamps.
#[derive(Debug)]
pub struct RecordingWriter {
    path: PathBuf,
    partial: PathBuf,
    calibration: CalibrationFile,
    /// The camera sees all around: its frames have range, not depth.
    all_around: bool,
    colour_format: ColourFormat,
    stamps: Vec<Stamp>,
    has_colour: Vec<bool>,
    truth: Trajectory,
    imu: Vec<ImuSample>,
    mag: Vec<MagSample>,
}

impl RecordingWriter {
    /// Begin a recording at `path`, which must not exist or be an empty folder.
    ///
    /// # Errors
    /// [`Error::Content`] where `path` is a file or a folder with something in it, or a partial
    /// recording of the same name is there; [`Error::Calibration`] for a calibration that cannot
    /// be read back.
    pub fn create(path: &Path, calibration: CalibrationFile) -> Result<Self> {
        let occupied = match fs::read_dir(path) {
            Ok(mut entries) => entries.next().is_some(),
            Err(_) => path.exists(),
        };
        if occupied {
            return Err(Error::content(
                path,
                "a new or empty folder",
                "something in it",
            ));
        }
        let name = path
            .file_name()
            .ok_or_else(|| Error::content(path, "the name of a folder", "none"))?;
        let mut partial_name = name.to_os_string();
        partial_name.push(".partial");
        let partial = path.with_file_name(partial_name);
        if partial.exists() {
            let expected = "no recording in progress or cut short";
            return Err(Error::content(
                &partial,
                expected,
                "one: rename or remove it",
            ));
        }
        calibration.to_toml(path)?;
        for folder in ["rgb", "depth"] {
            let folder = partial.join(folder);
            fs::create_dir_all(&folder).map_err(Error::system(&folder, "make the folder"))?;
        }
        calibration.write(&partial.join("calibration.toml"))?;
        Ok(Self {
            path: path.to_path_buf(),
            partial,
            all_around: calibration.camera()?.wraps_around(),
            calibration,
            colour_format: ColourFormat::default(),
            stamps: Vec::new(),
            has_colour: Vec::new(),
            truth: Trajectory::new(),
            imu: Vec::new(),
            mag: Vec::new(),
        })
    }

    /// Store colour in this format from now on.
    #[must_use]
    pub fn with_colour_format(mut self, format: ColourFormat) -> Self {
        self.colour_format = format;
        self
    }

    /// Add a frame: its depth, its colour where it has one, and its samples. Colour and depth are
    /// encoded on two threads.
    ///
    /// # Errors
    /// [`Error::Core`] where the frame has no depth, is not of the camera's size, or its stamp or
    /// a sample's does not increase; [`Error::System`] where a file cannot be written.
    pub fn push(&mut self, frame: &RgbdFrame) -> Result<()> {
        if let Some(&last) = self.stamps.last() {
            check_order("frame.stamp", Some(last), frame.stamp, self.stamps.len())?;
        }
        let metres = self.distances(frame)?;
        if let Some(colour) = &frame.colour {
            self.check_size("frame.colour", colour.size())?;
        }
        let (imu, mag) = (self.imu.len(), self.mag.len());
        let added = self
            .push_imu(&frame.imu)
            .and_then(|()| self.push_mag(&frame.mag))
            .and_then(|()| self.write_images(frame.stamp, metres, frame.colour.as_ref()));
        if added.is_err() {
            self.imu.truncate(imu);
            self.mag.truncate(mag);
            return added;
        }
        self.stamps.push(frame.stamp);
        self.has_colour.push(frame.colour.is_some());
        Ok(())
    }

    /// Add inertial samples beside those of the frames (after the last frame, say).
    ///
    /// # Errors
    /// [`Error::Core`] where stamps do not increase; nothing is added then.
    pub fn push_imu(&mut self, samples: &[ImuSample]) -> Result<()> {
        let mut last = self.imu.last().map(|sample| sample.stamp);
        for (index, sample) in samples.iter().enumerate() {
            check_order("imu", last, sample.stamp, index)?;
            last = Some(sample.stamp);
        }
        self.imu.extend_from_slice(samples);
        Ok(())
    }

    /// Add magnetic samples beside those of the frames.
    ///
    /// # Errors
    /// [`Error::Core`] where stamps do not increase; nothing is added then.
    pub fn push_mag(&mut self, samples: &[MagSample]) -> Result<()> {
        let mut last = self.mag.last().map(|sample| sample.stamp);
        for (index, sample) in samples.iter().enumerate() {
            check_order("mag", last, sample.stamp, index)?;
            last = Some(sample.stamp);
        }
        self.mag.extend_from_slice(samples);
        Ok(())
    }

    /// The true poses, `world_from_camera`; any rate.
    pub fn set_truth(&mut self, truth: Trajectory) {
        self.truth = truth;
    }

    /// Frames so far.
    pub fn len(&self) -> usize {
        self.stamps.len()
    }

    /// True before the first frame.
    pub fn is_empty(&self) -> bool {
        self.stamps.is_empty()
    }

    /// Write the lists, the truth and the samples, and give the folder its name.
    ///
    /// # Errors
    /// [`Error::Content`] for a recording without frames, [`Error::System`] where a file cannot be
    /// written. The partial folder then stays.
    pub fn finish(self) -> Result<()> {
        if self.stamps.is_empty() {
            return Err(Error::content(
                &self.path,
                "a recording with frames",
                "none pushed",
            ));
        }
        let write =
            |name: &str, text: &str| beside::write_bytes(&self.partial.join(name), text.as_bytes());
        write("depth.txt", &self.list("depth", "png", |_| true))?;
        let extension = self.colour_format.extension();
        write(
            "rgb.txt",
            &self.list("rgb", extension, |index| self.has_colour[index]),
        )?;
        if !self.truth.is_empty() {
            let path = self.partial.join("groundtruth.txt");
            write_tum(&path, &self.truth, "ground truth, world_from_camera")?;
        }
        if !self.imu.is_empty() {
            write("imu.csv", &imu_table(&self.imu))?;
        }
        if !self.mag.is_empty() {
            write("mag.csv", &mag_table(&self.mag))?;
        }
        // An empty folder of the name may be there; rename replaces it only on some systems.
        let _ = fs::remove_dir(&self.path);
        fs::rename(&self.partial, &self.path)
            .map_err(Error::system(&self.path, "rename into place"))
    }

    fn list(&self, folder: &str, extension: &str, is_there: impl Fn(usize) -> bool) -> String {
        let rows = self
            .stamps
            .iter()
            .enumerate()
            .filter(|(index, _)| is_there(*index));
        let rows = rows.map(|(_, stamp)| format!("{stamp} {folder}/{stamp}.{extension}\n"));
        format!("# timestamp filename\n{}", rows.collect::<String>())
    }

    /// Depth of the frame, or range where the camera sees all around.
    fn distances<'a>(&self, frame: &'a RgbdFrame) -> Result<&'a Plane<f32>> {
        let (argument, metres) = if self.all_around {
            ("frame.range", frame.range.as_ref().map(|map| map.metres()))
        } else {
            ("frame.depth", frame.depth.as_ref().map(|map| map.metres()))
        };
        let metres = metres.ok_or_else(|| CoreError::value(argument, "a map", "none"))?;
        self.check_size(argument, metres.size())?;
        Ok(metres)
    }

    fn write_images(
        &self,
        stamp: Stamp,
        metres: &Plane<f32>,
        colour: Option<&Plane<[u8; 3]>>,
    ) -> Result<()> {
        let image_path = |folder: &str, extension: &str| {
            self.partial
                .join(folder)
                .join(format!("{stamp}.{extension}"))
        };
        let write = |path: PathBuf, image: Image| {
            fs::write(&path, encode(&path, &image, JPEG_QUALITY)?)
                .map_err(Error::system(&path, "write"))
        };
        let write_depth = || {
            let raw = raw_from_metres(metres, self.calibration.depth_scale)?;
            write(image_path("depth", "png"), Image::Grey16(raw))
        };
        let write_colour = || match colour {
            Some(plane) => {
                let path = image_path("rgb", self.colour_format.extension());
                write(path, Image::Rgb8(plane.clone()))
            }
            None => Ok(()),
        };
        let (depth_written, colour_written) = rayon::join(write_depth, write_colour);
        depth_written.and(colour_written)
    }

    fn check_size(&self, argument: &str, found: (usize, usize)) -> Result<()> {
        let expected = (self.calibration.depth.width, self.calibration.depth.height);
        if found == expected {
            return Ok(());
        }
        let text = |(width, height): (usize, usize)| format!("{width}x{height}");
        Err(CoreError::shape(argument, text(expected), text(found)).into())
    }
}

fn check_order(argument: &str, last: Option<Stamp>, stamp: Stamp, index: usize) -> Result<()> {
    match last {
        Some(earlier) if stamp <= earlier => Err(CoreError::TimeOrder {
            argument: argument.into(),
            earlier,
            later: stamp,
            index,
        }
        .into()),
        _ => Ok(()),
    }
}
