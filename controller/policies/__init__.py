"""Learned policies: what a file of one means, running it, and a probe that finds what is wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from controller.policies.policy import Policy
    from controller.policies.probe import probe
    from controller.policies.sidecar import Sidecar

__all__ = ["Policy", "Sidecar", "probe"]

__getattr__ = lazy_exports(__name__)
