"""Checks that need no forces: reach, joint speeds, clearance, landings, smoothness and the ends.

Everything is geometry of the ``Trajectory``, in the frame of the motion: z up, ground at z = 0.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.legs import LEGS, Leg
from go2_wbc.motion_plan import MotionPlan, Posture
from go2_wbc.reference import Anchor
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from motions.feasibility.bodies import LinkHulls
from motions.feasibility.forces import FEET, JOINTS, Case
from motions.feasibility.joint_stops import sinking
from motions.feasibility.report import Series
from motions.postures import home_poses

ENDS = ("entry", "exit")
RAISED = 0.006
"""Height [m] from which on a foot that does not stand is raised when a motion begins."""
LOW, FAST = 0.004, 0.45
"""Height [m] above its place at which a foot may meet the ground, as trunks lag by that, and speed
[m/s] along it from which on it stays there: feet of 0.5 and 1.6 m/s with 19 mm to go landed 18 and
more beside their places, 8 that had 15 to 44 mm to go at up to 0.4 m/s came to them."""
ON_GROUND = 0.0005
"""Height [m] of a foot's lowest point below which it is on the ground: planned heights are exact,
and it only absorbs rounding."""
JUMPS = (1.0, 5.0, 12.0)
"""Greatest changes of speed between samples of 10 ms, of trunk [m/s], attitude and joints [rad/s],
of a plan without a jump. Motions that are just fast show in forces, torques and slips."""
END_BOUNDS = (0.02, 0.05, 0.1)
"""How far [m, rad] the ends may be from their postures, and greatest speed [m/s, rad/s] there."""
TIGHT_SPEED = 0.1  #: Margin, as share of the least limit, below which a warning is due; own choice


def reach(case: Case) -> Series:
    """Whether the standing legs reach their feet's places."""
    return case.series("reach", "m", FEET, case.path.miss, case.limits.reach)


def joint_speed(case: Case) -> Series:
    """Joint speeds against the URDF's limits."""
    most, speeds = case.model.speed_limits, np.abs(case.path.v[:, 6:])
    tight = TIGHT_SPEED * float(most.min())
    return case.series("joint speed", "rad/s", JOINTS, speeds, most, tight=tight)


def clearance(case: Case, hulls: LinkHulls) -> Series:
    """Heights of the lowest points of the links, and of the feet in the air, over the ground.

    A foot in the air that is to be below the ground stays above, and its calf with it: that may be
    lower by as much. In solved parts a foot that lifts off stands until then: where it sinks in the
    last step of a push-off, by half the square of the step times its J' v, that is the planner's
    integration. Trunk and hips are as low as joints at their stops leave them.
    """
    motion, limits = case.path, case.limits
    feet = case.places[:, :, 2] - case.model.foot_radius
    sunk = np.where(motion.stance | motion.is_dynamic[:, None], 0.0, np.minimum(feet, 0.0))
    links, count = hulls.heights(motion, case.memory), len(hulls.links)
    lower = {"thigh": limits.thigh_clearance, "calf": limits.calf_clearance}
    parts = [name.rpartition(" ")[2] for name in hulls.names]
    least = [lower.get(part, limits.clearance) for part in parts]
    floor = np.tile([*least, *(-limits.swing_depth for _ in LEGS)], (len(motion.times), 1))
    calves = np.flatnonzero([part == "calf" for part in parts])
    floor[np.ix_(motion.is_dynamic, calves)] = limits.solved_calf_clearance
    for calf in calves:
        floor[:, calf] += sunk[:, Leg[hulls.names[calf].partition(" ")[0]]]
    values = np.hstack([links, feet])
    values[:, [part in ("trunk", "hip") for part in [*parts, *FEET]]] -= sinking(case)[:, None]
    is_checked = np.ones_like(values, dtype=bool)
    stood = np.vstack([motion.stance[:1], motion.stance[:-1]]) & motion.is_dynamic[:, None]
    is_checked[:, count:] = ~(motion.stance | stood)
    subjects = (*hulls.names, *(f"{leg.name} foot" for leg in LEGS))
    what = ("clearance", "m", subjects, values, floor)
    return case.series(*what, is_floor=True, where=is_checked)


def dragging(case: Case) -> Series:
    """Ways [m] that feet in the air go sideways while they are on the ground nevertheless.

    Such a foot is not raised, or moves on before it is put down: it rubs, with forces that the plan
    and this check leave out, small as long as it bears nothing. From ``limits.rub`` on that is a
    warning. The way is summed for as long as the foot stays that low.
    """
    motion, limits, places = case.path, case.limits, case.places
    rubs = (places[:, :, 2] - case.model.foot_radius < ON_GROUND) & ~motion.stance
    rubs &= ~motion.is_dynamic[:, None]
    steps = np.linalg.norm(np.diff(places[:, :, :2], axis=0), axis=2)
    ways = np.zeros(rubs.shape)
    for row, leg in np.argwhere(rubs[1:] & rubs[:-1]):
        ways[row + 1, leg] = ways[row, leg] + steps[row, leg]
    tight = limits.drag - limits.rub
    return case.series("dragging", "m", FEET, ways, limits.drag, tight=tight)


def landing(case: Case) -> tuple[Series, Series, Series]:
    """Where and how fast raised feet leave and meet the ground, and how flat they come down.

    A foot is some millimetres off its height, and friction holds it where it meets the ground: what
    it has still to go from ``LOW`` above its place is what it lands beside it, if it is ``FAST``.
    One that is slower is carried on, and one that is dragged all along bears nothing. The speed at
    touchdown is that between the last two samples in the air; a difference to the next one would
    reach to the foot that stands.
    """
    motion, limits, places = case.path, case.limits, case.places
    stands, times = motion.stance, motion.times
    paces = np.linalg.norm(np.diff(places, axis=0), axis=2) / np.diff(times)[:, None]
    away, flat, speed = (np.full(stands.shape, np.nan) for _ in range(3))
    written = ~(motion.is_dynamic[1:] | motion.is_dynamic[:-1])[:, None]
    for edge, leg in np.argwhere((stands[1:] != stands[:-1]) & written):
        lands = stands[edge + 1, leg]
        row, standing = (edge, edge + 1) if lands else (edge + 1, edge)
        away[row, leg] = np.linalg.norm(places[row, leg] - motion.p_feet[standing, leg])
        speed[row, leg] = paces[max(row - 1, 0), leg] if lands else 0.0
        if lands:
            left = places[:standing, leg] - motion.p_feet[standing, leg]
            fast = FAST * (times[1] - times[0])
            flat[row, leg] = _left_to_go(left, stands[:standing, leg], fast)
    return (
        case.series("landing place", "m", FEET, away, limits.landing),
        case.series("flat landing", "m", FEET, flat, limits.flat_landing),
        case.series("landing speed", "m/s", FEET, speed, limits.landing_speed),
    )


def _left_to_go(
    left: Float[np.ndarray, "k 3"], stands: Bool[np.ndarray, " k"], fast: float
) -> float:
    """Way along the ground of a foot ``left`` of its place at each sample, from ``LOW`` on."""
    high = len(left) - 1
    while high > 0 and not stands[high] and left[high, 2] <= LOW:
        high -= 1
    if stands[high] or left[high, 2] <= LOW or high + 1 == len(left):
        return 0.0
    is_fast = np.hypot(*(left[high + 1] - left[high])[:2]) > fast
    return float(np.hypot(*left[high + 1 :, :2].T).max()) if is_fast else 0.0


def smoothness(case: Case) -> Series:
    """Jumps of velocity between samples: m/s of the trunk, rad/s of its attitude and the joints.

    A limit on |v_i+1 - v_i|, so on the acceleration over a sample: 400 rad/s^2 of a joint.
    """
    motion = case.path
    jumps = np.vstack([np.zeros(18), np.abs(np.diff(motion.v, axis=0))])
    values = np.maximum.reduceat(jumps, (0, 3, 6), axis=1)
    subjects, bounds = ("trunk", "trunk turning", "joints"), np.array(JUMPS)
    written = ~motion.is_dynamic
    written[1:] &= ~motion.is_dynamic[:-1]
    return case.series("continuity", "/s", subjects, values, bounds, where=written[:, None])


def ends(case: Case, plan: MotionPlan) -> Series:
    """Whether the motion starts and ends at rest in the postures that it names.

    They are above the feet as they stand then, with their heading. A foot that is lifted from the
    first instant on still stands then.
    """
    motion, model = case.path, case.model
    home, places = home_poses(model), case.places[0]
    names = tuple(f"{end} {what}" for end in ENDS for what in ("place", "attitude", "speed"))
    bounds = np.array(END_BOUNDS * 2)
    values = []
    for row, posture in ((0, plan.entry), (-1, plan.exit)):
        feet = Anchor.of_feet(motion.p_feet[row], model.foot_radius)
        place = feet.p_world + yaw_rotation(feet.yaw) @ home[posture][:3]
        turn = motion.rpy[row] - home[posture][3:]
        turn[2] = wrap_angle(float(turn[2]) - feet.yaw)
        off = (motion.q[row, :3] - place, turn, motion.v[row])
        values += [float(np.abs(part).max()) for part in off]
    is_raised = (places[:, 2] - model.foot_radius > RAISED) & ~motion.stance[0]
    if plan.entry is Posture.LIE or is_raised.any():
        values[0] = np.inf
    if not motion.stance[-1].all():
        values[3] = np.inf
    times, own = np.array([0.0, plan.duration]), np.repeat(np.eye(2, dtype=bool), 3, axis=1)
    table = np.tile(values, (2, 1))
    series = case.series("entry and exit", "m, rad", names, table, bounds, where=own, times=times)
    if not (series.margins[-1, 3:] < 0.0).any():
        return series
    end = plan.exit.value
    way = "home()" if plan.exit is plan.entry else f"posture({end!r})"
    return replace(series, note=f"it is to end in {end}: {way}")
