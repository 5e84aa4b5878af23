//! A range map seen from another camera: its pixels as a net of triangles, the nearest one wins.

use super::{Warp, check_share};
use crate::Camera;
use crate::range::check_size;
use nalgebra::Vector3;
use rayon::prelude::*;
use sphereflow_core::{Plane, RangeMap, Result};
use std::sync::atomic::{AtomicU32, Ordering};

/// What a destination pixel sees: `(bits of the range in f32) << 1`, plus 1 for the back of a
/// surface. Ranges are positive, so the order of these numbers is that of the ranges; and the
/// least of a set does not depend on the order in which threads offer it.
const NOTHING: u32 = u32::MAX;

/// A ray this far outside of a triangle, as a share of the triangle, still meets it: rounding must
/// not open gaps between triangles, least of all where a ray goes through a corner.
const GAP: f64 = 1e-9;

/// Pixels are looked for beyond the corners of a projected triangle by this share of its size,
/// since its sides are curved in images other than a pinhole's.
const BULGE: f64 = 0.1;

/// A triangle over more than this share of a 360-degree image's columns lies around or beside a
/// pole, where its sides bulge by more than that.
const POLAR: f64 = 0.125;

impl Warp {
    /// The range map of the destination view that the source's range map implies.
    ///
    /// Neighbouring source pixels span triangles, and each destination ray takes its nearest
    /// intersection: exact where the scene is plane between the pixels. Triangles whose ranges
    /// spread by more than `jump` (a share of the least; 0.12 is usual) are depth jumps and not
    /// spanned. Unknown (NaN) is what no triangle covers, and what lies behind the *back* of a
    /// surface: the source has not seen what is there.
    ///
    /// # Errors
    /// [`Error::Shape`](sphereflow_core::Error::Shape) where the map has not the size of the source
    /// image; [`Error::Value`](sphereflow_core::Error::Value) for a jump that is negative or not
    /// finite.
    pub fn render_range(&self, src_range: &RangeMap, jump: f64) -> Result<RangeMap> {
        check_size("src_range", src_range.size(), &self.src)?;
        check_share("jump", jump)?;
        let vertices = self.vertices(src_range);
        let nearest: Vec<_> = (0..self.dst_rays.len())
            .map(|_| AtomicU32::new(NOTHING))
            .collect();
        let target = Target {
            camera: &self.dst,
            rays: &self.dst_rays,
            nearest: &nearest,
        };
        let (width, height) = src_range.size();
        let columns = if self.src.wraps_around() {
            width
        } else {
            width - 1
        };
        (0..height - 1).into_par_iter().for_each(|y| {
            for x in 0..columns {
                let right = (x + 1) % width;
                let (top, bottom) = (y * width, (y + 1) * width);
                let [a, b, c, d] = [top + x, top + right, bottom + right, bottom + x]
                    .map(|index| &vertices[index]);
                target.draw([a, b, c], jump);
                target.draw([a, c, d], jump);
            }
        });
        if self.src.wraps_around() {
            target.draw_caps(&vertices, width, jump);
        }
        let metres = nearest
            .iter()
            .map(|seen| seen_range(seen.load(Ordering::Relaxed)));
        let plane = Plane::from_vec(self.dst.width(), self.dst.height(), metres.collect())?;
        Ok(RangeMap::new(plane))
    }

    fn vertices(&self, src_range: &RangeMap) -> Vec<Vertex> {
        let rotation = self.dst_from_src.rotation.to_rotation_matrix();
        let ranges = src_range.metres().data().par_iter();
        let vertices = ranges.zip(&self.src_rays).map(|(range, ray)| {
            let point = rotation * ray * f64::from(*range) + self.dst_from_src.translation;
            let known = point.iter().all(|v| v.is_finite());
            let pixel = known.then(|| self.dst.project(&point)).flatten();
            Vertex {
                point,
                range: f64::from(*range),
                pixel: pixel.map(|p| [p.x, p.y]),
            }
        });
        vertices.collect()
    }
}

fn seen_range(seen: u32) -> f32 {
    if seen == NOTHING || seen & 1 == 1 {
        return f32::NAN;
    }
    f32::from_bits(seen >> 1)
}

/// A source pixel in the destination's frame; without a pixel there where it is not seen.
struct Vertex {
    point: Vector3<f64>,
    range: f64,
    pixel: Option<[f64; 2]>,
}

/// What is drawn on.
struct Target<'a> {
    camera: &'a Camera,
    rays: &'a [Vector3<f64>],
    nearest: &'a [AtomicU32],
}

impl Target<'_> {
    /// Closes the holes, half a pixel wide, around the poles of a 360-degree source: fans of
    /// triangles over the first and the last row.
    fn draw_caps(&self, vertices: &[Vertex], width: usize, jump: f64) {
        let (first, last) = (&vertices[..width], &vertices[vertices.len() - width..]);
        for x in 1..width - 1 {
            self.draw([&first[0], &first[x + 1], &first[x]], jump);
            self.draw([&last[0], &last[x], &last[x + 1]], jump);
        }
    }

    /// Draws a triangle whose corners run clockwise as the source sees them.
    fn draw(&self, corners: [&Vertex; 3], jump: f64) {
        let [a, b, c] = corners;
        let (Some(pa), Some(pb), Some(pc)) = (a.pixel, b.pixel, c.pixel) else {
            return;
        };
        let least = a.range.min(b.range).min(c.range);
        if a.range.max(b.range).max(c.range) - least > jump * least {
            return;
        }
        let normals = [
            a.point.cross(&b.point),
            b.point.cross(&c.point),
            c.point.cross(&a.point),
        ];
        let volume = normals[0].dot(&c.point);
        if volume == 0.0 {
            return;
        }
        let triangle = Triangle { normals, volume };
        let (columns, rows) = self.extent([pa, pb, pc]);
        let width = self.camera.width() as i64;
        for y in rows.0.max(0)..=rows.1.min(self.camera.height() as i64 - 1) {
            for x in columns.0..=columns.1 {
                let index = (y * width + x.rem_euclid(width)) as usize;
                if let Some(range) = triangle.meets(&self.rays[index]) {
                    let back = u32::from(volume < 0.0);
                    let seen = ((range as f32).to_bits() << 1) | back;
                    self.nearest[index].fetch_min(seen, Ordering::Relaxed);
                }
            }
        }
    }

    /// Columns and rows, first and last, among which the triangle's pixels are.
    fn extent(&self, pixels: [[f64; 2]; 3]) -> ((i64, i64), (i64, i64)) {
        let width = self.camera.width() as f64;
        let mut x = pixels.map(|p| p[0]);
        if self.camera.wraps_around() {
            // Corners on both sides of the seam: count on beyond it.
            for k in 1..3 {
                x[k] -= width * ((x[k] - x[0]) / width).round();
            }
        }
        let (left, right) = least_and_largest(x);
        let (top, bottom) = least_and_largest(pixels.map(|p| p[1]));
        let room = GAP + BULGE * (right - left).max(bottom - top);
        let (mut columns, mut rows) = ((left - room, right + room), (top - room, bottom + room));
        if !self.camera.wraps_around() {
            columns = (columns.0.max(0.0), columns.1.min(width - 1.0));
        } else if right - left > POLAR * width {
            // Around or beside a pole: all columns, and the rows from there to the pole.
            columns = (0.0, width - 1.0);
            if 0.5 * (top + bottom) < 0.5 * self.camera.height() as f64 {
                rows.0 = 0.0;
            } else {
                rows.1 = self.camera.height() as f64;
            }
        }
        let whole = |(first, last): (f64, f64)| (first.ceil() as i64, last.floor() as i64);
        (whole(columns), whole(rows))
    }
}

fn least_and_largest(values: [f64; 3]) -> (f64, f64) {
    let least = values.into_iter().fold(f64::INFINITY, f64::min);
    let largest = values.into_iter().fold(f64::NEG_INFINITY, f64::max);
    (least, largest)
}

/// A triangle `a b c` as seen from the origin.
struct Triangle {
    /// a x b, b x c, c x a.
    normals: [Vector3<f64>; 3],
    /// a . (b x c): negative where the triangle is seen from its back.
    volume: f64,
}

impl Triangle {
    /// The distance along the unit ray at which it meets the triangle.
    fn meets(&self, ray: &Vector3<f64>) -> Option<f64> {
        let sign = self.volume.signum();
        let sides = [0, 1, 2].map(|k| sign * self.normals[k].dot(ray));
        let sum = sides[0] + sides[1] + sides[2];
        let inside = sum > 0.0 && sides.iter().all(|side| *side >= -GAP * sum);
        // The sides are the barycentric weights times the ray's component along a x b + ...
        inside.then(|| self.volume.abs() / sum)
    }
}
