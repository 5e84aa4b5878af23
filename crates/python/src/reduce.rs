//! `__reduce__`: what pickles and copies of an object are made of.

use crate::plain::Plain;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// What `__reduce__` returns: `_restore` and its two arguments.
pub type Reduced<'py> = (Bound<'py, PyAny>, Bound<'py, PyTuple>);

/// The `__reduce__` of an object of `class` whose plain values are `state`.
pub fn reduced<'py>(
    py: Python<'py>,
    class: &str,
    state: Bound<'py, PyAny>,
) -> PyResult<Reduced<'py>> {
    let restore = py.import("sphereflow._native")?.getattr("_restore")?;
    let arguments = [class.to_string().to_plain(py)?, state];
    Ok((restore, PyTuple::new(py, arguments)?))
}
