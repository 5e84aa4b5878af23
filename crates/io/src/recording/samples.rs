//! Tables of inertial and magnetic samples: `imu.csv`, `mag.csv`, TUM's `accelerometer.txt`.

use crate::rows::{Row, read_text, rows};
use crate::times::{self, Unit};
use crate::{Result, Warnings};
use nalgebra::Vector3;
use sphereflow_core::{ImuSample, MagSample, Stamp};
use std::fmt::Write;
use std::path::Path;

const UNKNOWN: Vector3<f64> = Vector3::new(f64::NAN, f64::NAN, f64::NAN);
const IMU_COLUMNS: &str = "ns, gyro x y z, accelerometer x y z";

/// Read `ns, gyro xyz (rad/s), accelerometer xyz (m/s^2)`: EuRoC's `imu0` and our `imu.csv`. A
/// sensor that the device lacks is `nan` throughout.
pub(super) fn read_imu(path: &Path, warnings: &mut Warnings) -> Result<Vec<ImuSample>> {
    read(
        path,
        warnings,
        Unit::Nanoseconds,
        |row, unit| {
            row.expect_columns(7, IMU_COLUMNS)?;
            Ok(ImuSample {
                stamp: row.stamp(0, unit)?,
                gyro_rad_s: vector_or_unknown(row, 1)?,
                accel_m_s2: vector_or_unknown(row, 4)?,
            })
        },
        |sample| sample.stamp,
    )
}

/// Read TUM's `accelerometer.txt`: seconds and specific force; the gyro is NaN.
pub(super) fn read_accelerometer(path: &Path, warnings: &mut Warnings) -> Result<Vec<ImuSample>> {
    read(
        path,
        warnings,
        Unit::Seconds,
        |row, unit| {
            row.expect_columns(4, "timestamp ax ay az")?;
            Ok(ImuSample {
                stamp: row.stamp(0, unit)?,
                gyro_rad_s: UNKNOWN,
                accel_m_s2: row.numbers(1)?.into(),
            })
        },
        |sample| sample.stamp,
    )
}

/// Read `mag.csv`: `ns, x, y, z` in microtesla.
pub(super) fn read_mag(path: &Path, warnings: &mut Warnings) -> Result<Vec<MagSample>> {
    read(
        path,
        warnings,
        Unit::Nanoseconds,
        |row, unit| {
            row.expect_columns(4, "ns, mag x y z")?;
            Ok(MagSample {
                stamp: row.stamp(0, unit)?,
                mag_ut: row.numbers(1)?.into(),
            })
        },
        |sample| sample.stamp,
    )
}

fn vector_or_unknown(row: &Row<'_>, column: usize) -> Result<Vector3<f64>> {
    let unknown = (column..column + 3).all(|c| row.text(c).eq_ignore_ascii_case("nan"));
    if unknown {
        return Ok(UNKNOWN);
    }
    row.numbers(column).map(Vector3::from)
}

/// Rows whose stamp does not increase are left out and counted.
fn read<T>(
    path: &Path,
    warnings: &mut Warnings,
    usual: Unit,
    parse: impl Fn(&Row<'_>, Unit) -> Result<T>,
    stamp_of: impl Fn(&T) -> Stamp,
) -> Result<Vec<T>> {
    let text = read_text(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut guesses = Warnings::default();
    let unit = times::unit(path, &text, 0, usual, &mut guesses);
    warnings.append(&name, guesses);
    let mut samples: Vec<T> = Vec::new();
    for row in rows(path, &text) {
        let sample = parse(&row, unit)?;
        let stamp = stamp_of(&sample);
        match samples.last().map(&stamp_of) {
            Some(last) if stamp <= last => {
                let what = if stamp == last {
                    "a repeated"
                } else {
                    "an unsorted"
                };
                let text = format!("{name}: sample with {what} stamp left out");
                warnings.add(&text, || {
                    format!("line {}: {stamp} s after {last} s", row.line)
                });
            }
            _ => samples.push(sample),
        }
    }
    Ok(samples)
}

/// The text of an `imu.csv`; every number reads back bit for bit, unknown ones as NaN.
pub(crate) fn imu_table(samples: &[ImuSample]) -> String {
    let mut text = String::from(
        "#timestamp [ns],gyro_x [rad/s],gyro_y,gyro_z,accel_x [m/s^2],accel_y,accel_z\n",
    );
    for sample in samples {
        let numbers = sample.gyro_rad_s.iter().chain(&sample.accel_m_s2);
        append_row(&mut text, sample.stamp, numbers);
    }
    text
}

/// The text of a `mag.csv`.
pub(crate) fn mag_table(samples: &[MagSample]) -> String {
    let mut text = String::from("#timestamp [ns],mag_x [uT],mag_y,mag_z\n");
    for sample in samples {
        append_row(&mut text, sample.stamp, sample.mag_ut.iter());
    }
    text
}

fn append_row<'a>(text: &mut String, stamp: Stamp, numbers: impl Iterator<Item = &'a f64>) {
    // Writing to a String cannot fail.
    let _ = write!(text, "{}", stamp.ns());
    for number in numbers {
        let _ = write!(text, ",{number:?}");
    }
    text.push('\n');
}
