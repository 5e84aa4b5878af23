//! Published calibrations of the TUM RGB-D benchmark's cameras (Sturm et al., IROS 2012).

use super::CalibrationFile;

/// Counts per metre of TUM depth images.
const TUM_DEPTH_SCALE: f64 = 5000.0;
/// The size of the images that the published figures are for.
const TUM_SIZE: (usize, usize) = (640, 480);

/// The calibration of the colour camera of `freiburg1`, `2` or `3`. Depth is registered to the
/// distorted colour image, so the distortion holds for both.
pub(crate) fn published(freiburg: u8) -> Option<CalibrationFile> {
    let numbers: &[f64] = match freiburg {
        1 => &[
            517.306408, 516.469215, 318.643040, 255.313989, 0.262383, -0.953104, -0.005358,
            0.002628, 1.163314,
        ],
        2 => &[
            520.908620, 521.007327, 325.141442, 249.701764, 0.231222, -0.784899, -0.003257,
            -0.000105, 0.917205,
        ],
        3 => &[535.4, 539.2, 320.1, 247.6],
        _ => return None,
    };
    let names = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"];
    let named: Vec<(&str, f64)> = names.into_iter().zip(numbers.iter().copied()).collect();
    let model = if numbers.len() > 4 {
        "opencv"
    } else {
        "pinhole"
    };
    Some(CalibrationFile::of_model(
        model,
        &named,
        TUM_SIZE,
        TUM_DEPTH_SCALE,
    ))
}

/// The ROS driver's default for a Kinect nobody calibrated.
pub(crate) fn ros_default() -> CalibrationFile {
    let named = [("fx", 525.0), ("fy", 525.0), ("cx", 319.5), ("cy", 239.5)];
    CalibrationFile::of_model("pinhole", &named, TUM_SIZE, TUM_DEPTH_SCALE)
}
