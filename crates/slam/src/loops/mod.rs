//! Motions between keyframes that are not neighbours in time.

pub(crate) mod dense_edges;
