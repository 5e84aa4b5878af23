//! A depth image of either kind: along the optical axis or along the ray.

use sphereflow_core::{DepthMap, RangeMap};

/// What an estimator is given. Both kinds convert by `into()`.
#[derive(Clone, Copy, Debug)]
pub enum DepthImage<'a> {
    /// Depth along the optical axis: what depth cameras store.
    Depth(&'a DepthMap),
    /// Range along the ray: the only kind that makes sense for a 360-degree camera.
    Range(&'a RangeMap),
}

impl<'a> DepthImage<'a> {
    /// `(width, height)`.
    pub fn size(&self) -> (usize, usize) {
        match self {
            Self::Depth(map) => map.size(),
            Self::Range(map) => map.size(),
        }
    }

    /// Metres, row after row, NaN where unknown.
    pub fn metres(&self) -> &'a [f32] {
        match self {
            Self::Depth(map) => map.metres().data(),
            Self::Range(map) => map.metres().data(),
        }
    }

    /// Along what the distances are.
    pub fn axis(&self) -> Axis {
        match self {
            Self::Depth(_) => Axis::Optical,
            Self::Range(_) => Axis::Ray,
        }
    }
}

impl<'a> From<&'a DepthMap> for DepthImage<'a> {
    fn from(map: &'a DepthMap) -> Self {
        Self::Depth(map)
    }
}

impl<'a> From<&'a RangeMap> for DepthImage<'a> {
    fn from(map: &'a RangeMap) -> Self {
        Self::Range(map)
    }
}

/// Along what a distance was measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axis {
    /// Depth, along the optical axis.
    #[default]
    Optical,
    /// Range, along the pixel's ray.
    Ray,
}
