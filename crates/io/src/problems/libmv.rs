//! libmv's binary problems, as its refinement of camera motion writes them.
//!
//! `v` (little endian) or `V` (big), `P` (measurements in pixels); f, cx, cy, k1, k2, k3, p1, p2;
//! then counted lists of cameras (image, rotation by columns, translation), points (track,
//! position) and markers (image, track, x, y). Numbers are 32 bits wide; camera from world, RDF.

use crate::beside::write_bytes;
use crate::{Error, Result};
use nalgebra::{Matrix2, Matrix4, Vector2, Vector3};
use sphereflow_core::Pose;
use sphereflow_solver::bundle::BundleProblem;
use sphereflow_sphere::Camera;
use std::path::Path;

/// The file's own numbers of images and tracks, by our indices.
#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    images: Vec<i32>,
    tracks: Vec<i32>,
}

struct Reader<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
    big: bool,
}

impl Reader<'_> {
    fn word(&mut self, meaning: &str) -> Result<[u8; 4]> {
        let rest = self.bytes.get(self.at..).and_then(<[u8]>::first_chunk::<4>);
        let Some(word) = rest else {
            return Err(self.error(meaning, "the end of the file"));
        };
        self.at += 4;
        Ok(*word)
    }

    fn int(&mut self, meaning: &str) -> Result<i32> {
        let word = self.word(meaning)?;
        Ok(if self.big {
            i32::from_be_bytes(word)
        } else {
            i32::from_le_bytes(word)
        })
    }

    fn count(&mut self, meaning: &str) -> Result<usize> {
        let count = self.int(meaning)?;
        // every entry takes 16 bytes or more
        match usize::try_from(count) {
            Ok(count) if count <= self.bytes.len() / 16 => Ok(count),
            _ => Err(self.error(meaning, count)),
        }
    }

    fn floats<const N: usize>(&mut self, meaning: &str) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            let word = self.word(meaning)?;
            let float = if self.big {
                f32::from_be_bytes(word)
            } else {
                f32::from_le_bytes(word)
            };
            if !float.is_finite() {
                return Err(self.error(format!("{meaning} (finite numbers)"), float));
            }
            *value = f64::from(float);
        }
        Ok(values)
    }

    fn error(&self, expected: impl ToString, found: impl ToString) -> Error {
        let found = format!("{} before byte {}", found.to_string(), self.at);
        Error::content(self.path, expected, found)
    }
}

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<(BundleProblem, Names)> {
    let big = bytes.first() == Some(&b'V');
    let mut reader = Reader {
        path,
        bytes,
        at: 2,
        big,
    };
    if bytes.get(1) != Some(&b'P') {
        let found = bytes.get(1).map_or("the end".to_string(), |byte| {
            format!("`{}`", byte.escape_ascii())
        });
        return Err(reader.error("`P`: measurements in pixels", found));
    }
    let [f, cx, cy, k1, k2, k3, p1, p2] = reader.floats("intrinsics")?;
    let (width, height) = ((2.0 * cx).max(1.0) as usize, (2.0 * cy).max(1.0) as usize);
    let coefficients = [k1, k2, p1, p2, k3, 0.0, 0.0, 0.0];
    let mut problem = BundleProblem::new();
    problem.add_camera(Camera::opencv(f, f, cx, cy, coefficients, width, height)?);
    let mut names = Names::default();
    for _ in 0..reader.count("the number of cameras")? {
        names.images.push(reader.int("an image")?);
        let rotation: [f64; 9] = reader.floats("a rotation")?;
        let translation: [f64; 3] = reader.floats("a translation")?;
        let mut matrix = Matrix4::identity();
        for (k, value) in rotation.into_iter().enumerate() {
            matrix[(k % 3, k / 3)] = value;
        }
        for (k, value) in translation.into_iter().enumerate() {
            matrix[(k, 3)] = value;
        }
        let pose = Pose::from_matrix(&matrix).map_err(|error| reader.error("a pose", error))?;
        let added = problem.add_pose(pose.inverse(), 0);
        added.map_err(|error| reader.error("a pose", error))?;
    }
    for _ in 0..reader.count("the number of points")? {
        names.tracks.push(reader.int("a track")?);
        let position = Vector3::from(reader.floats::<3>("a point")?);
        let added = problem.add_point(position);
        added.map_err(|error| reader.error("a point", error))?;
    }
    add_markers(&mut reader, &mut problem, &names)?;
    Ok((problem, names))
}

fn add_markers(reader: &mut Reader<'_>, problem: &mut BundleProblem, names: &Names) -> Result<()> {
    let find = |all: &[i32]| {
        let mut sorted: Vec<(i32, usize)> = all.iter().copied().zip(0..).collect();
        sorted.sort_unstable();
        sorted
    };
    let (images, tracks) = (find(&names.images), find(&names.tracks));
    let index = |sorted: &[(i32, usize)], name: i32| {
        sorted
            .binary_search_by_key(&name, |entry| entry.0)
            .ok()
            .map(|k| sorted[k].1)
    };
    for _ in 0..reader.count("the number of markers")? {
        let (image, track) = (reader.int("an image")?, reader.int("a track")?);
        let [u, v] = reader.floats("a marker")?;
        // markers of images and tracks without a solution take no part, as in libmv
        if let (Some(pose), Some(point)) = (index(&images, image), index(&tracks, track)) {
            problem
                .add_pixel(pose, point, Vector2::new(u, v), &Matrix2::identity())
                .map_err(|error| reader.error("a marker", error))?;
        }
    }
    Ok(())
}

pub(super) fn write(path: &Path, problem: &BundleProblem, names: &Names) -> Result<()> {
    let mut bytes = b"vP".to_vec();
    let named = problem
        .camera(0)
        .map(Camera::named_parameters)
        .unwrap_or_default();
    let floats = |bytes: &mut Vec<u8>, values: &[f64]| {
        bytes.extend(values.iter().flat_map(|v| (*v as f32).to_le_bytes()));
    };
    for name in ["fx", "cx", "cy", "k1", "k2", "k3", "p1", "p2"] {
        let found = named.iter().find(|(other, _)| *other == name);
        floats(&mut bytes, &[found.map_or(0.0, |(_, value)| *value)]);
    }
    bytes.extend((names.images.len() as i32).to_le_bytes());
    for (pose, image) in names.images.iter().enumerate() {
        bytes.extend(image.to_le_bytes());
        let pose = problem.pose(pose).unwrap_or_default().inverse();
        floats(
            &mut bytes,
            pose.rotation.to_rotation_matrix().matrix().as_slice(),
        );
        floats(&mut bytes, pose.translation.as_slice());
    }
    bytes.extend((names.tracks.len() as i32).to_le_bytes());
    for (point, track) in names.tracks.iter().enumerate() {
        bytes.extend(track.to_le_bytes());
        floats(
            &mut bytes,
            problem.point(point).unwrap_or_default().as_slice(),
        );
    }
    bytes.extend((problem.observations() as i32).to_le_bytes());
    for (pose, point, pixel) in problem.pixels() {
        bytes.extend(names.images[pose].to_le_bytes());
        bytes.extend(names.tracks[point].to_le_bytes());
        floats(&mut bytes, pixel.as_slice());
    }
    write_bytes(path, &bytes)
}
