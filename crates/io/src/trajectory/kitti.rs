//! KITTI trajectories: twelve numbers of a row-major 3x4 matrix, and times in a second file.

use super::order::{Builder, Order};
use super::pose_text::{append_shortest, check_finite};
use crate::rows::{Row, read_text, rows};
use crate::{Error, Result, beside};
use nalgebra::{Matrix3, Matrix4, Rotation3, UnitQuaternion, Vector3, Vector4};
use sphereflow_core::{Pose, Stamp, Trajectory};
use std::path::Path;

const COLUMNS: &str = "r11 r12 r13 tx r21 r22 r23 ty r31 r32 r33 tz";
const NS_PER_S: i64 = 1_000_000_000;

/// A block this near to orthonormal is turned into its quaternion directly; others (rounded to a
/// few digits) are first projected to SO(3).
const ORTHONORMAL_TOLERANCE: f64 = 5e-15;

/// One step of the search for a stable matrix: half the rounding of a number near 1.
const STEP: f64 = f64::EPSILON / 4.0;
/// How many steps from the pose's quaternion the search goes. A quarter of all matrices are
/// stable, and of 50 000 rotations all but a few had a stable one this near.
const MAX_STEPS: i32 = 4;
/// How long the walk of the few others may be; the longest of five million took 495 steps.
const MAX_WALK: usize = 4096;

/// Read a KITTI trajectory. `times` names a file with one time in seconds a row; without it there
/// is no time, and the stamps are the row's index in **seconds** (0 s, 1 s, 2 s, ...).
///
/// # Errors
/// As [`super::read_trajectory`]; also where the file of times has another number of rows.
pub fn read_kitti(path: &Path, times: Option<&Path>) -> Result<Trajectory> {
    read(path, times, Order::Strict)
}

pub(crate) fn read(path: &Path, times: Option<&Path>, order: Order<'_>) -> Result<Trajectory> {
    let text = read_text(path)?;
    let stamps = times.map(read_times).transpose()?;
    let mut builder = Builder::new(order);
    let mut count = 0;
    for (index, row) in rows(path, &text).enumerate() {
        row.expect_columns(12, COLUMNS)?;
        let stamp = match &stamps {
            Some(stamps) => stamps.get(index).copied().ok_or_else(|| {
                row.error(
                    format!("{} poses, one a time", stamps.len()),
                    "one pose more",
                )
            })?,
            None => Stamp::from_ns(NS_PER_S.saturating_mul(index as i64)),
        };
        builder.add(&row, pose_of(&row).map(|pose| (stamp, pose)))?;
        count = index + 1;
    }
    match stamps {
        Some(stamps) if stamps.len() != count => Err(Error::content(
            path,
            format!("{} poses, one a time", stamps.len()),
            format!("{count} poses"),
        )),
        _ => builder.finish(path),
    }
}

fn read_times(path: &Path) -> Result<Vec<Stamp>> {
    let text = read_text(path)?;
    rows(path, &text)
        .map(|row| {
            row.expect_columns(1, "a time in seconds")?;
            row.stamp_seconds(0)
        })
        .collect()
}

fn pose_of(row: &Row<'_>) -> Result<Pose> {
    let numbers: [f64; 12] = row.numbers(0)?;
    let mut matrix = Matrix4::identity();
    for (index, value) in numbers.iter().enumerate() {
        matrix[(index / 4, index % 4)] = *value;
    }
    let block: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    let gram = (block.transpose() * block - Matrix3::identity()).norm();
    if gram <= ORTHONORMAL_TOLERANCE && block.determinant() > 0.0 {
        let translation: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into_owned();
        return Ok(Pose::new(quaternion_of(&block), translation));
    }
    Pose::from_matrix(&matrix)
        .map_err(|_| row.error("a 3x4 rigid transform", format!("{numbers:?}")))
}

/// Normalised, so that going from matrix to quaternion again and again stays on the rotations.
fn quaternion_of(block: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let rotation = Rotation3::from_matrix_unchecked(*block);
    UnitQuaternion::new_normalize(UnitQuaternion::from_rotation_matrix(&rotation).into_inner())
}

fn matrix_of(rotation: &UnitQuaternion<f64>) -> Matrix3<f64> {
    rotation.to_rotation_matrix().into_inner()
}

/// The matrix that is written for a rotation: reading it and writing it again gives the same
/// matrix, bit for bit.
///
/// Going from a matrix to its quaternion and back rounds, so not every matrix survives. The first
/// that does is taken, beginning with the rotation's own and going on to those of quaternions a few
/// roundings away: what was read from it begins with it, and so keeps it. Where none is near, going
/// round and round from matrix to quaternion ends in a cycle, and its least member is a choice that
/// every member leads to.
fn stable_matrix(rotation: &UnitQuaternion<f64>) -> Matrix3<f64> {
    stable_near(rotation).unwrap_or_else(|| {
        let chosen = least_of_cycle(matrix_of(rotation));
        stable_near(&quaternion_of(&chosen)).unwrap_or(chosen)
    })
}

fn stable_near(rotation: &UnitQuaternion<f64>) -> Option<Matrix3<f64>> {
    (0..=MAX_STEPS)
        .flat_map(shell)
        .map(|steps| {
            let moved = rotation.coords + steps.map(|n| STEP * f64::from(n));
            matrix_of(&UnitQuaternion::new_unchecked(moved.into()))
        })
        .find(|matrix| same_bits(matrix, &matrix_of(&quaternion_of(matrix))))
}

fn least_of_cycle(start: Matrix3<f64>) -> Matrix3<f64> {
    let mut seen = vec![start];
    let mut last = start;
    while seen.len() < MAX_WALK {
        let next = matrix_of(&quaternion_of(&last));
        if let Some(first) = seen.iter().position(|known| same_bits(known, &next)) {
            let bits = |matrix: &Matrix3<f64>| matrix.map(f64::to_bits);
            let cycle = seen[first..].iter();
            let least = cycle.min_by(|a, b| bits(a).iter().cmp(bits(b).iter()));
            return *least.unwrap_or(&next);
        }
        seen.push(next);
        last = next;
    }
    last
}

/// The steps in four directions of which the longest is `radius`.
fn shell(radius: i32) -> impl Iterator<Item = Vector4<i32>> {
    let side = 2 * radius + 1;
    (0..side.pow(4))
        .map(move |n| Vector4::from_fn(|k, _| n / side.pow(k as u32) % side - radius))
        .filter(move |steps| steps.amax() == radius)
}

fn same_bits(a: &Matrix3<f64>, b: &Matrix3<f64>) -> bool {
    a.iter().zip(b).all(|(x, y)| x.to_bits() == y.to_bits())
}

/// Write a KITTI trajectory, without its time (see [`write_kitti_times`]).
///
/// The translation reads back bit for bit. The rotation is written as the matrix of a quaternion
/// within 1e-15 of the pose's (of 100 000 rotations a few: 4e-15), chosen so that a file that was
/// read and is written again is
/// the same file, and reads back the same poses, bit for bit.
///
/// # Errors
/// As [`super::write_trajectory`].
pub fn write_kitti(path: &Path, trajectory: &Trajectory) -> Result<()> {
    let mut text = String::with_capacity(260 * trajectory.len());
    for (stamp, pose) in trajectory.iter() {
        check_finite(stamp, pose)?;
        let block = stable_matrix(&pose.rotation);
        for row in 0..3 {
            for column in 0..3 {
                append_shortest(&mut text, ' ', block[(row, column)]);
            }
            append_shortest(&mut text, ' ', pose.translation[row]);
        }
        text.push('\n');
    }
    // Every number has its separator before it; a row begins without one.
    let text = text.trim_start().replace("\n ", "\n");
    beside::write_bytes(path, text.as_bytes())
}

/// Write the stamps of a trajectory, one a row in seconds with nine decimals: the companion of a
/// KITTI file.
///
/// # Errors
/// [`Error::System`] where the file cannot be written.
pub fn write_kitti_times(path: &Path, trajectory: &Trajectory) -> Result<()> {
    let rows: Vec<String> = trajectory
        .stamps()
        .iter()
        .map(|stamp| format!("{stamp}\n"))
        .collect();
    beside::write_bytes(path, rows.concat().as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Quaternion;

    const ROTATIONS: usize = 50_000;
    /// The few that have no stable matrix near walk some roundings far.
    const DRIFT: f64 = 4e-15;

    /// A number in -0.5..0.5 from a linear congruence: the same rotations in every run.
    fn next_number(state: &mut u64) -> f64 {
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    #[test]
    fn stable_matrix_of_its_own_quaternion_is_itself() {
        let mut state = 1;
        let mut farthest = 0.0_f64;
        for _ in 0..ROTATIONS {
            let [w, x, y, z] = std::array::from_fn(|_| next_number(&mut state));
            let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
            let written = stable_matrix(&rotation);
            assert!(same_bits(
                &written,
                &stable_matrix(&quaternion_of(&written))
            ));
            farthest = farthest.max((written - matrix_of(&rotation)).abs().max());
        }
        println!("farthest matrix element from the pose's own: {farthest:.1e}");
        assert!(farthest < DRIFT, "{farthest}");
    }
}
