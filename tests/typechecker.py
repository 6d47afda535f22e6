"""The check of every argument under pytest: as types say it, a whole number is a number too.

A check costs many times what most functions do, and a scenario of a minute makes the same calls
tens of thousands of times. So in each phase of a test (setting up, the test itself) the first
``CHECKED_CALLS`` calls are all checked, and of the later ones every ``STRIDE``-th.
"""

from __future__ import annotations

from beartype import BeartypeConf, beartype
from jaxtyping import config

checked = beartype(conf=BeartypeConf(is_pep484_tower=True))
"""Decorator of each function of the modules that ``conftest.py`` names."""

CHECKED_CALLS = 10_000
"""About 0.3 s; all that a test makes which is not a scenario."""
STRIDE = 61
"""Prime, so that the calls of a loop come up in turn, whatever their number."""


class Ration(type(config)):
    """Tells jaxtyping, before each call that it would check, whether to go without.

    Attributes:
        calls: how many there were since the last ``renew``.
    """

    calls = 0

    @property
    def jaxtyping_disable(self) -> bool:
        """Whether this call goes unchecked; asked once a call."""
        Ration.calls += 1
        return Ration.calls > CHECKED_CALLS and Ration.calls % STRIDE != 0


def ration() -> None:
    """Leave most of the repetitions in long loops unchecked, from now on."""
    config.__class__ = Ration


def renew() -> None:
    """Check all of the next ``CHECKED_CALLS`` calls again."""
    Ration.calls = 0
