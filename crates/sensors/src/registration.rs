//! Depth as the colour camera sees it, with the device's own coefficients.
//!
//! Each depth pixel moves by a third-order polynomial of its place, plus a shift along the row that
//! depends on its depth; of two pixels that land on one place the nearer stays. One implementation
//! serves the Kinect v1 and the PS1080. Both calibrations are the factory's: for mapping at its best
//! calibrate the cameras.

use crate::disparity::{DisparityModel, NO_READING};
use sphereflow_core::{DepthMap, Plane};

/// Numbers of the registration parameters.
pub const COEFFICIENTS: usize = 29;

/// Subdivisions of a pixel in the table of places.
const SUBPIXEL: f64 = 256.0;
/// What the tables' places are beside the image's, pixels.
const OFFSET: f64 = 1.0;
/// Offset of the shift, pixels.
const SHIFT_OFFSET: f64 = 0.375;

/// Start values and increments of one coordinate's polynomial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Polynomial {
    value: i32,
    by_column: i32,
    by_row: i32,
    by_column_column: i32,
    by_column_row: i32,
    by_row_row: i32,
    column_cubed: i32,
    column_column_row: i32,
    column_row_row: i32,
    row_cubed: i32,
}

/// The registration's coefficients.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RegistrationParameters {
    x: Polynomial,
    y: Polynomial,
}

impl RegistrationParameters {
    /// From the numbers in the order in which devices tell them: dx_center, ax, bx, cx, dx, dx_start,
    /// ay, by, cy, dy, dy_start, dx_beta_start, dy_beta_start, rollout_blank, rollout_size,
    /// dx_beta_inc, dy_beta_inc, dxdx, dxdy, dydx, dydy, dxdxdx, dydxdx, dxdxdy, dydxdy, back_comp1,
    /// dydydx, back_comp2, dydydy.
    pub fn from_values(v: &[i32; COEFFICIENTS]) -> Self {
        Self {
            x: Polynomial {
                value: v[5],
                by_column: v[17],
                by_row: v[19],
                by_column_column: v[21],
                by_column_row: v[22],
                by_row_row: v[26],
                column_cubed: v[1],
                column_column_row: v[3],
                column_row_row: v[4],
                row_cubed: v[2],
            },
            y: Polynomial {
                value: v[10],
                by_column: v[18],
                by_row: v[20],
                by_column_column: v[23],
                by_column_row: v[24],
                by_row_row: v[28],
                column_cubed: v[6],
                column_column_row: v[8],
                column_row_row: v[9],
                row_cubed: v[7],
            },
        }
    }
}

/// A polynomial of the third order by forward differences in the device's fixed point.
struct Differences {
    parameters: Polynomial,
    value: i64,
    x: i64,
    y: i64,
    xx: i64,
    xy: i64,
    yy: i64,
}

impl Differences {
    fn new(parameters: Polynomial) -> Self {
        // 32 bits before they grow: the device's own numbers overflow there, too
        let first = |v: i32| i64::from(v.wrapping_shl(11) >> 3);
        let second = |v: i32| i64::from(v.wrapping_shl(5).wrapping_shl(3));
        Self {
            parameters,
            value: i64::from(parameters.value.wrapping_shl(13) >> 4),
            x: first(parameters.by_column),
            y: first(parameters.by_row),
            xx: second(parameters.by_column_column),
            xy: second(parameters.by_column_row),
            yy: second(parameters.by_row_row),
        }
    }

    fn next_row(&mut self) {
        let p = &self.parameters;
        self.xx += i64::from(p.column_column_row);
        self.x += self.xy >> 8;
        self.xy += i64::from(p.column_row_row);
        self.value += self.y >> 6;
        self.y += self.yy >> 8;
        self.yy += i64::from(p.row_cubed);
    }

    /// Pixels by which a row's pixels move.
    fn row(&self, width: usize) -> impl Iterator<Item = f64> {
        let (mut value, mut x, mut xx) = (self.value, self.x, self.xx);
        let third = i64::from(self.parameters.column_cubed);
        (0..width).map(move |_| {
            let pixels = value as f64 / f64::from(1 << 17);
            value += x >> 6;
            x += xx >> 8;
            xx += third;
            pixels
        })
    }
}

/// Tables that carry raw disparities to depths in the colour camera's image.
#[derive(Clone, Debug)]
pub struct Registration {
    width: usize,
    height: usize,
    /// Column in 256ths of a pixel, and row, of each pixel; row -1 for those outside.
    places: Vec<(i32, i32)>,
    /// Shift by raw disparity in 256ths of a pixel, and depth; NaN without one.
    shifts: Vec<(i32, f32)>,
}

impl Registration {
    /// Tables of `width x height` pixels (640x480 where the parameters are those of VGA);
    /// `first_line` is the first of [`crate::kinect::parse_padding`].
    ///
    /// # Errors
    /// Where a length of `model` is not positive.
    pub fn new(
        width: usize,
        height: usize,
        parameters: &RegistrationParameters,
        model: &DisparityModel,
        first_line: u16,
    ) -> crate::Result<Self> {
        model.check()?;
        let mut places = Vec::with_capacity(width * height);
        let (mut dx, mut dy) = (
            Differences::new(parameters.x),
            Differences::new(parameters.y),
        );
        for y in 0..height {
            dx.next_row();
            dy.next_row();
            for (x, (dx, dy)) in dx.row(width).zip(dy.row(width)).enumerate() {
                let (u, v) = (x as f64 + dx + OFFSET, y as f64 + dy + OFFSET);
                let inside = (0.0..width as f64).contains(&u) && (0.0..height as f64).contains(&v);
                let row = v as i32 - i32::from(first_line);
                places.push(if inside {
                    ((u * SUBPIXEL) as i32, row)
                } else {
                    (0, -1)
                });
            }
        }
        let shifts = (0..=NO_READING).map(|raw| match model.depth_m(raw) {
            Some(depth_m) => (shift(model, depth_m), depth_m as f32),
            None => (0, f32::NAN),
        });
        Ok(Self {
            width,
            height,
            places,
            shifts: shifts.collect(),
        })
    }

    /// Depths in the colour camera's pixels, metres, from raw disparities of the depth camera;
    /// NaN where none landed. `None` where the image has another size.
    pub fn apply(&self, raw: &Plane<u16>) -> Option<DepthMap> {
        if raw.size() != (self.width, self.height) {
            return None;
        }
        let mut depths = vec![f32::NAN; self.width * self.height];
        for (raw, (column, row)) in raw.data().iter().zip(&self.places) {
            let Some((shift, depth_m)) = self.shifts.get(usize::from(*raw)) else {
                continue;
            };
            let x = (column + shift) >> 8;
            if depth_m.is_nan() || *row < 0 || x < 0 || x as usize >= self.width {
                continue;
            }
            let place = &mut depths[*row as usize * self.width + x as usize];
            if place.is_nan() || *place > *depth_m {
                *place = *depth_m;
            }
        }
        Plane::from_vec(self.width, self.height, depths)
            .ok()
            .map(DepthMap::new)
    }
}

/// Shift along the row of a point in `depth_m`, 256ths of a pixel: the parallax of the two cameras
/// against the reference plane.
fn shift(model: &DisparityModel, depth_m: f64) -> i32 {
    let parallax = model.colour_baseline_cm / (2.0 * model.pixel_cm)
        * (1.0 - model.reference_cm / (100.0 * depth_m));
    ((parallax + SHIFT_OFFSET) * SUBPIXEL) as i32
}

#[cfg(test)]
mod tests;
