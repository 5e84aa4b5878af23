//! Statuses and reasons as plain values: name, code, and the values that decided.

use super::{Plain, not_plain};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyInt, PyString, PyTuple};
use sphereflow_core::{Reason, ReasonCode, ReasonValue, TrackStatus};
use sphereflow_depth::{DepthReason, DepthStatus};
use sphereflow_observers::{Reason as ObserverReason, Status};

/// The values of a reason by name; empty where there is none.
pub fn reason_values<'py, R: ReasonCode>(
    py: Python<'py>,
    reason: Option<&R>,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (name, value) in reason.map(R::values).unwrap_or_default() {
        match value {
            ReasonValue::Number(number) => dict.set_item(name, number)?,
            ReasonValue::Count(count) => dict.set_item(name, count)?,
            ReasonValue::Word(word) => dict.set_item(name, word.as_ref())?,
        }
    }
    Ok(dict)
}

/// A status as its name, and its reason's code and values.
fn status_to_plain<'py, R: ReasonCode>(
    py: Python<'py>,
    name: &str,
    reason: Option<&R>,
) -> PyResult<Bound<'py, PyAny>> {
    let code = reason.map(|reason| reason.code().to_string());
    let items = [
        name.to_string().to_plain(py)?,
        code.to_plain(py)?,
        reason_values(py, reason)?.into_any(),
    ];
    Ok(PyTuple::new(py, items)?.into_any())
}

/// Name and reason of a status.
fn status_from_plain<R: ReasonCode>(value: &Bound<'_, PyAny>) -> PyResult<(String, Option<R>)> {
    let wrong = || not_plain("a status", value);
    type Parts<'py> = (String, Option<String>, Bound<'py, PyDict>);
    let (name, code, dict): Parts<'_> = value.extract().map_err(|_| wrong())?;
    let Some(code) = code else {
        return Ok((name, None));
    };
    let mut values = Vec::new();
    for (name, value) in dict {
        let value = if value.is_instance_of::<PyString>() {
            ReasonValue::Word(value.extract::<String>()?.into())
        } else if value.is_instance_of::<PyInt>() {
            ReasonValue::Count(value.extract()?)
        } else {
            ReasonValue::Number(value.extract()?)
        };
        values.push((name.extract::<String>()?, value));
    }
    let reason = R::from_code(&code, &values).ok_or_else(wrong)?;
    Ok((name, Some(reason)))
}

impl Plain for TrackStatus {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        status_to_plain(py, self.name(), self.reason().as_ref())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        match status_from_plain::<Reason>(value)? {
            (name, None) => [Self::Started, Self::Tracked, Self::Relocalised]
                .into_iter()
                .find(|status| status.name() == name),
            (name, Some(reason)) => [Self::Weak, Self::Coasting, Self::Lost, Self::Skipped]
                .into_iter()
                .map(|status| status(reason))
                .find(|status| status.name() == name),
        }
        .ok_or_else(|| not_plain("a status of a frame", value))
    }
}

impl Plain for Status {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        status_to_plain(py, self.name(), self.reason().as_ref())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        match status_from_plain::<ObserverReason>(value)? {
            (name, None) => (name == Self::Ok.name()).then_some(Self::Ok),
            (name, Some(reason)) => [Self::Starting, Self::Weak, Self::Skipped]
                .into_iter()
                .map(|status| status(reason))
                .find(|status| status.name() == name),
        }
        .ok_or_else(|| not_plain("a status of an observer", value))
    }
}

impl Plain for DepthStatus {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        status_to_plain(py, self.name(), self.reason().as_ref())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        match status_from_plain::<DepthReason>(value)? {
            (name, None) => [Self::Started, Self::Updated]
                .into_iter()
                .find(|status| status.name() == name),
            (name, Some(reason)) => [Self::Unobservable, Self::Unusable, Self::Skipped]
                .into_iter()
                .map(|status| status(reason))
                .find(|status| status.name() == name),
        }
        .ok_or_else(|| not_plain("a status of depth", value))
    }
}

/// Every code with the names of its values, by what it is a reason of. Private.
#[pyfunction]
#[pyo3(name = "_reason_codes")]
pub fn reason_codes(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    for (of, codes) in [
        ("frame", Reason::CODES),
        ("observer", ObserverReason::CODES),
        ("depth", DepthReason::CODES),
        ("calibration", super::CALIBRATION_CODES),
    ] {
        let inner = PyDict::new(py);
        for (code, names) in codes {
            inner.set_item(code, names.to_vec())?;
        }
        dict.set_item(of, inner)?;
    }
    Ok(dict)
}
