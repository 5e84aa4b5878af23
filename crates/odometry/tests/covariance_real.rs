//! The covariance of real cameras: errors against what was claimed, moving and standing still.
//!
//! They run where `SPHEREFLOW_DATA` names the folder of the recordings, and print their figures:
//! `cargo test -p sphereflow-odometry --release --test covariance_real -- --nocapture`.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod drift;

use drift::{Run, open, run};
use nalgebra::{Matrix6, Vector6};
use sphereflow_alignment::{Config, VelocityEstimator};
use sphereflow_core::{DepthMap, Plane, Reason, TrackStatus};
use sphereflow_odometry::OdometryConfig;
use sphereflow_sphere::Camera;
use sphereflow_sphere::lie::se3;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the median of six squared errors over their variances may be: 5.3 is ideal.
const HONEST: std::ops::Range<f64> = 2.0..12.0;

/// Error of a pose relative to its keyframe, and the covariance claimed.
struct Claim {
    frame: usize,
    error: Vector6<f64>,
    covariance: Matrix6<f64>,
}

impl Claim {
    fn normalised(&self) -> f64 {
        self.error
            .dot(&(self.covariance.try_inverse().unwrap() * self.error))
    }
}

/// All frames measured against a keyframe, where the truth of both is known.
fn claims(run: &Run) -> Vec<Claim> {
    let mut claims = Vec::new();
    let (mut last, mut keyframe) = (None, (usize::MAX, None));
    for (i, result) in run.results.iter().enumerate() {
        if let Some(motion) = &result.keyframe_motion {
            if motion.keyframe != keyframe.0 {
                // A keyframe is made of the frame measured before this one.
                keyframe = (motion.keyframe, last);
            }
            let truth = keyframe
                .1
                .and_then(|k: usize| run.truth[k])
                .zip(run.truth[i]);
            if let Some((from, to)) = truth {
                let true_motion = from.inverse() * to;
                claims.push(Claim {
                    frame: i,
                    error: se3::log(&(true_motion * motion.keyframe_from_camera.inverse())),
                    covariance: motion.covariance,
                });
            }
        }
        let starts = matches!(
            result.status,
            TrackStatus::Started | TrackStatus::Lost(Reason::Gap { .. })
        );
        if starts || result.keyframe_motion.is_some() {
            last = Some(i);
        }
    }
    claims
}

fn quantiles(mut values: Vec<f64>) -> (f64, f64, f64) {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
    (
        at(0.5),
        at(0.9),
        values.iter().sum::<f64>() / values.len() as f64,
    )
}

/// Median of the normalised errors of the recording and of both its halves.
fn medians(name: &str, claims: &[Claim]) -> [f64; 3] {
    let middle = claims[claims.len() / 2].frame;
    let parts = [
        ("all", 0..usize::MAX),
        ("first half", 0..middle),
        ("second half", middle..usize::MAX),
    ];
    parts.map(|(part, frames)| {
        let chosen = claims.iter().filter(|c| frames.contains(&c.frame));
        let errors: Vec<f64> = chosen.map(Claim::normalised).collect();
        let count = errors.len();
        let (median, ninety, mean) = quantiles(errors);
        println!("{name}, {part}: {count} poses, squared error over covariance: median {median:.2}, 90 % {ninety:.1}, mean {mean:.1} (5.3, 10.6, 6 are ideal)");
        median
    })
}

/// Thesis: section 6.4: "the covariance of the result", of a real camera.
#[test]
fn tum_rpy_keyframe_covariance_is_honest() {
    let Some(recording) = open("tum-fr1-rpy-a") else {
        return;
    };
    let config = OdometryConfig {
        readout_s: 0.03,
        ..OdometryConfig::default()
    };
    let all = medians("tum fr1_rpy", &claims(&run(&recording, config)));
    assert!(all.iter().all(|median| HONEST.contains(median)), "{all:?}");
}

#[test]
fn seven_scenes_kitchen_keyframe_covariance_is_honest() {
    let Some(recording) = open("sevenscenes-kitchen-a") else {
        return;
    };
    let config = OdometryConfig::default();
    let all = medians("kitchen", &claims(&run(&recording, config)));
    assert!(all.iter().all(|median| HONEST.contains(median)), "{all:?}");
}

/// A folder that is removed at the end.
struct Unpacked(PathBuf);

impl Drop for Unpacked {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// The raw recording of a Kinect that stands still, unpacked.
fn unpack() -> Option<Unpacked> {
    let Some(root) = std::env::var_os("SPHEREFLOW_DATA") else {
        println!("skipped: SPHEREFLOW_DATA is not set");
        return None;
    };
    let archive = Path::new(&root).join("kinect1-fakenect/fakenect-record-120.tar.xz");
    let name = format!("sphereflow-standstill-{}", std::process::id());
    let folder = Unpacked(std::env::temp_dir().join(name));
    std::fs::create_dir_all(&folder.0).unwrap();
    let tar = Command::new("tar")
        .arg("xf")
        .arg(&archive)
        .arg("-C")
        .arg(&folder.0)
        .status();
    if !tar.as_ref().is_ok_and(|status| status.success()) {
        println!(
            "skipped: tar could not unpack {}: {tar:?}",
            archive.display()
        );
        return None;
    }
    Some(folder)
}

/// Disparity to depth: the usual linear calibration of the inverse depth; 2047 is no reading.
fn depth(path: &Path) -> DepthMap {
    let bytes = std::fs::read(path).unwrap();
    let header = b"P5 640 480 65535\n";
    assert!(bytes.starts_with(header), "{}", path.display());
    let raw = bytes[header.len()..].chunks_exact(2);
    let metres = raw.map(|b| match u16::from_le_bytes([b[0], b[1]]) {
        2047 => f32::NAN,
        d => (1.0 / (-0.0030711016 * f64::from(d) + 3.3309495161)) as f32,
    });
    DepthMap::new(Plane::from_vec(640, 480, metres.collect()).unwrap())
}

/// Stamp of the device's 60 MHz clock, from the file's name.
fn ticks(path: &Path) -> f64 {
    let name = path.file_stem().unwrap().to_str().unwrap();
    name.rsplit('-').next().unwrap().parse().unwrap()
}

/// Nothing moves in the first 28 images.
#[test]
fn kinect_standing_still_has_no_velocity_within_its_covariance() {
    const STILL: usize = 28;
    const TICKS_PER_S: f64 = 6e7;
    let Some(folder) = unpack() else { return };
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder.0.join("fakenect-record"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "pgm"))
        .collect();
    files.sort();
    // The usual focal length of the infrared camera; standing still, it hardly matters.
    let camera = Camera::pinhole(585.0, 585.0, 319.5, 239.5, 640, 480).unwrap();
    let mut estimator = VelocityEstimator::new(&camera, Config::default()).unwrap();
    let (mut errors, mut speeds, mut rates) = (Vec::new(), Vec::new(), Vec::new());
    let mut sum = Vector6::zeros();
    for pair in files[..STILL].windows(2) {
        let dt_s = (ticks(&pair[1]) - ticks(&pair[0])) / TICKS_PER_S;
        let found = estimator
            .estimate(&depth(&pair[0]), &depth(&pair[1]), dt_s)
            .unwrap();
        assert!(
            found.status.has_pose(),
            "{}: {}",
            pair[1].display(),
            found.status
        );
        let (twist, covariance) = (found.twist.unwrap(), found.covariance.unwrap());
        let x = twist.vector();
        sum += x * dt_s;
        errors.push(x.dot(&(covariance.try_inverse().unwrap() * x)));
        speeds.push(twist.linear_m_s.norm());
        rates.push(twist.angular_rad_s.norm());
    }
    let largest = errors.iter().copied().fold(0.0, f64::max);
    let ((speed, ..), (rate, ..), (median, ..)) =
        (quantiles(speeds), quantiles(rates), quantiles(errors));
    println!(
        "standing still: median {speed:.4} m/s, {rate:.4} rad/s; squared over covariance: median {median:.3}, largest {largest:.2}; sum of all motions {:.4} m",
        sum.fixed_rows::<3>(3).norm()
    );
    // 99.9 % of a chi square of six degrees
    assert!(largest < 22.5, "{largest}");
    assert!(median < 12.0, "{median}");
}
