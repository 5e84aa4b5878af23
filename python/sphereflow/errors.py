"""Exceptions of sphereflow: each also derives from the built-in one a Python user expects."""


class SphereflowError(Exception):
    """Base of every error that sphereflow raises on purpose."""


class ShapeError(SphereflowError, ValueError):
    """An array has the wrong shape; the message names the argument and both shapes."""


class DtypeError(SphereflowError, TypeError):
    """An array holds the wrong kind of values (raw counts where metres are expected, ...)."""


class ValueRangeError(SphereflowError, ValueError):
    """A value is outside its domain: NaN in an intrinsic, a negative focal length, ..."""


class TimeOrderError(SphereflowError, ValueError):
    """Stamps that must increase do not."""


class DataError(SphereflowError, ValueError):
    """A file or recording does not contain what it should; the message gives path and line."""


class MissingFileError(SphereflowError, FileNotFoundError):
    """A file or folder is not there; the message says what was looked for."""


class FileAccessError(SphereflowError, OSError):
    """A file cannot be read or written."""


class MissingExtraError(SphereflowError, ImportError):
    """An optional dependency is absent; the message gives the pip line that installs it."""
