"""A value in one line, at the prompt, in a list or in a log; and as a page in a notebook."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping
from importlib.metadata import entry_points

import numpy as np

LONGEST = 200  #: Characters of a line
MOST_ITEMS = 6  #: More of them are counted, not listed


def brief(self: object) -> str:
    """What a dataclass says of itself as its ``__repr__``: the fields that are not as by default.

    Arrays that are no vector are told by their shape, long collections by their
    number, numbers by four digits.
    """
    words = list[str]()
    for field in dataclasses.fields(self):  # type: ignore[arg-type]
        value = getattr(self, field.name)
        default = field.default
        if field.default_factory is not dataclasses.MISSING:
            default = field.default_factory()
        if field.repr and (isinstance(value, np.ndarray) or value != default):
            words.append(f"{field.name}={told(value)}")
    return cut(f"{type(self).__name__}({', '.join(words)})")


def inline_html(self: object) -> str | None:
    """What a notebook shows of an object, as its ``_repr_html_``; None without a package for it."""
    for entry in entry_points(group="go2_wbc.inline"):
        shown: str | None = entry.load()(self)
        return shown
    return None


def told(value: object) -> str:
    """A value of a field, in few characters."""
    if isinstance(value, np.ndarray):
        shape = " x ".join(map(str, value.shape))
        return told(tuple(value.tolist())) if value.shape in {(3,), (4,)} else f"<{shape}>"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, str) or not isinstance(value, Collection):
        return repr(value)
    if len(value) > MOST_ITEMS:
        return f"<{len(value)} items>"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key!r}: {told(item)}" for key, item in value.items()) + "}"
    return "(" + ", ".join(map(told, value)) + ")"


def cut(line: str) -> str:
    """``line``, its end left out if it is longer than ``LONGEST``."""
    return line if len(line) <= LONGEST else f"{line[: LONGEST - 4]}...{line[-1]}"


def counted(number: int, what: str) -> str:
    """``1 limit``, ``2 limits``."""
    return f"{number} {what}{'' if number == 1 else 's'}"
