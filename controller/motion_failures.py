"""What went wrong with a motion that was played in MuJoCo, judged by the simulator's truth."""

from __future__ import annotations

import math
from dataclasses import dataclass

from controller.motion_measurement import MotionMeasurement
from go2_wbc.motion_plan import MotionPlan
from motions import CompiledPlan

STRICT, STOPS, LENIENT, FELL = "strict", "stops", "lenient", "fell"
UNPLANNED, NOT_DONE = "no plan was found", "not done"
OFF_TRUNK, OFF_TURN, OFF_PAW, OFF_LANDING = 0.030, math.radians(8.0), 0.030, 0.015
"""How far [m, rad] trunk, raised feet and landed feet may be off what was written, strictly."""
SOLVED_OFF, SOLVED_LANDING = 0.050, 0.040
"""The same where a part is solved: the tolerance that a timeline gives by itself, and how near its
place a jump must land."""
SLIP = 0.010
"""Distance [m] that a standing foot may slide."""
MOMENT = 0.010
"""Time [s] for which motors may be saturated, joints on a stop, and what must not touch touch."""
BEYOND = 0.02
"""Angle [rad] by which a joint may be past its limit, strictly."""
LENIENT_OFF = 0.05
"""Distance [m] that anything may be off what was written, leniently."""


@dataclass(frozen=True, slots=True)
class MotionFailures:
    """What went wrong, in words, by each definition; nothing did where it is empty.

    Attributes:
        strict: what an author sees: not done, or not as it was written.
        stops: the same, or a joint was pressed against its stop: MuJoCo's hold a joint within
            0.02 rad of its limit, so a motion that asks for more often looks done.
        lenient: distances from the plan, with more room, whatever ``play`` says.
        fell: nothing else.
    """

    strict: tuple[str, ...]
    stops: tuple[str, ...]
    lenient: tuple[str, ...]
    fell: tuple[str, ...]

    def by(self, definition: str) -> tuple[str, ...]:
        """What went wrong by ``STRICT``, ``STOPS``, ``LENIENT`` or ``FELL``."""
        found: tuple[str, ...] = getattr(self, definition)
        return found


def failures_of(run: MotionMeasurement, plan: MotionPlan) -> MotionFailures:
    """Judge what was measured by all definitions."""
    fell = _true({"fell": run.fall is not None})
    if any(problem.check == "dynamic plan" for problem in getattr(plan, "problems", ())):
        unplanned = (UNPLANNED, *fell)
        return MotionFailures(unplanned, unplanned, unplanned, fell)
    strict = _strictly(run, plan)
    pressed = _true({f"on a stop {1e3 * run.stopped:.0f} ms": run.stopped > MOMENT})
    return MotionFailures(strict, (*strict, *pressed), _leniently(run, plan), fell)


def shares_of(run: MotionMeasurement, plan: MotionPlan) -> dict[str, tuple[float, str]]:
    """What the strict definition looks at, by name: its share of what is allowed, and in words.

    A share above 1 is wrong.
    """
    is_solved = isinstance(plan, CompiledPlan) and bool(plan.dynamic)
    off, landing = (SOLVED_OFF, SOLVED_LANDING) if is_solved else (OFF_TRUNK, OFF_LANDING)
    paw, landed = max(run.paw_off, _short(plan)), run.landed_off
    beyond = -run.joint_distance
    return {
        "slip": (run.slip / SLIP, f"slip {1e3 * run.slip:.0f} mm"),
        "place": (run.trunk_off / off, f"trunk {1e3 * run.trunk_off:.0f} mm off"),
        "attitude": (
            run.turned_off / OFF_TURN,
            f"trunk {math.degrees(run.turned_off):.1f} deg off",
        ),
        "paw": (paw / (off if is_solved else OFF_PAW), f"paw {1e3 * paw:.0f} mm off"),
        "landing": (landed / landing, f"landed {1e3 * landed:.0f} mm beside"),
        "touch": (run.touched / MOMENT, f"touch {1e3 * run.touched:.0f} ms"),
        "torque": (run.saturated / MOMENT, f"saturated {1e3 * run.saturated:.0f} ms"),
        "joints": (beyond / BEYOND, f"joint {beyond:.3f} rad past"),
    }


def _strictly(run: MotionMeasurement, plan: MotionPlan) -> tuple[str, ...]:
    ends = _true({"fell": run.fall is not None, NOT_DONE: not run.said})
    return (*ends, *(words for share, words in shares_of(run, plan).values() if share > 1.0))


def _leniently(run: MotionMeasurement, plan: MotionPlan) -> tuple[str, ...]:
    off = max(run.tracking, run.ends_off, run.feet_off, _short(plan) - run.feet_off)
    return _true(
        {
            "fell": run.fall is not None,
            f"slip {1e3 * run.slip:.0f} mm": run.slip > SLIP,
            f"{1e3 * off:.0f} mm off": off > LENIENT_OFF,
            f"touch {1e3 * run.touched:.0f} ms": run.touched > MOMENT,
            f"saturated {1e3 * run.saturated:.0f} ms": run.saturated > MOMENT,
            f"joint {-run.joint_distance:.3f} rad past": run.joint_distance < 0.0,
            f"joint at {100.0 * run.speed:.0f} % speed": run.speed > 1.0,
        }
    )


def _short(plan: MotionPlan) -> float:
    """Largest distance [m] by which a leg is too short for what was written."""
    misses = [problem.miss for problem in getattr(plan, "problems", ())]
    return max((miss for miss in misses if miss > 0.0), default=0.0)


def _true(found: dict[str, bool]) -> tuple[str, ...]:
    return tuple(what for what, is_so in found.items() if is_so)
