"""Types of settings: what a value may be, and what is said of one that is not."""

from __future__ import annotations

import types
from collections.abc import Sequence
from typing import Any, Literal, Union, get_args, get_origin

import numpy as np

from sphereflow.errors import ValueRangeError


def checked(kind: Any, value: Any, key: str) -> Any:
    """The value as its type wants it: an int where a float is meant becomes one, a list a tuple.

    Parameters
    ----------
    kind
        The annotation of the field.
    value
        What was given.
    key
        Name of the field, for the error.

    Raises
    ------
    ValueRangeError
        Naming the key, what was expected and what was found.
    """
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        (inner,) = (argument for argument in arguments if argument is not type(None))
        return None if value is None else checked(inner, value, key)
    if origin is Literal:
        if isinstance(value, str) and value in arguments:
            return value
    elif origin is tuple:
        if isinstance(value, (Sequence, np.ndarray)) and not isinstance(value, str):
            return _items(arguments, list(value), key)
    elif kind is bool:
        if isinstance(value, (bool, np.bool_)):
            return bool(value)
    elif kind is int:
        if isinstance(value, (int, np.integer)) and not isinstance(value, bool):
            return int(value)
    elif kind is float:
        if isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool):
            return float(value)
    elif isinstance(value, kind):
        return value
    raise ValueRangeError(f"{key}: expected {name_of(kind)}, found {value!r}")


def _items(arguments: tuple[Any, ...], values: list[Any], key: str) -> tuple[Any, ...]:
    if arguments[-1] is Ellipsis:
        arguments = (arguments[0],) * len(values)
    if len(arguments) != len(values):
        raise ValueRangeError(f"{key}: expected {len(arguments)} values, found {len(values)}")
    pairs = zip(arguments, values, strict=True)
    return tuple(checked(kind, value, f"{key}[{i}]") for i, (kind, value) in enumerate(pairs))


def name_of(kind: Any) -> str:
    """A type in words."""
    if get_origin(kind) is Literal:
        return expected_names([str(argument) for argument in get_args(kind)])
    if get_origin(kind) is tuple:
        return "an array"
    words = {bool: "true or false", int: "an integer", float: "a number", str: "a string"}
    return words.get(kind) or f"a table, or a sphereflow.config.{kind.__name__}"


def expected_names(names: Sequence[str]) -> str:
    """One of several names."""
    quoted = [f"'{name}'" for name in names]
    return quoted[0] if len(quoted) == 1 else f"{', '.join(quoted[:-1])} or {quoted[-1]}"
