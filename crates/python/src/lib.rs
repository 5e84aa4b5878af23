//! The Python module `sphereflow._native`: argument checks, views, error mapping; no arithmetic on pixels.

use pyo3::prelude::*;

/// The compiled half of sphereflow. Private: import `sphereflow`.
#[pymodule]
mod _native {
    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
