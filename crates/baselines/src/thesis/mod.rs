//! The method of Chapter 6 as the thesis ran it: balance (6.3) on rectangles of the image.
//!
//! Kept so that the thesis can be reproduced and compared: the edge tables of its sections 6.2
//! ([`pinhole`]) and 6.3 ([`fov`]), the balance of D^3 on domains of the image, plain least
//! squares, and the covariance of section 6.4. It has no robust weights, so that every jump of
//! depth that moves within a domain is believed. For measuring, use [`sphereflow_alignment::VelocityEstimator`].

mod balance;
mod config;
mod domains;
mod edge;
mod estimator;
pub mod fov;
pub mod pinhole;
mod solve;
mod table;

pub use config::{RowWeights, ThesisConfig, TimeRule};
pub use edge::{EdgeElement, Side};
pub use estimator::ThesisEstimator;
pub use table::EdgeTable;
