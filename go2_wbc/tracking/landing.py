"""How the feet of a plan land: when they touch the ground, not when it was planned.

The state of a stepping foot, from tick to tick:

    | state  | the plan asks for       | contact | next state   | command                     |
    |--------|-------------------------|---------|--------------|-----------------------------|
    | down   | stance                  | any     | down         | stand                       |
    | down   | swing, as of now        | any     | in the air   | swing as planned            |
    | down   | swing, still            | any     | down         | stand: it has landed early  |
    | in air | swing, less than 60 %   | any     | in the air   | swing as planned            |
    | in air | swing, 60 % and more    | no      | in the air   | swing as planned            |
    | in air | swing, 60 % and more    | yes     | down         | stand                       |
    | in air | stance                  | yes     | down         | stand                       |
    | in air | stance, for up to 0.2 s | no      | in the air   | swing, pressed downwards    |
    | in air | stance, for longer      | no      | down         | stand; counted as missed    |
    | any    | joints                  | any     | down         | follow its joints           |

- A foot that continued to its planned foothold after an early touchdown would push against the
  ground. The plan's time is not changed by an early landing, so motions stay on their beat.
- A foot declared to stand before it has contact would stay in the air: the controller would hold it
  there, and count on a force that the ground does not give. After ``TIME_OUT`` it counts as
  standing nevertheless: uneven ground would have been reached by then, and a contact sensor that
  fails must not keep a leg in the air.
- The load of a stance foot is ramped up from its touchdown.
- The ground's height is learnt from feet with measured contact, once per landing.
- While a foot stands, the others swing to the plan's footholds in the world, so that the error of
  one step is not in the next. In flight no leg can change the path of the CoM. There the plan moves
  with the CoM (x and y), but for the first ``NEAR``: so the feet land below the body nearly as
  planned, and the next jump starts from where this one has ended. Within ``NEAR`` the feet land at
  their planned footholds, and the legs bring the body back over them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.compilation import Foreign, subroutine
from go2_wbc.contacts import TIE
from go2_wbc.records import Record
from go2_wbc.reference import JOINTS, STANCE, SWING, Anchor, Target
from go2_wbc.robot.state import Snapshot
from go2_wbc.tracking.plan_curves import StanceLoad, set_load

EARLIEST = 0.6
"""Share of a swing after which a contact is a landing: before, it is the lift-off's, or a stone's.
From a prototype: the peak force on a foot went from 496 to 297 N."""
PRESS_SPEED = 0.4
"""Speed [m/s] at which a foot that is late goes down: own choice, slower than it swings."""
PRESS_DEPTH = 0.06
"""Greatest depth [m] below the ground that it looks for: what a standing leg can still reach."""
TIME_OUT = 0.2
"""Time [s] after which a foot without contact counts as standing: it reaches the depth in 0.15."""
PLAN_SHARE = 0.3
"""Share of how much higher than planned a foot landed by which the rest of the plan is raised."""
NEAR = 0.02
"""Distance [m] by which the CoM may be off its plan when feet come down in their places all the
same: a tenth of the way to the edge of their support. Far jumps land half as far beside."""


@dataclass(frozen=True, slots=True)
class Landings:
    """What came of a plan's landings."""

    missed: int  #: feet that had no contact even ``TIME_OUT`` after they should have come down
    error: float | None
    """Greatest distance [m], on the level, of a foot that had landed from the place where the plan,
    as it was placed at its start, wanted it; None if none has landed."""


class SteppingFoot(Record):
    """A foot that steps."""

    planned: float  #: what the plan asked of its leg at last, a value of ``LegTask``
    is_in_air: bool  #: whether it has lifted off and not come down
    is_awaited: bool  #: whether how far from its place it lands is still to be judged
    touchdown: float  #: when it came down [s]; -inf if it has not yet


class Landing(Record):
    """Where a plan is, which landings move, and how its feet are."""

    anchor: Anchor  #: where the plan is now
    origin: Anchor  #: where it was at first
    feet: tuple[SteppingFoot, SteppingFoot, SteppingFoot, SteppingFoot]  #: all of them
    missed: float  #: see ``Landings``
    error: float  #: see ``Landings``

    @staticmethod
    def at(anchor: Anchor) -> Landing:
        """All feet stand, of a plan at ``anchor``."""
        landing = Landing(anchor=anchor, origin=anchor)
        for foot in landing.feet:
            foot.touchdown = -np.inf
        return landing


@subroutine
def land(
    t: float,
    contact: Foreign[Bool[np.ndarray, "4"]],
    events: Foreign[Float[np.ndarray, " m"]],
    changes: Foreign[Float[np.ndarray, "m 4 3"]],
    load: StanceLoad,
    now: Snapshot,
    s: Landing,
    target: Target,
) -> None:
    """Change ``target``, a plan in the world, to what the feet's measured contacts make of it.

    ``changes``: from each of ``events`` on, when each foot's contact changed last, when it changes
    next, and when the foot starts to give up its load for that; see ``plan_tracking``.
    """
    event = max(np.searchsorted(events, t + TIE, side="right") - 1, 0)
    stands = False
    for leg in range(4):
        foot, planned = s.feet[leg], target.legs[leg]
        start, end, unload = changes[event, leg, 0], changes[event, leg, 1], changes[event, leg, 2]
        follow_plan(foot, planned)
        if planned == JOINTS:
            continue
        if foot.is_in_air:
            notice(leg, t, t - start, end - start, contact[leg], now, s)
        if foot.is_in_air:
            target.legs[leg] = SWING
            target.normal_force_min[leg] = target.normal_force_max[leg] = 0.0
            if planned == STANCE:
                press(leg, t - start, target)
            continue
        stands = True
        target.legs[leg] = STANCE
        if foot.touchdown > -np.inf:
            left = unload - t if planned == STANCE else np.inf
            set_load(leg, min(t - foot.touchdown, left), load, target)
        if planned == STANCE and foot.is_awaited:
            judge(leg, now, s, target)
    if not stands:
        carry(now, s, target)


@subroutine
def follow_plan(foot: SteppingFoot, planned: float) -> None:
    """Note what is planned for the foot from now on."""
    if planned == JOINTS:
        foot.is_in_air = foot.is_awaited = False
        foot.touchdown = -np.inf
    elif planned == SWING and foot.planned != SWING:
        foot.is_in_air = foot.is_awaited = True
    foot.planned = planned


@subroutine
def notice(
    leg: int, t: float, elapsed: float, duration: float, contact: bool, now: Snapshot, s: Landing
) -> None:
    """Find out whether a foot in the air has come down.

    That is ``elapsed`` seconds after its contact should have changed last, ``duration`` before
    it should the next time.
    """
    foot = s.feet[leg]
    may_land = foot.planned == STANCE or elapsed >= EARLIEST * duration
    if may_land and contact:
        ground = now.p_world_feet[leg, 2] - now.foot_radius
        s.anchor.p_world[2] += PLAN_SHARE * (ground - s.anchor.p_world[2])
    elif foot.planned == STANCE and elapsed > TIME_OUT:
        s.missed += 1.0
    else:
        return
    foot.is_in_air = False
    foot.touchdown = t


@subroutine
def press(leg: int, late: float, target: Target) -> None:
    """Let a foot that should stand go on downwards, ``late`` seconds after it should have."""
    depth = PRESS_SPEED * late
    for i in range(3):
        target.v_world_feet[leg, i] = target.a_world_feet[leg, i] = 0.0
    if depth < PRESS_DEPTH:
        target.v_world_feet[leg, 2] = -PRESS_SPEED
    target.p_world_feet[leg, 2] -= min(depth, PRESS_DEPTH)


@subroutine
def judge(leg: int, now: Snapshot, s: Landing, target: Target) -> None:
    """Note how far from its place, as planned at first, a foot has landed."""
    s.feet[leg].is_awaited = False
    off = 0.0
    for i in range(2):
        moved = s.anchor.p_world[i] - s.origin.p_world[i]
        off += (now.p_world_feet[leg, i] - target.p_world_feet[leg, i] + moved) ** 2
    s.error = max(s.error, np.sqrt(off))


@subroutine
def carry(now: Snapshot, s: Landing, target: Target) -> None:
    """Move the plan to where the CoM is, but for what the legs can make up for."""
    away = np.hypot(now.p_world_com[0] - target.p_world[0], now.p_world_com[1] - target.p_world[1])
    share = 1.0 - NEAR / max(away, NEAR)
    for i in range(2):
        off = share * (now.p_world_com[i] - target.p_world[i])
        s.anchor.p_world[i] += off
        target.p_world[i] += off
        faster = share * (now.v_world_com[i] - target.v_world[i])
        for leg in range(4):
            target.p_world_feet[leg, i] += off
            target.v_world_feet[leg, i] += faster
