"""The parts of a motion as JSON and arrays, and back: numbers, words, lists and dataclasses.

Reading follows the annotations of the dataclasses, so that a new kind of key, or a new field of a
plan, needs no change here.

Every file begins with its format, the format's version, and the program that wrote it.
"""

from __future__ import annotations

import json
import math
import types
from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass
from enum import Enum
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeAlias, Union, final, get_args, get_origin, get_type_hints

import numpy as np
from jaxtyping import AbstractArray
from scipy.interpolate import PPoly

import go2_wbc
from go2_wbc.errors import Go2WbcError, MotionFileError, unknown_name
from motions.arguments import is_number

Json: TypeAlias = Any  #: What ``json.loads`` gives, or takes
Kind: TypeAlias = Any  #: An annotation
Decoded: TypeAlias = Any  #: An instance of it
_ARRAY = "array"
_NUMBERS = "bif"  #: What NumPy calls truth values, whole numbers and floats


@final
@dataclass(frozen=True, slots=True)
class Encoder:
    """Turns values into JSON."""

    arrays: dict[str, np.ndarray] | None = None
    """Takes the arrays, by the names that JSON has for them; None where a file holds none."""

    def encoded(self, value: object, where: str) -> Json:
        """``value`` as JSON has it; a member of an enum by its word, a leg by its name.

        Args:
            value: a finite number, a word, nothing, an array, piecewise polynomials, or a tuple,
                set, mapping or dataclass of such; a field that is nan by default may be nan.
            where: what messages call it.

        Raises:
            MotionFileError: for anything else, such as a function.
        """
        if isinstance(value, Enum):
            return _word(value)
        if value is None or isinstance(value, bool | str):
            return value
        if is_number(value):
            return int(value) if isinstance(value, Integral) else float(value)
        if isinstance(value, tuple | list):
            return [self.encoded(item, f"{where}[{i}]") for i, item in enumerate(value)]
        if isinstance(value, frozenset):
            return [self.encoded(item, where) for item in sorted(value)]
        if isinstance(value, Mapping):
            return {
                str(self.encoded(key, where)): self.encoded(value[key], f"{where}.{key}")
                for key in value
            }
        if is_dataclass(value) and not isinstance(value, type):
            told = [(item, getattr(value, item.name)) for item in _given(type(value))]
            known = [(item, own) for item, own in told if not _is_nan(own, item.default)]
            return self.encoded({item.name: own for item, own in known}, where)
        return self._arrays_of(value, where)

    def _arrays_of(self, value: object, where: str) -> Json:
        if isinstance(value, PPoly):
            return self.encoded({"x": value.x, "c": value.c}, where)
        if self.arrays is None or not isinstance(value, np.ndarray):
            raise MotionFileError(
                f"{where} is {value!r:.80}: a file holds finite numbers, words and lists of such; "
                "save the plan instead (save_plan)"
            )
        self.arrays[where] = value
        return {_ARRAY: where}


@final
@dataclass(frozen=True, slots=True)
class Decoder:
    """Turns JSON into values."""

    arrays: Mapping[str, np.ndarray] = field(default_factory=dict)  #: of the file

    def decoded(self, value: Json, kind: Kind, where: str) -> Decoded:
        """The ``kind`` that ``value`` stands for.

        Args:
            value: what JSON says.
            kind: an annotation: a number, ``str``, an enum, an array, ``PPoly``, a dataclass; a
                tuple, frozenset or mapping of such; or a union.
            where: what messages call it.

        Raises:
            MotionFileError: if it stands for none; says where and what would be right.
        """
        if get_origin(kind) is not None:
            return self._collection(value, kind, where)
        if is_dataclass(kind):
            return self.fields(value, kind, where)
        if kind is PPoly:
            return self._polynomials(value, where)
        if isinstance(kind, type) and issubclass(kind, Enum):
            return _enum(value, kind, where)
        if isinstance(kind, type) and issubclass(kind, AbstractArray):
            return self._array(value, kind, where)
        return _plain(value, kind, where)

    def fields(
        self,
        value: Json,
        kind: Kind,
        where: str,
        ready: Mapping[str, object] = types.MappingProxyType({}),
    ) -> Decoded:
        """The dataclass ``kind`` with the fields that ``value`` gives; others keep their defaults.

        Args:
            value: what JSON says of it: an object.
            where: what messages call it.
            ready: fields that were read before.

        Raises:
            MotionFileError: for a field that it does not have, lacks, or whose value is wrong.
        """
        given = {item.name: item for item in _given(kind) if item.name not in ready}
        for name in required(value, dict, where):
            if name not in given:
                raise MotionFileError(f"{where}: {unknown_name('field', name, given)}")
        defaults = {name: (item.default, item.default_factory) for name, item in given.items()}
        needed = [name for name, known in defaults.items() if known == (MISSING, MISSING)]
        missing = [name for name in needed if name not in value]
        if missing:
            raise MotionFileError(f"{where} lacks {', '.join(missing)}")
        hints = get_type_hints(kind)
        read = {name: self.decoded(value[name], hints[name], f"{where}.{name}") for name in value}
        try:
            return kind(**read, **ready)
        except Go2WbcError as error:
            raise MotionFileError(f"{where}: {error}") from error

    def _collection(self, value: Json, kind: Kind, where: str) -> Decoded:
        origin, kinds = get_origin(kind), get_args(kind)
        if origin in (Union, types.UnionType):
            return self._one_of(value, kinds, where)
        if origin is tuple:
            return self._tuple(value, kinds, where)
        if origin is frozenset:
            return frozenset(self._tuple(value, (*kinds, ...), where))
        if isinstance(origin, type) and issubclass(origin, Mapping):
            return self._mapping(value, kinds, where)
        return _plain(value, kind, where)

    def _one_of(self, value: Json, kinds: tuple[Kind, ...], where: str) -> Decoded:
        if value is None and type(None) in kinds:
            return None
        wrong = []
        for kind in kinds:
            try:
                return self.decoded(value, kind, where)
            except MotionFileError as error:
                wrong.append(error)
        raise wrong[0]

    def _tuple(self, value: Json, kinds: tuple[Kind, ...], where: str) -> tuple[Any, ...]:
        items = required(value, list, where)
        if kinds[-1] is ...:
            kinds = (kinds[0],) * len(items)
        if len(items) != len(kinds):
            raise MotionFileError(f"{where} must be {len(kinds)} values, got {len(items)}")
        pairs = enumerate(zip(items, kinds, strict=True))
        return tuple(self.decoded(item, kind, f"{where}[{i}]") for i, (item, kind) in pairs)

    def _mapping(self, value: Json, kinds: tuple[Kind, ...], where: str) -> dict[Any, Any]:
        key_kind, kind = kinds
        return {
            self.decoded(key, key_kind, where): self.decoded(item, kind, f"{where}.{key}")
            for key, item in required(value, dict, where).items()
        }

    def _array(self, value: Json, kind: Kind, where: str) -> np.ndarray:
        name = required(value, dict, where).get(_ARRAY)
        if name not in self.arrays:
            raise MotionFileError(f"{where} names the array {name!r:.60}, which is not there")
        array = self.arrays[name]
        if not isinstance(array, kind) or array.dtype.kind not in _NUMBERS:
            what = "an array of numbers" if kind is np.ndarray else kind.__name__
            raise MotionFileError(f"{where} must be {what}, got {array.dtype}{list(array.shape)}")
        if not np.isfinite(array).all():
            raise MotionFileError(f"{where} has a value that is not finite")
        return array

    def _polynomials(self, value: Json, where: str) -> PPoly:
        parts = required(value, dict, where)
        x, c = (self._array(parts.get(name), np.ndarray, f"{where}.{name}") for name in "xc")
        if not (x.ndim == 1 and c.ndim > 1 and c.shape[1] == len(x) - 1 and (np.diff(x) > 0).all()):
            raise MotionFileError(
                f"{where} must be polynomials between increasing times, got x {list(x.shape)} and "
                f"c {list(c.shape)}"
            )
        return PPoly(c, x)


def required(value: Json, kind: type, where: str) -> Json:
    """``value``, or MotionFileError if JSON has something else there than a list or object."""
    if not isinstance(value, kind):
        what = {list: "a list", dict: "an object"}[kind]
        raise MotionFileError(f"{where} must be {what}, got {value!r:.60}")
    return value


def _given(kind: Kind) -> list[Field[Any]]:
    return [item for item in fields(kind) if item.init]


def _is_nan(*values: object) -> bool:
    return all(isinstance(value, float) and math.isnan(value) for value in values)


def _word(member: Enum) -> str:
    return member.value if isinstance(member.value, str) else member.name


def _enum(value: Json, kind: type[Enum], where: str) -> Enum:
    words = {_word(member): member for member in kind}
    if not isinstance(value, str) or value not in words:
        raise MotionFileError(unknown_name(where, str(value), words))
    return words[value]


def _plain(value: Json, kind: Kind, where: str) -> Decoded:
    is_flag = isinstance(value, bool)
    if kind is bool and is_flag:
        return value
    if kind is str and isinstance(value, str):
        return value
    if kind is int and isinstance(value, int) and not is_flag:
        return value
    if kind is float and isinstance(value, Real) and is_number(value):
        return float(value)
    wanted = {bool: "true or false", str: "a word", int: "a whole number"}
    what = wanted.get(kind, "a finite number")
    raise MotionFileError(f"{where} must be {what}, got {value!r:.60}")


LARGEST_FILE = 100_000_000
"""A larger file [bytes] is taken for a mistake: own choice. A plan has 0.05 MB a second."""


@dataclass(frozen=True, slots=True)
class Format:
    """A kind of file."""

    name: str  #: what such a file says of itself
    version: int  #: that is written; older ones are read, too
    what: str  #: for a person
    suffix: str  #: ending of its files

    def header(self) -> dict[str, Any]:
        """What a file of this kind begins with."""
        return {"format": self.name, "version": self.version, "go2_wbc": go2_wbc.__version__}

    def without_header(self, fields: object, path: Path) -> dict[str, Any]:
        """``fields`` of a file of this kind, without its header.

        Raises:
            MotionFileError: if it is of another kind, or a newer version of it.
        """
        if not isinstance(fields, Mapping) or fields.get("format") != self.name:
            named = fields.get("format") if isinstance(fields, Mapping) else None
            raise MotionFileError(
                f'{path} is not {self.what}: it must say "format": "{self.name}"'
                + (f", not {named!r:.60}" if named else "")
            )
        version = fields.get("version")
        if type(version) is not int or version < 1:
            raise MotionFileError(f"{path}: version must be a whole number, got {version!r:.60}")
        if version > self.version:
            writer = fields.get("go2_wbc", "another go2_wbc")
            raise MotionFileError(
                f"{path} has version {version} of {self.name}, written by go2_wbc {writer!s:.20}; "
                f"this is go2_wbc {go2_wbc.__version__}, which reads up to version {self.version}: "
                "install a newer one"
            )
        return {name: fields[name] for name in fields if name not in self.header()}


def content_of(path: Path | str) -> bytes:
    """What is in a file.

    Raises:
        MotionFileError: if there is none, or it cannot be read.
    """
    file = Path(path)
    if not file.is_file():
        is_folder = file.is_dir()
        why = f"{file} is a folder, not a file" if is_folder else f"there is no file {file}"
        raise MotionFileError(why)
    try:
        if file.stat().st_size > LARGEST_FILE:
            raise MotionFileError(f"{file} is larger than {LARGEST_FILE / 1e6:g} MB: no motion is")
        return file.read_bytes()
    except OSError as error:
        raise MotionFileError(f"cannot read {file}: {error.strerror or error}") from error


def fields_of(text: bytes, path: Path | str) -> object:
    """What JSON says.

    Raises:
        MotionFileError: if it is none, or has a number that is not finite.
    """
    try:
        return json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:  # UnicodeDecodeError is a ValueError, too
        reason = str(error) or type(error).__name__
        raise MotionFileError(f"{path} is damaged or cut short: {reason:.120}") from error


def _refuse(word: str) -> float:
    raise ValueError(f"{word} is no finite number")
