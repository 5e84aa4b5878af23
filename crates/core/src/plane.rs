//! Images as plain row-major planes, and the two kinds of depth that must not be confused.

use crate::{Error, Result};

/// A row-major image: pixel `(x, y)` is `data[y * width + x]`; its centre lies at integer coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane<T> {
    width: usize,
    height: usize,
    data: Vec<T>,
}

impl<T> Plane<T> {
    /// From row-major data of `width * height` values.
    ///
    /// # Errors
    /// [`Error::Shape`] where the length differs.
    pub fn from_vec(width: usize, height: usize, data: Vec<T>) -> Result<Self> {
        if data.len() != width * height {
            return Err(Error::shape(
                "data",
                format!("{width}x{height} = {} values", width * height),
                format!("{} values", data.len()),
            ));
        }
        Ok(Self {
            width,
            height,
            data,
        })
    }

    /// A plane whose pixel `(x, y)` is `f(x, y)`.
    pub fn from_fn(width: usize, height: usize, mut f: impl FnMut(usize, usize) -> T) -> Self {
        let mut data = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                data.push(f(x, y));
            }
        }
        Self {
            width,
            height,
            data,
        }
    }

    /// Pixels per row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// `(width, height)`.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// All pixels, row after row.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// All pixels, row after row, to be written.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// The pixels themselves.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }

    /// Row `y`.
    ///
    /// # Panics
    /// Where `y` is not below the height, as slices do.
    pub fn row(&self, y: usize) -> &[T] {
        &self.data[y * self.width..(y + 1) * self.width]
    }

    /// The pixel, or `None` outside.
    pub fn get(&self, x: usize, y: usize) -> Option<&T> {
        (x < self.width && y < self.height).then(|| &self.data[y * self.width + x])
    }

    /// A plane of the same size with `f` of each pixel.
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> Plane<U> {
        Plane {
            width: self.width,
            height: self.height,
            data: self.data.iter().map(f).collect(),
        }
    }
}

impl<T: Clone> Plane<T> {
    /// A plane of one value.
    pub fn filled(width: usize, height: usize, value: T) -> Self {
        Self {
            width,
            height,
            data: vec![value; width * height],
        }
    }
}

impl<T> std::ops::Index<(usize, usize)> for Plane<T> {
    type Output = T;

    /// Pixel `(x, y)`.
    fn index(&self, (x, y): (usize, usize)) -> &T {
        assert!(x < self.width, "column outside the plane");
        &self.data[y * self.width + x]
    }
}

impl<T> std::ops::IndexMut<(usize, usize)> for Plane<T> {
    fn index_mut(&mut self, (x, y): (usize, usize)) -> &mut T {
        assert!(x < self.width, "column outside the plane");
        &mut self.data[y * self.width + x]
    }
}

/// Depth along the optical axis (z), metres; NaN where unknown. What depth cameras store.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthMap(Plane<f32>);

/// Range along the ray, metres; NaN where unknown. The thesis's D (1.13).
#[derive(Clone, Debug, PartialEq)]
pub struct RangeMap(Plane<f32>);

macro_rules! metres_map {
    ($name:ident, $what:literal) => {
        impl $name {
            /// From metres; anything that is not a finite positive number becomes NaN (unknown).
            pub fn new(mut metres: Plane<f32>) -> Self {
                for value in metres.data_mut() {
                    // An unconditional store, so that the loop vectorises.
                    let known = *value > 0.0 && *value < f32::INFINITY;
                    *value = if known { *value } else { f32::NAN };
                }
                Self(metres)
            }

            #[doc = concat!("The ", $what, " in metres, NaN where unknown.")]
            pub fn metres(&self) -> &Plane<f32> {
                &self.0
            }

            /// The plane itself.
            pub fn into_plane(self) -> Plane<f32> {
                self.0
            }

            /// `(width, height)`.
            pub fn size(&self) -> (usize, usize) {
                self.0.size()
            }

            /// Share of known pixels, 0 to 1; 0 for an empty map.
            pub fn known_share(&self) -> f64 {
                let known = self.0.data().iter().filter(|v| v.is_finite()).count();
                known as f64 / self.0.data().len().max(1) as f64
            }
        }
    };
}

metres_map!(DepthMap, "depth along the optical axis (z)");
metres_map!(RangeMap, "range along the ray");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plane_from_wrong_length_names_both_sizes() {
        let error = Plane::from_vec(3, 2, vec![0_u8; 5])
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("3x2") && error.contains("5 values"),
            "{error}"
        );
    }

    #[test]
    fn depth_map_turns_every_impossible_value_into_nan() {
        let raw = [0.0, -1.0, f32::INFINITY, f32::NAN, 2.5];
        let map = DepthMap::new(Plane::from_vec(5, 1, raw.to_vec()).unwrap());
        let known: Vec<bool> = map.metres().data().iter().map(|v| v.is_finite()).collect();
        assert_eq!(known, [false, false, false, false, true]);
        assert_eq!(map.known_share(), 0.2);
    }

    #[test]
    fn plane_index_is_column_then_row() {
        let plane = Plane::from_fn(4, 3, |x, y| 10 * y + x);
        assert_eq!(
            (plane[(3, 1)], plane.row(2)[1], plane.get(4, 0)),
            (13, 21, None)
        );
    }
}
