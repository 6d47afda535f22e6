"""Compiled against plain: a kernel does what the Python that it is written in does."""

from collections.abc import Callable

from benchmarks.plain import NEAR, copied, difference
from go2_wbc.compilation import Kernel, call_plain


def assert_plain_is_compiled(
    kernel: Callable[..., object], *arguments: object, tolerance: float = NEAR
) -> None:
    """Both ways, each on copies: what is returned and what is filled must be the same."""
    assert isinstance(kernel, Kernel)
    ours, theirs = ([copied(value) for value in arguments] for _ in range(2))
    given, expected = kernel(*ours), call_plain(kernel, *theirs)
    for compiled, plain in [*zip(ours, theirs, strict=True), (given, expected)]:
        assert difference(compiled, plain) <= tolerance
