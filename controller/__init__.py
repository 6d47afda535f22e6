"""``GO2Controller`` and everything behind it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from controller.go2_controller import GO2Controller
    from controller.modes import Mode, Outcome
    from controller.sweeps.certify import Certificate, certify
    from controller.sweeps.run import sweep

__all__ = ["Certificate", "GO2Controller", "Mode", "Outcome", "certify", "sweep"]

__getattr__ = lazy_exports(__name__)
