"""What a motion is made of as JSON, and back: numbers, words, lists and dataclasses.

Reading goes by the annotations of the dataclasses, so that a new kind of key needs nothing here.
"""

from __future__ import annotations

import types
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from enum import Enum
from numbers import Integral, Real
from typing import Any, TypeAlias, Union, get_args, get_origin, get_type_hints

from go2_wbc.errors import Go2WbcError, MotionFileError, unknown_name
from motions.arguments import is_number

Json: TypeAlias = Any
"""What ``json.loads`` gives, or takes."""
Kind: TypeAlias = Any
"""An annotation."""
Decoded: TypeAlias = Any
"""An instance of it."""


def encoded(value: object, where: str) -> Json:
    """``value`` as JSON has it; a member of an enum by its word, a leg by its name.

    Args:
        value: a finite number, a word, nothing, or a tuple, set, mapping or dataclass of such.
        where: what messages call it.

    Raises:
        MotionFileError: for anything else, such as a function.
    """
    if isinstance(value, Enum):
        return _word(value)
    if value is None or isinstance(value, bool | str):
        return value
    if is_number(value):
        return int(value) if isinstance(value, Integral) else float(value)  # type: ignore[arg-type]
    if isinstance(value, tuple | list):
        return [encoded(item, f"{where}[{i}]") for i, item in enumerate(value)]
    if isinstance(value, frozenset):
        return [encoded(item, where) for item in sorted(value)]
    if isinstance(value, Mapping):
        return {str(encoded(key, where)): encoded(value[key], f"{where}.{key}") for key in value}
    if is_dataclass(value) and not isinstance(value, type):
        return {
            field.name: encoded(getattr(value, field.name), f"{where}.{field.name}")
            for field in _given(type(value))
        }
    raise MotionFileError(
        f"{where} is {value!r}: a file holds finite numbers, words and lists of such; "
        "save the plan instead (save_plan)"
    )


def decoded(value: Json, kind: Kind, where: str) -> Decoded:
    """The ``kind`` that ``value`` stands for.

    Args:
        value: what JSON says.
        kind: an annotation: a number, ``str``, an enum, a dataclass; a tuple, frozenset or mapping
            of such; or a union.
        where: what messages call it.

    Raises:
        MotionFileError: if it stands for none; says where and what would be right.
    """
    origin = get_origin(kind)
    if origin in (Union, types.UnionType):
        return _one_of(value, get_args(kind), where)
    if origin is tuple:
        return _tuple(value, get_args(kind), where)
    if origin is frozenset:
        return frozenset(_tuple(value, (*get_args(kind), ...), where))
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return _mapping(value, get_args(kind), where)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return _enum(value, kind, where)
    if is_dataclass(kind):
        return decoded_fields(value, kind, where)
    return _plain(value, kind, where)


def decoded_fields(
    value: Json, kind: Kind, where: str, ready: Mapping[str, object] = types.MappingProxyType({})
) -> Decoded:
    """The dataclass ``kind`` with the fields that ``value`` gives; others keep their defaults.

    Args:
        value: what JSON says of it: an object.
        kind: the class.
        where: what messages call it.
        ready: fields that were read before.

    Raises:
        MotionFileError: for a field that it does not have, lacks, or whose value is wrong.
    """
    given = {field.name: field for field in _given(kind) if field.name not in ready}
    for name in required(value, dict, where):
        if name not in given:
            raise MotionFileError(f"{where}: {unknown_name('field', name, given)}")
    missing = [name for name, field in given.items() if _is_needed(field) and name not in value]
    if missing:
        raise MotionFileError(f"{where} lacks {', '.join(missing)}")
    hints = get_type_hints(kind)
    read = {name: decoded(value[name], hints[name], f"{where}.{name}") for name in value}
    try:
        return kind(**read, **ready)
    except Go2WbcError as error:
        raise MotionFileError(f"{where}: {error}") from error


def required(value: Json, kind: type, where: str) -> Json:
    """``value``, or MotionFileError if JSON has something else there than a list or object."""
    if not isinstance(value, kind):
        what = {list: "a list", dict: "an object"}[kind]
        raise MotionFileError(f"{where} must be {what}, got {value!r:.60}")
    return value


def _given(kind: Kind) -> list[Field[Any]]:
    return [field for field in fields(kind) if field.init]


def _is_needed(field: Field[Any]) -> bool:
    return field.default is MISSING and field.default_factory is MISSING


def _word(member: Enum) -> str:
    return member.value if isinstance(member.value, str) else member.name


def _one_of(value: Json, kinds: tuple[Any, ...], where: str) -> Decoded:
    if value is None and type(None) in kinds:
        return None
    wrong = []
    for kind in kinds:
        try:
            return decoded(value, kind, where)
        except MotionFileError as error:
            wrong.append(error)
    raise wrong[0]


def _tuple(value: Json, kinds: tuple[Any, ...], where: str) -> tuple[Any, ...]:
    items = required(value, list, where)
    if kinds[-1] is ...:
        kinds = (kinds[0],) * len(items)
    if len(items) != len(kinds):
        raise MotionFileError(f"{where} must be {len(kinds)} values, got {len(items)}")
    pairs = enumerate(zip(items, kinds, strict=True))
    return tuple(decoded(item, kind, f"{where}[{i}]") for i, (item, kind) in pairs)


def _mapping(value: Json, kinds: tuple[Any, ...], where: str) -> dict[Any, Any]:
    key_kind, kind = kinds
    return {
        decoded(key, key_kind, where): decoded(item, kind, f"{where}.{key}")
        for key, item in required(value, dict, where).items()
    }


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
