//! Position, velocity and attitude: the thesis's observer (9.5), and an error-state filter that
//! takes whatever comes, in whatever order.

mod config;
mod filter;
mod history;
mod measurement;
mod observer;
mod state;
#[cfg(test)]
mod tests;

pub use config::NavigationConfig;
pub use filter::{NavigationFilter, NavigationState};
pub use observer::{PositionGains, PositionObserver};
pub use state::{Matrix15, NominalState};
