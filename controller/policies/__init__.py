"""Learned policies: what the numbers of one mean, running it, looking it over, and cloning one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from controller.policies.cloning import Course, clone
    from controller.policies.policy import Policy
    from controller.policies.probing import Finding, probe
    from controller.policies.sidecar import Sidecar

__all__ = ["TROT", "Course", "Finding", "Policy", "Sidecar", "clone", "probe"]

TROT = Path(__file__).parent / "trot.onnx"
"""A trot that was cloned from the whole-body controller's; its sidecar lies beside it."""

__getattr__ = lazy_exports(__name__)
