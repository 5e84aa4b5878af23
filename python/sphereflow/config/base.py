"""What all configs share: checked when they are made, to and from dicts and TOML."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Self, get_type_hints

from sphereflow import _native
from sphereflow.config import toml
from sphereflow.config.types import checked, expected_names
from sphereflow.errors import ValueRangeError


@dataclasses.dataclass(frozen=True)
class Config:
    """Settings: frozen, checked, equal where all fields are.

    A subclass is a frozen dataclass whose fields are bools, ints, floats, words (``Literal``),
    tuples of numbers, optional ones of these, or other configs. What has a counterpart in the
    compiled module is checked by that; another overrides ``_check``.
    """

    _compiled: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Check types and ranges; numbers and sequences become floats and tuples."""
        hints = get_type_hints(type(self))
        for field in dataclasses.fields(self):
            value = checked(hints[field.name], getattr(self, field.name), field.name)
            object.__setattr__(self, field.name, value)
        self._check()

    def _check(self) -> None:
        """Raise a ``ValueRangeError`` that begins with the key of a setting out of its range."""
        if self._compiled:
            _native._check_config(type(self).__name__, self.as_dict())

    def as_dict(self) -> dict[str, Any]:
        """Plain values by name, other configs as dicts in turn."""
        fields = dataclasses.fields(self)
        values = {field.name: getattr(self, field.name) for field in fields}
        return {
            name: value.as_dict() if isinstance(value, Config) else value
            for name, value in values.items()
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """From values by name; what is not named keeps its default.

        Raises
        ------
        ValueRangeError
            For an unknown key, a wrong type or a value out of its range: with the dotted key, what
            was expected and what was found.
        """
        hints, names = get_type_hints(cls), [field.name for field in dataclasses.fields(cls)]
        taken: dict[str, Any] = {}
        for name, value in values.items():
            if name not in names:
                raise ValueRangeError(f"{name}: expected {expected_names(names)}, found this key")
            kind = hints[name]
            if isinstance(kind, type) and issubclass(kind, Config) and isinstance(value, Mapping):
                try:
                    taken[name] = kind.from_dict(value)
                except ValueRangeError as error:
                    raise ValueRangeError(f"{name}.{error}") from None
            else:
                taken[name] = value
        return cls(**taken)

    def replace(self, **changes: Any) -> Self:
        """The same with other values of some fields."""
        return dataclasses.replace(self, **changes)

    def to_toml(self, *, comments: bool = False) -> str:
        """As TOML; ``comments`` puts what each setting means above it.

        A setting that is None is left out, or with ``comments`` told in a comment.
        """
        return toml.text_of(self, comments=comments)

    @classmethod
    def from_toml(cls, source: str | Path) -> Self:
        """From TOML; what is not in it keeps its default.

        Parameters
        ----------
        source
            The text, or the ``Path`` of a file.

        Raises
        ------
        DataError
            Where it is no TOML: with the line.
        MissingFileError, FileAccessError
            Where the file cannot be read.
        ValueRangeError
            As ``from_dict``; of a file, with its path.
        """
        if isinstance(source, str):
            return cls.from_dict(toml.values_of(source))
        try:
            return cls.from_dict(toml.read(source))
        except ValueRangeError as error:
            raise ValueRangeError(f"{source}: {error}") from None

    def write(self, path: str | Path, *, comments: bool = True) -> None:
        """Write a TOML file, beside its place and renamed."""
        toml.write(path, self.to_toml(comments=comments))
