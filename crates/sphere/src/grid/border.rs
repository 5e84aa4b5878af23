//! What flows through the border of the image.

/// Treatment of edges with a valid pixel on one side only: the image border, the rim of a fish-eye.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Border {
    /// The flux is extrapolated from the pixels inside, so that the accuracy of the interior
    /// reaches to the border. A divergence wants three pixels in a line for second order and makes
    /// do with fewer; a Laplacian wants four, makes do with three, and is NaN with fewer.
    #[default]
    Extrapolate,
    /// Nothing flows: Neumann's condition of variational problems (2.14).
    ZeroFlux,
}
