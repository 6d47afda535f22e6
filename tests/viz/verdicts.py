"""A made-up verdict with everything that the viewers draw."""

import numpy as np

from viz.content import Annotation, MarginCurve, Verdict

_TEXT = "1.2, limit 1 <b>"


def made_up_verdict(duration: float) -> Verdict:
    """A calf over its limit in the middle fifth, the CoM at one instant, friction tight."""
    time = np.linspace(0.0, duration, 400)
    middle = np.abs(time / duration - 0.5) < 0.1
    calf = np.where(middle, -0.2, 0.5)
    support = np.where(np.arange(400) == 80, -0.01, 0.05)
    friction = np.where(middle, np.nan, 0.03)
    spans = ((float(time[middle][0]), float(time[middle][-1])),)
    instant = float(time[80])
    return Verdict(
        ok=False,
        text="2 limits broken, 1 tight margin",
        annotations=(
            Annotation("support", "CoM", instant, _TEXT, True, ((instant, instant),), ("com",)),
            Annotation("joint position", "FR_calf", duration / 2, _TEXT, True, spans, ("FR_calf",)),
            Annotation("friction", "RL", 0.0, _TEXT, False, ((0.0, 0.1),), ("RL_foot",)),
        ),
        curves=(
            _curve("torque", "N m", time, np.full(400, 9.0)),
            _curve("friction", "", time, friction, tight=0.05),
            _curve("joint position", "rad", time, calf, subjects=("FL_calf", "FR_calf")),
            _curve("support", "m", time, support),
            _curve("entry and exit", "m", np.array([0.0, duration]), np.array([np.inf, -np.inf])),
        ),
    )


def _curve(
    name: str,
    unit: str,
    time: np.ndarray,
    margin: np.ndarray,
    *,
    subjects: tuple[str, ...] = ("trunk",),
    tight: float = 0.0,
) -> MarginCurve:
    worst = np.full(len(time), len(subjects) - 1)
    return MarginCurve(name, unit, time, margin, subjects, worst, tight)
