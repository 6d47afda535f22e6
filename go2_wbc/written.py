"""A function that is compiled, and what is known of it without the compiler."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import update_wrapper
from typing import Annotated, Any, TypeVar

T = TypeVar("T")

FOREIGN = "foreign"
Foreign = Annotated[T, FOREIGN]
"""An array that is only read, and may come from elsewhere: read-only, or with gaps."""


class Written(ABC):
    """A function that is compiled.

    Attributes:
        python: the function as others call it.
        written: the function itself; a type checker may be around it.
        nogil: whether other threads run meanwhile.
    """

    __name__: str

    def __init__(self, function: Callable[..., Any], *, nogil: bool = False) -> None:
        """Nothing is looked at before it is needed: importing a module takes no time."""
        self.python = function
        self.written: Any = inspect.unwrap(function)
        self.nogil = nogil
        update_wrapper(self, function)

    @property
    def name(self) -> str:
        """Module and function."""
        return f"{self.written.__module__}.{self.written.__qualname__}"

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of its parameters."""
        return self.written.__code__.co_varnames[: self.written.__code__.co_argcount]

    @property
    @abstractmethod
    def signature(self) -> Any:
        """As Numba has it."""

    def __call__(self, *arguments: Any) -> Any:
        """The Python."""
        return self.python(*arguments)
