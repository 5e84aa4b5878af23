//! The one place where Rust errors become Python exceptions (defined in `sphereflow/errors.py`).

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use sphereflow_core::Error as CoreError;
use sphereflow_io::Error as IoError;

/// Names of the classes in `sphereflow.errors`.
pub enum Kind {
    /// Wrong array shape.
    Shape,
    /// Wrong array element type.
    Dtype,
    /// A value outside its domain.
    Value,
    /// Stamps that do not increase.
    TimeOrder,
    /// The content of a file is not what it should be.
    Data,
    /// A file or folder that is not there.
    MissingFile,
    /// A file that cannot be read or written.
    FileAccess,
}

impl Kind {
    fn class_name(&self) -> &'static str {
        match self {
            Self::Shape => "ShapeError",
            Self::Dtype => "DtypeError",
            Self::Value => "ValueRangeError",
            Self::TimeOrder => "TimeOrderError",
            Self::Data => "DataError",
            Self::MissingFile => "MissingFileError",
            Self::FileAccess => "FileAccessError",
        }
    }
}

/// An exception of class `kind` with `message`.
pub fn exception(kind: Kind, message: impl ToString) -> PyErr {
    let name = kind.class_name();
    let message = message.to_string();
    Python::attach(|py| match class(py, name) {
        Ok(class) => PyErr::from_type(class, message),
        Err(_) => PyRuntimeError::new_err(message), // the package is half imported
    })
}

fn class<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyType>> {
    static MODULE: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    let module =
        MODULE.get_or_try_init(py, || py.import("sphereflow.errors").map(Bound::unbind))?;
    Ok(module.bind(py).getattr(name)?.cast_into::<PyType>()?)
}

/// Anything that maps to one Python exception.
pub trait IntoPython<T> {
    /// The value, or the exception.
    fn into_python(self) -> PyResult<T>;
}

impl<T> IntoPython<T> for Result<T, CoreError> {
    fn into_python(self) -> PyResult<T> {
        self.map_err(|error| core_error(&error))
    }
}

impl<T> IntoPython<T> for Result<T, IoError> {
    fn into_python(self) -> PyResult<T> {
        self.map_err(|error| io_error(&error))
    }
}

/// The exception of a file error: missing files and refusals of the system are told apart.
pub fn io_error(error: &IoError) -> PyErr {
    let kind = match error {
        IoError::Core(error) => return core_error(error),
        IoError::System { source, .. } if source.kind() == std::io::ErrorKind::NotFound => {
            Kind::MissingFile
        }
        IoError::System { .. } => Kind::FileAccess,
        _ => Kind::Data,
    };
    exception(kind, error)
}

/// The exception of a core error, with its whole text.
pub fn core_error(error: &CoreError) -> PyErr {
    let kind = match error {
        CoreError::Shape { .. } => Kind::Shape,
        CoreError::Value { .. } => Kind::Value,
        CoreError::TimeOrder { .. } => Kind::TimeOrder,
    };
    exception(kind, error)
}

impl<T> IntoPython<T> for Result<T, sphereflow_observers::Error> {
    fn into_python(self) -> PyResult<T> {
        self.map_err(|error| match error {
            sphereflow_observers::Error::Core(error) => core_error(&error),
        })
    }
}
