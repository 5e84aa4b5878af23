//! NumPy arrays in and small ones out: shape and element type are checked here, and errors name the argument.

use crate::errors::{Kind, exception};
use nalgebra::{UnitQuaternion, Vector3};
use numpy::{
    PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::{Plane, Stamp};

/// `value` as a C-contiguous array of `dtype`, without a copy where it already is one.
/// Only element kinds in `kinds` (NumPy's letters) are converted.
fn contiguous<'py>(
    value: &Bound<'py, PyAny>,
    name: &str,
    dtype: &str,
    kinds: &str,
    hint: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let numpy = value.py().import("numpy")?;
    let array = filled(&numpy.call_method1("asanyarray", (value,))?, name)?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !kinds.contains(&kind) {
        let found: String = array.getattr("dtype")?.str()?.extract()?;
        return Err(exception(
            Kind::Dtype,
            format!("{name}: expected {dtype} values{hint}, found {found}"),
        ));
    }
    let options = PyDict::new(value.py());
    options.set_item("dtype", dtype)?;
    numpy.call_method("ascontiguousarray", (array,), Some(&options))
}

/// A masked array with NaN where it is masked; any other array as it is. Integers have no NaN: of
/// them none may be masked.
fn filled<'py>(array: &Bound<'py, PyAny>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    let numpy = array.py().import("numpy")?;
    let masked = numpy.getattr("ma")?;
    if !array.is_instance(&masked.getattr("MaskedArray")?)? {
        return numpy.call_method1("asarray", (array,));
    }
    let any: bool = masked.call_method1("is_masked", (array,))?.extract()?;
    if !any {
        return array.getattr("data");
    }
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if kind != "f" {
        let expected = "no masked values where the values are integers";
        let text = format!("{name}: expected {expected}, found a masked array");
        return Err(exception(Kind::Value, text));
    }
    array.call_method1("filled", (f64::NAN,))
}

/// Checks a shape: `None` accepts any length on that axis.
fn check_shape(name: &str, found: &[usize], expected: &[Option<usize>]) -> PyResult<()> {
    let fits = found.len() == expected.len()
        && found
            .iter()
            .zip(expected)
            .all(|(f, e)| e.is_none_or(|e| e == *f));
    if fits {
        return Ok(());
    }
    let letters = ["N", "M", "K"];
    let words: Vec<String> = expected
        .iter()
        .enumerate()
        .map(|(i, e)| e.map_or(letters[i.min(2)].to_string(), |e| e.to_string()))
        .collect();
    let found: Vec<String> = found.iter().map(ToString::to_string).collect();
    Err(exception(
        Kind::Shape,
        format!(
            "{name}: expected shape ({}), found ({})",
            words.join(", "),
            found.join(", ")
        ),
    ))
}

/// A float64 array of the expected shape.
pub fn floats<'py>(
    value: &Bound<'py, PyAny>,
    name: &str,
    shape: &[Option<usize>],
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let array = contiguous(value, name, "float64", "fiu", "")?;
    let array = array.cast_into::<PyArrayDyn<f64>>()?;
    check_shape(name, array.shape(), shape)?;
    Ok(array.readonly())
}

/// An `(N, 3)` array as vectors.
pub fn vectors3(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<Vector3<f64>>> {
    let array = floats(value, name, &[None, Some(3)])?;
    Ok(array
        .as_slice()?
        .chunks_exact(3)
        .map(Vector3::from_column_slice)
        .collect())
}

/// Stamps: integer nanoseconds, `(N,)`. Floats are refused: they cannot hold a Unix time.
pub fn stamps(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<Stamp>> {
    let hint = " (integer nanoseconds; a float cannot hold a Unix time)";
    let array = contiguous(value, name, "int64", "iu", hint)?.cast_into::<PyArrayDyn<i64>>()?;
    check_shape(name, array.shape(), &[None])?;
    Ok(array
        .readonly()
        .as_slice()?
        .iter()
        .map(|&ns| Stamp::from_ns(ns))
        .collect())
}

/// Indices, `(N,)`, none negative.
pub fn indices(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<usize>> {
    let array =
        contiguous(value, name, "int64", "iu", " (indices)")?.cast_into::<PyArrayDyn<i64>>()?;
    check_shape(name, array.shape(), &[None])?;
    let negative = |index: i64| {
        let text = format!("{name}: expected indices, 0 or more, found {index}");
        exception(Kind::Value, text)
    };
    array
        .readonly()
        .as_slice()?
        .iter()
        .map(|&index| usize::try_from(index).map_err(|_| negative(index)))
        .collect()
}

/// A depth or range image `(H, W)` in metres. Integers are refused: they are raw counts, not metres.
pub fn metres(
    value: &Bound<'_, PyAny>,
    name: &str,
    size: Option<(usize, usize)>,
) -> PyResult<Plane<f32>> {
    let hint = " in metres (raw counts must be divided by the depth scale first)";
    let array = contiguous(value, name, "float32", "f", hint)?.cast_into::<PyArrayDyn<f32>>()?;
    check_shape(name, array.shape(), &[size.map(|s| s.1), size.map(|s| s.0)])?;
    let (height, width) = (array.shape()[0], array.shape()[1]);
    let data = array.readonly().as_slice()?.to_vec();
    Plane::from_vec(width, height, data).map_err(|error| crate::errors::core_error(&error))
}

/// An `(H, W, 3)` RGB image of bytes.
pub fn colour(
    value: &Bound<'_, PyAny>,
    name: &str,
    size: Option<(usize, usize)>,
) -> PyResult<Plane<[u8; 3]>> {
    let array = contiguous(value, name, "uint8", "u", " (RGB, 0 to 255)")?;
    let itemsize: usize = value
        .getattr("itemsize")
        .and_then(|v| v.extract())
        .unwrap_or(1);
    if itemsize != 1 {
        return Err(exception(
            Kind::Dtype,
            format!("{name}: expected uint8 values (RGB)"),
        ));
    }
    let array = array.cast_into::<PyArrayDyn<u8>>()?;
    check_shape(
        name,
        array.shape(),
        &[size.map(|s| s.1), size.map(|s| s.0), Some(3)],
    )?;
    let (height, width) = (array.shape()[0], array.shape()[1]);
    let view = array.readonly();
    let (pixels, _) = view.as_slice()?.as_chunks::<3>();
    Plane::from_vec(width, height, pixels.to_vec())
        .map_err(|error| crate::errors::core_error(&error))
}

/// A mask `(H, W)` of booleans.
pub fn mask(value: &Bound<'_, PyAny>, name: &str, size: (usize, usize)) -> PyResult<Plane<bool>> {
    let array = contiguous(value, name, "bool", "b", "")?.cast_into::<PyArrayDyn<bool>>()?;
    let (width, height) = size;
    check_shape(name, array.shape(), &[Some(height), Some(width)])?;
    let data = array.readonly().as_slice()?.to_vec();
    Plane::from_vec(width, height, data).map_err(|error| crate::errors::core_error(&error))
}

/// Brightness 0 to 255 of a grey `(H, W)` or RGB `(H, W, 3)` image of bytes or floats.
pub fn brightness(
    value: &Bound<'_, PyAny>,
    name: &str,
    size: (usize, usize),
) -> PyResult<Plane<f32>> {
    let (width, height) = size;
    let dimensions: usize = value.getattr("ndim").and_then(|v| v.extract()).unwrap_or(2);
    if dimensions == 3 {
        return Ok(sphereflow_core::grey(&colour(value, name, Some(size))?));
    }
    let hint = " (grey (H, W) or RGB (H, W, 3), 0 to 255)";
    let array = contiguous(value, name, "float32", "fu", hint)?.cast_into::<PyArrayDyn<f32>>()?;
    check_shape(name, array.shape(), &[Some(height), Some(width)])?;
    let data = array.readonly().as_slice()?.to_vec();
    Plane::from_vec(width, height, data).map_err(|error| crate::errors::core_error(&error))
}

/// A vector as an array.
pub fn array1<'py>(py: Python<'py>, v: &Vector3<f64>) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, v.as_slice())
}

/// A square symmetric matrix, flat, as an array.
pub fn square<'py>(py: Python<'py>, flat: &[f64], n: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, flat).reshape([n, n])
}

/// x, y, z, w.
pub fn xyzw(q: &UnitQuaternion<f64>) -> [f64; 4] {
    [q.i, q.j, q.k, q.w]
}
