//! `associate`: which stamps of two clocks belong together.

use crate::arrays::stamps;
use crate::errors::{Kind, exception};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_core::associate;

/// Pairs of the nearest stamps.
///
/// Each stamp of the shorter list takes the nearest of the longer one, which may serve twice: the rule
/// of evo.
///
/// Parameters
/// ----------
/// stamp_ns_a, stamp_ns_b : array_like of int, (N,), (M,)
///     Increasing nanoseconds.
/// max_difference_s : float
///     Pairs further apart than this are left out.
///
/// Returns
/// -------
/// ndarray of int, (K, 2)
///     Indices into `stamp_ns_a` and `stamp_ns_b`.
#[pyfunction]
#[pyo3(name = "associate", signature = (stamp_ns_a, stamp_ns_b, max_difference_s))]
pub fn py_associate<'py>(
    py: Python<'py>,
    stamp_ns_a: &Bound<'py, PyAny>,
    stamp_ns_b: &Bound<'py, PyAny>,
    max_difference_s: f64,
) -> PyResult<Bound<'py, PyArray2<i64>>> {
    if !(max_difference_s.is_finite() && max_difference_s >= 0.0) {
        let text = format!("max_difference_s: expected seconds >= 0, found {max_difference_s}");
        return Err(exception(Kind::Value, text));
    }
    let (a, b) = (
        stamps(stamp_ns_a, "stamp_ns_a")?,
        stamps(stamp_ns_b, "stamp_ns_b")?,
    );
    let pairs = associate(&a, &b, (max_difference_s * 1e9).round() as u64);
    let flat: Vec<i64> = pairs
        .iter()
        .flat_map(|&(i, j)| [i as i64, j as i64])
        .collect();
    PyArray1::from_vec(py, flat).reshape([pairs.len(), 2])
}
