//! Tests of the grid against closed forms and under refinement.

mod geometry;
