"""Sweeps are run by ``go2-wbc``, too."""

from tests.controller.cli.conftest import run

__all__ = ["run"]
