//! Which poses a mask or an array of indices selects.

use crate::errors::{Kind, exception};
use pyo3::prelude::*;

/// The indices that a mask (length,) or an array of integers selects.
pub fn selected(key: &Bound<'_, PyAny>, length: usize) -> PyResult<Vec<isize>> {
    let numpy = key.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (key,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    let expected = match kind.as_str() {
        "b" => length.to_string(),
        "i" | "u" => "K".into(),
        _ => {
            let found = array.getattr("dtype")?;
            let text = format!("index: expected int, slice, bools or ints, found {found}");
            return Err(exception(Kind::Dtype, text));
        }
    };
    if shape.len() != 1 || (kind == "b" && shape[0] != length) {
        let text = format!("index: expected shape ({expected},), found {shape:?}");
        return Err(exception(Kind::Shape, text));
    }
    let indices = if kind == "b" {
        numpy.call_method1("flatnonzero", (array,))?
    } else {
        array
    };
    indices.call_method0("tolist")?.extract()
}
