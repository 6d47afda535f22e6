"""Records: named numbers in one flat row, the same for Python and for compiled code.

A record is a class with annotations only:

    class Swing(Record):
        start: Float[np.ndarray, "3"]
        delay: float

    class Feet(Record):
        time: float
        swings: tuple[Swing, Swing, Swing, Swing]

``Feet()`` makes a row of float64, all 0, and looks at it: ``feet.swings[2].start[0] = 0.1`` writes
into it, ``feet.row`` is it. In compiled code (``compilation``) the same names are places in the
same row. Everything is a float64, a flag as well (0 or 1): a row can be copied, compared, stored
and looked through for numbers that are not finite as one array.

What a class names in ``__slots__`` is no part of the row.

A frozen dataclass of numbers, such as a configuration, is a record too: ``packed(config)`` is the
same value with its numbers in a row.
"""

from __future__ import annotations

import dataclasses
import typing
from dataclasses import dataclass
from functools import cache
from math import prod
from typing import Any, Self, TypeVar, cast

import numpy as np
from jaxtyping import AbstractArray, Float

from go2_wbc.brief import cut, told

T = TypeVar("T")

V3 = tuple[float, float, float]
"""A vector as three numbers, which compiled code keeps in registers."""
Array3 = Float[np.ndarray, "3"]  #: A vector in memory; so are the others, by their shapes
Array4 = Float[np.ndarray, "4"]
Array6 = Float[np.ndarray, "6"]
Array12 = Float[np.ndarray, "12"]
Array18 = Float[np.ndarray, "18"]
Array19 = Float[np.ndarray, "19"]
Array30 = Float[np.ndarray, "30"]
Array3x3 = Float[np.ndarray, "3 3"]
Array4x3 = Float[np.ndarray, "4 3"]
ArrayNx3 = Float[np.ndarray, "n 3"]
ArrayNx12 = Float[np.ndarray, "n 12"]
ArrayNx3x3 = Float[np.ndarray, "n 3 3"]


@dataclass(frozen=True, slots=True)
class Field:
    """Where a part of a record lies."""

    start: int  #: index of its first number in the row
    shape: tuple[int, ...]  #: of its numbers or records; () for a single one
    record: type | None = None  #: class of its records, None for numbers
    is_flag: bool = False  #: whether its number says yes or no

    @property
    def size(self) -> int:
        """How many numbers it has."""
        return prod(self.shape) * (1 if self.record is None else layout_of(self.record).size)


@dataclass(frozen=True, slots=True)
class Layout:
    """Where each part of a record lies, by name, and how many numbers it has in all."""

    fields: dict[str, Field]
    size: int

    @property
    def dtype(self) -> np.dtype:
        """The same as numpy, and so Numba, says it."""
        parts = []
        for name, field in self.fields.items():
            inner = np.float64 if field.record is None else layout_of(field.record).dtype
            parts.append((name, inner, field.shape))
        return np.dtype(parts, align=True)

    def slice(self, name: str) -> slice:
        """The numbers of a part, in a row."""
        field = self.fields[name]
        return slice(field.start, field.start + field.size)

    def place(self, index: int) -> tuple[str, str]:
        """The part in which the number at ``index`` of a row lies, and where in it: [1, 2]."""
        name = max(
            (n for n in self.fields), key=lambda n: (f := self.fields[n].start) <= index and f
        )
        field = self.fields[name]
        if field.record is not None:
            stride = layout_of(field.record).size
            which, inside = divmod(index - field.start, stride)
            inner, where = layout_of(field.record).place(inside)
            return f"{name}{f'[{which}]' if field.shape else ''}.{inner}", where
        at = np.unravel_index(index - field.start, field.shape)
        return name, f"[{', '.join(str(i) for i in at)}]" if at else ""


class Record:
    """Named numbers of one row. Subclasses have annotations only; see the module.

    Attributes:
        row: the numbers.
    """

    __slots__ = ("row",)
    row: Any  # of float64; not annotated as an array, so that it is no part

    def __init__(self, **values: Any) -> None:
        """A new row: ``values`` by the names of their parts, all others 0."""
        layout = layout_of(type(self))
        object.__setattr__(self, "row", np.zeros(layout.size))
        for name, value in values.items():
            if name not in layout.fields:
                raise TypeError(f"{type(self).__name__} has no part {name!r}")
            _put(self.row, layout.fields[name], value, name)

    @classmethod
    def of(cls, row: Float[np.ndarray, " size"]) -> Self:
        """The numbers that lie in ``row`` already."""
        layout_of(cls)
        record = object.__new__(cls)
        _set_row(record, row)
        return record

    @classmethod
    def part_names(cls) -> tuple[str, ...]:
        """The names of its parts, in the order of the row."""
        return tuple(layout_of(cls).fields)

    def __setattr__(self, name: str, value: Any) -> None:
        """Write a number or a flag; what has no such part is refused."""
        if name not in layout_of(type(self)).fields:
            raise AttributeError(f"{type(self).__name__} has no part {name!r}")
        object.__setattr__(self, name, value)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self).of, (self.row,)

    def __repr__(self) -> str:
        return _described(self, layout_of(type(self)))


_set_row = vars(Record)["row"].__set__  # of its slot: a record is made in every tick


def packed(value: T) -> T:
    """``value``, a dataclass of numbers, with its numbers in a row that compiled code can read.

    Raises:
        TypeError: for a part that is no number, with its name.
        ValueError: for one of another shape than is declared, with its name.
    """
    if getattr(type(value), "__slots__", None) == ("row",):
        return value  # it is packed
    layout = layout_of(type(value))
    row = np.empty(layout.size)
    for name, field in layout.fields.items():
        _put(row, field, getattr(value, name), f"{type(value).__name__}.{name}")
    return cast(T, _looking_at(type(value), row))


def numbers_of(record: Any) -> Any:
    """All numbers of a record as one array, in compiled code as well."""
    return record.row


def _looking_at(cls: type, row: Float[np.ndarray, " size"]) -> Any:
    """A value of the class, record or dataclass, whose numbers are those of ``row``."""
    view = object.__new__(cls if issubclass(cls, Record) else _view_of(cls))
    layout_of(cls)
    object.__setattr__(view, "row", row)
    return view


@cache
def _view_of(cls: type) -> type:
    """A subclass of a dataclass whose values lie in a row."""
    parts = {name: _property(field) for name, field in layout_of(cls).fields.items()}
    layout = layout_of(cls)
    own = {
        "__slots__": ("row",),
        "__repr__": lambda self: _described(self, layout),
        "__reduce__": lambda self: (_looking_at, (cls, self.row)),
    }
    return type(cls.__name__, (cls,), own | parts)


@cache
def layout_of(cls: type) -> Layout:
    """Where the parts of a record or a dataclass of numbers lie.

    Raises:
        TypeError: for a part that is neither numbers nor a record, with its name.
    """
    if not (isinstance(cls, type) and (issubclass(cls, Record) or dataclasses.is_dataclass(cls))):
        raise TypeError(f"{cls!r} is no record")
    hints = typing.get_type_hints(cls, include_extras=True)
    if dataclasses.is_dataclass(cls):
        hints = {field.name: hints[field.name] for field in dataclasses.fields(cls)}
    fields, size = {}, 0
    besides = {name for base in cls.__mro__ for name in getattr(base, "__slots__", ())}
    for name, hint in hints.items():
        if issubclass(cls, Record) and name in besides:
            continue
        fields[name] = field = _field(hint, size, f"{cls.__name__}.{name}")
        size += field.size
    if issubclass(cls, Record):
        for name, field in fields.items():
            setattr(cls, name, _property(field))
    return Layout(fields, size)


def _field(hint: Any, start: int, where: str) -> Field:
    if hint in (float, int):
        return Field(start, ())
    if hint is bool:
        return Field(start, (), is_flag=True)
    if isinstance(hint, type) and issubclass(hint, AbstractArray):
        if "float64" in hint.dtypes:
            return Field(start, tuple(int(n) for n in hint.dim_str.split()))
    elif typing.get_origin(hint) is typing.Annotated:  # Annotated[tuple[float, ...], 12]
        return Field(start, (hint.__metadata__[0],))
    elif typing.get_origin(hint) is tuple:
        kinds = typing.get_args(hint)
        if len(set(kinds)) == 1:
            inner = _field(kinds[0], start, where)
            return Field(start, (len(kinds), *inner.shape), inner.record)
    elif isinstance(hint, type) and (issubclass(hint, Record) or dataclasses.is_dataclass(hint)):
        return Field(start, (), hint)
    raise TypeError(f"{where} is declared as {hint!r}, which no row of numbers holds")


def _property(field: Field) -> property:
    """The part as an attribute: a number, a flag, an array, a record or records of ``row``."""
    start, end, shape, record = field.start, field.start + field.size, field.shape, field.record

    if record is not None and shape:
        step = layout_of(record).size
        parts = [slice(k, k + step) for k in range(start, end, step)]
        return property(lambda self: tuple(_looking_at(record, self.row[part]) for part in parts))
    if record is not None:
        return property(lambda self: _looking_at(record, self.row[start:end]))
    if field.is_flag:
        return property(lambda self: bool(self.row[start]), _setter(start))
    if not shape:
        return property(lambda self: self.row[start], _setter(start))
    # To be written into: compiled, an array cannot be exchanged either.
    return property(lambda self: self.row[start:end].reshape(shape))


def _setter(start: int) -> Any:
    def put(self: Any, value: float) -> None:
        self.row[start] = value

    return put


def _put(row: Float[np.ndarray, " size"], field: Field, value: Any, where: str) -> None:
    """Put a part's value into its place in the row."""
    end = field.start + field.size
    if field.record is not None:
        values = value if field.shape else (value,)
        if len(values) != prod(field.shape):
            raise ValueError(f"{where} must be {prod(field.shape)} values, got {len(values)}")
        part, inner = row[field.start : end], layout_of(field.record)
        for n, one in enumerate(values):
            for name, place in inner.fields.items():
                into = part[n * inner.size : (n + 1) * inner.size]
                _put(into, place, getattr(one, name), f"{where}.{name}")
        return
    if np.shape(value) != field.shape:
        raise ValueError(f"{where} must have the shape {field.shape}, got {np.shape(value)}")
    try:
        row[field.start : end] = np.ravel(value)
    except (TypeError, ValueError) as error:
        raise TypeError(f"{where} must hold numbers, got {value!r}") from error


def _described(view: Any, layout: Layout) -> str:
    said = (f"{name}={told(getattr(view, name))}" for name in layout.fields)
    return cut(f"{type(view).__name__}({', '.join(said)})")
