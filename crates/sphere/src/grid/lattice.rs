//! The pixels as a lattice: who is whose neighbour, across the seam, the poles and holes.

use std::ops::{Add, Mul, Sub};

/// What can be differenced: numbers and vectors.
pub(super) trait Value:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self>
{
}

impl<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T>> Value for T {}

/// Which neighbours along one axis a pixel may use for a derivative by that pixel coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// None on either side.
    Nowhere,
    /// One on both sides: central difference.
    Central,
    /// Two ahead, none behind.
    Ahead,
    /// Two behind, none ahead.
    Behind,
    /// Only one, ahead: first order.
    OneAhead,
    /// Only one, behind: first order.
    OneBehind,
}

/// What lies on the two sides of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sides {
    /// No pixel on either side, or no length (a pole): nothing flows here.
    Closed,
    /// A pixel on both.
    Inner,
    /// A border: its pixel is on the side of larger x or y.
    After,
    /// A border: its pixel is on the side of smaller x or y.
    Before,
}

/// Column and row.
pub(super) type Pixel = (usize, usize);

/// One of the two image axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    /// Along the rows.
    X,
    /// Down the columns.
    Y,
}

/// The pixels, which of them are valid, and what each may reach.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    pub width: usize,
    pub height: usize,
    wraps: bool,
    valid: Vec<bool>,
    reach_x: Vec<Reach>,
    reach_y: Vec<Reach>,
}

impl Lattice {
    pub fn new(width: usize, height: usize, wraps: bool, valid: Vec<bool>) -> Self {
        let mut lattice = Self {
            width,
            height,
            wraps,
            valid,
            reach_x: Vec::new(),
            reach_y: Vec::new(),
        };
        let all = |axis| {
            let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
            pixels
                .map(|(x, y)| lattice.find_reach(axis, x, y))
                .collect()
        };
        let (reach_x, reach_y) = (all(Axis::X), all(Axis::Y));
        (lattice.reach_x, lattice.reach_y) = (reach_x, reach_y);
        lattice
    }

    /// Index of the valid pixel `step` pixels along the axis; beyond a pole the walk goes on down
    /// the opposite meridian, where an even width has a column for it.
    pub fn neighbour(&self, axis: Axis, x: usize, y: usize, step: isize) -> Option<usize> {
        let (width, height) = (self.width as isize, self.height as isize);
        let (mut column, mut row) = (x as isize, y as isize);
        match axis {
            Axis::X => column += step,
            Axis::Y => row += step,
        }
        if self.wraps {
            if row < 0 || row >= height {
                if width % 2 != 0 {
                    return None;
                }
                row = if row < 0 {
                    -1 - row
                } else {
                    2 * height - 1 - row
                };
                column += width / 2;
            }
            column = column.rem_euclid(width);
        }
        let inside = (0..width).contains(&column) && (0..height).contains(&row);
        let index = (row * width + column) as usize;
        (inside && self.valid[index]).then_some(index)
    }

    fn find_reach(&self, axis: Axis, x: usize, y: usize) -> Reach {
        let can = |step| self.neighbour(axis, x, y, step).is_some();
        match (can(-1), can(1)) {
            (true, true) => Reach::Central,
            (false, true) if can(2) => Reach::Ahead,
            (true, false) if can(-2) => Reach::Behind,
            (false, true) => Reach::OneAhead,
            (true, false) => Reach::OneBehind,
            (false, false) => Reach::Nowhere,
        }
    }

    /// The pixels before and after edge `(x, y)` of the axis, `(x - 1, y)` or `(x, y - 1)` and
    /// `(x, y)`; of use only where [`Lattice::sides`] says that they are there.
    pub fn beside(&self, axis: Axis, x: usize, y: usize) -> [Pixel; 2] {
        match axis {
            Axis::X if self.wraps && x == 0 => [(self.width - 1, y), (0, y)],
            Axis::X if self.wraps && x == self.width => [(x - 1, y), (0, y)],
            Axis::X => [(x.wrapping_sub(1), y), (x, y)],
            Axis::Y => [(x, y.wrapping_sub(1)), (x, y)],
        }
    }

    /// Index of a pixel of the lattice.
    pub fn index(&self, (x, y): Pixel) -> usize {
        y * self.width + x
    }

    /// True where there is an edge `(x, y)` of the axis.
    pub fn has_edge(&self, axis: Axis, x: usize, y: usize) -> bool {
        match axis {
            Axis::X => x <= self.width && y < self.height,
            Axis::Y => x < self.width && y <= self.height,
        }
    }

    /// What lies on the two sides of edge `(x, y)` of the axis. Beyond a pole there is nothing.
    pub fn sides(&self, axis: Axis, x: usize, y: usize) -> Sides {
        let (has_before, has_after) = match axis {
            Axis::X => (x > 0 || self.wraps, x < self.width || self.wraps),
            Axis::Y => (y > 0, y < self.height),
        };
        let [before, after] = self.beside(axis, x, y);
        match (
            has_before && self.valid[self.index(before)],
            has_after && self.valid[self.index(after)],
        ) {
            (true, true) => Sides::Inner,
            (false, true) => Sides::After,
            (true, false) => Sides::Before,
            (false, false) => Sides::Closed,
        }
    }

    /// Derivative of `data` by the pixel coordinate along `axis`, at pixel `(x, y)`; second order
    /// wherever two neighbours allow it, `None` where there are none.
    pub fn derivative<T: Value>(&self, axis: Axis, data: &[T], x: usize, y: usize) -> Option<T> {
        let here = y * self.width + x;
        let (reach, stride) = match axis {
            Axis::X => (self.reach_x[here], 1),
            Axis::Y => (self.reach_y[here], self.width),
        };
        let inside = match axis {
            Axis::X => x > 0 && x + 1 < self.width,
            Axis::Y => y > 0 && y + 1 < self.height,
        };
        if reach == Reach::Central && inside {
            return Some((data[here + stride] - data[here - stride]) * 0.5);
        }
        let at = |step| self.neighbour(axis, x, y, step).map(|index| data[index]);
        let own = data[here];
        match reach {
            Reach::Central => Some((at(1)? - at(-1)?) * 0.5),
            Reach::Ahead => Some(at(1)? * 2.0 - own * 1.5 - at(2)? * 0.5),
            Reach::Behind => Some(own * 1.5 - at(-1)? * 2.0 + at(-2)? * 0.5),
            Reach::OneAhead => Some(at(1)? - own),
            Reach::OneBehind => Some(own - at(-1)?),
            Reach::Nowhere => None,
        }
    }
}
