"""The optional part of the installation that the Unitree bridge needs."""

from __future__ import annotations

import importlib
from typing import Final

from go2_wbc.errors import MissingDependency

INSTALL_LINE: Final = 'python -m pip install -e ".[unitree]"'


def require_dds() -> None:
    """Make sure that the DDS library is installed and works.

    Raises:
        MissingDependency: if not; names the install line.
    """
    try:
        importlib.import_module("cyclonedds.core")
    except ImportError as error:
        raise MissingDependency(
            f"Unitree's protocol needs CycloneDDS ({error}): {INSTALL_LINE}"
        ) from error
