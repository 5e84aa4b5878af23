//! What a domain's balance is summed up in.

/// The sums of one domain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CellSums {
    /// Integral of second minus first image.
    pub change: f64,
    /// Coefficients of `[omega, v]`.
    pub coefficients: [f64; 6],
    /// Solid angle of the known part.
    pub area: f64,
    /// Integral of gamma.
    pub gamma: f64,
    /// Known blocks.
    pub count: u32,
}
