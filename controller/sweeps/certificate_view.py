"""A certificate as what ``viz`` shows of it, beside the verdict on the motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from controller.sweeps.certify import Certificate, told
from controller.sweeps.identity import digest, identity
from controller.sweeps.motion_study import archive_of, world_of
from controller.sweeps.rows import SEED, Row
from controller.sweeps.summary import CONFIDENCE
from go2_wbc.motion_plan import MotionPlan
from motions import CompiledPlan
from viz.content import CertifiedRate, CertifiedRun, ReplayContent

_HOLDS_FOR = ("version", "code", "plan", "libraries", "python")
"""What is named of a certificate's ``about``, besides its world."""


def with_certificate(
    content: ReplayContent, certificate: Certificate, plan: MotionPlan
) -> ReplayContent:
    """``content``, whose verdict is on ``plan``, with the certificate beside that verdict."""
    if content.verdict is None:
        return content
    certified = certified_rate(certificate, plan)
    return replace(content, verdict=replace(content.verdict, certified=certified))


def certified_rate(certificate: Certificate, plan: MotionPlan) -> CertifiedRate:
    """A certificate as ``viz`` takes it, and why it does not hold for ``plan`` as it is now."""
    about = certificate.about
    return CertifiedRate(
        n=certificate.n,
        done=certificate.done,
        interval=certificate.interval,
        confidence=CONFIDENCE,
        world=str(world_of(about["world"])),
        worst=tuple(map(_run, certificate.worst)),
        versions={name: about[name] for name in _HOLDS_FOR if name in about},
        outdated=_outdated(about, plan),
    )


def _run(row: Row) -> CertifiedRun:
    conditions = f"friction {row['friction']:.2f}, mass {row['mass_scale']:.2f}"
    return CertifiedRun(int(row[SEED]), conditions, bool(row["done"]), told(row))


def _outdated(about: Mapping[str, str], plan: MotionPlan) -> str:
    """What has changed since the runs; empty if nothing has."""
    own = digest(archive_of(plan)) if isinstance(plan, CompiledPlan) else ""
    now = {"plan": own, **identity()}
    other = [name for name in now if now[name] != about.get(name)]
    return f"Of another {', '.join(other)} than this: certify it again." if other else ""
