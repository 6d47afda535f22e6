"""Motions of a robot on the ground, by joint servos alone: fold the legs, go limp, roll over.

The trunk is round: with its legs folded the robot comes to rest on its belly or on its back. The
thighs can point past the back, so from there the legs of one side push against the ground and roll
the robot over to the other side, onto its belly. A trunk with flat sides, as the Go1's, may lie on
one of them: once a roll to either side has failed, the legs below it push beside the back. A leg
that is jammed beside the trunk after a fall comes free if its hip turns outwards first.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from controller.behaviours import Behaviour, Damped, ServoJoints
from controller.loop import ControlLoop
from controller.modes import unfolded_legs
from controller.runner import Runner
from go2_wbc.legs import LEGS, Leg

ON_BELLY = 0.6  #: Tilt [rad] below which the robot lies on its belly
TUCK_TIME = 0.9  #: Time [s] of drawing the feet under the hips while lying
SPLAY_TIME = 0.5  #: Time [s] of spreading the folded legs until the belly is on the ground
LIMP_TIME = 0.6  #: Time [s] for which the robot is left to sink before it counts as lying
STEP_LIMIT = 4.0  #: Time [s] in which one step of rolling over must end
GRACE = 0.5  #: Time [s] by which a servo may end later than planned
TRIES = 6  #: How often it rolls, or frees a leg, before it gives up
REACHED_BACK = (-0.3, 3.4, -2.66)
"""Joint angles [rad] of a left leg folded past the back, and inwards."""
PUSHING = (0.8, 3.4, -0.9)
"""Joint angles [rad] of a left leg stretched past the back and outwards: it lifts its side."""
PUSHING_BESIDE = (-0.8, 3.4, -0.9)
"""The same of a robot that lies on that side: what points past the back goes the other way."""
ON_SIDE = (1.2, 2.0)  #: Rolls [rad] at which it lies on a side, as a flat one may
OUTWARDS = 0.7  #: Hip angle [rad] at which a left leg swings past the trunk without touching it


def tuck(runner: Runner) -> None:
    """Fold the legs below the trunk, ready to rise.

    Raises:
        Aborted: if the robot does not lie on its belly, or a leg does not fold; it then counts as
            fallen. Also if it is tipped meanwhile.
    """
    loop = runner.loop
    if loop.state.tilt > ON_BELLY:
        runner.give_up(f"cannot stand up from {_attitude(loop)}; call recover()")
    way = ((TUCK_TIME, loop.model.profile.tucked_joints),)
    runner.run(ServoJoints("tuck", way, stays_on_belly=True), TUCK_TIME + GRACE)
    jammed = unfolded_legs(loop.snapshot)
    if jammed:
        runner.give_up(f"cannot stand up: {_names(jammed)} not below the trunk; call recover()")


def lie_limp(runner: Runner) -> None:
    """Spread the folded legs and go limp."""
    if runner.loop.state.tilt < ON_BELLY:  # or it would rest on folded legs, belly in the air
        way = ((SPLAY_TIME, runner.loop.model.profile.splayed_joints),)
        splay = ServoJoints("splay", way, stays_on_belly=True)
        runner.run(splay, SPLAY_TIME + GRACE)
    runner.run(Damped("lie", LIMP_TIME, stays_on_belly=True), LIMP_TIME + GRACE)


def get_onto_belly(runner: Runner) -> None:
    """Roll a robot that has fallen onto its belly, with folded legs.

    Raises:
        Aborted: if it still lies otherwise in the end; it then counts as fallen.
    """
    loop = runner.loop
    runner.run(Damped("recover", LIMP_TIME), LIMP_TIME + 1.0)
    for step in roll_over(loop):
        runner.run(step, STEP_LIMIT)
    if loop.state.tilt > ON_BELLY:
        runner.give_up(f"could not roll onto the belly: {_attitude(loop)}")
    jammed = unfolded_legs(loop.snapshot)
    if jammed:
        runner.give_up(f"could not fold {_names(jammed)} below the trunk")


def _names(legs: list[Leg]) -> str:
    return " and ".join(leg.name for leg in legs)


def _attitude(loop: ControlLoop) -> str:
    roll, pitch, _ = np.degrees(loop.state.rpy)
    return f"roll {roll:.0f} deg, pitch {pitch:.0f} deg"


def roll_over(loop: ControlLoop) -> Iterator[Behaviour]:
    """Behaviours that bring the robot onto its belly, one after the other, looking in between.

    At the end it lies on its belly with folded legs, or it has not succeeded.
    """
    tucked = loop.model.profile.tucked_joints
    yield _fold(tucked)
    has_freed, rolls = False, 0
    for _ in range(TRIES):
        jammed, lies_on_belly = unfolded_legs(loop.snapshot), loop.state.tilt < ON_BELLY
        if lies_on_belly and not jammed:
            return
        if jammed and (lies_on_belly or not has_freed):
            yield _freed(loop.state.joint_positions, jammed, tucked)
            has_freed = True
        else:  # on its back, legs that lie under the trunk come free only by rolling
            has_freed = False
            nearer = 1 if loop.state.rpy[0] >= 0 else -1
            side = -nearer if rolls % 2 else nearer  # the legs of one side may be stuck
            pushing = PUSHING
            if rolls > 1 and ON_SIDE[0] < abs(loop.state.rpy[0]) < ON_SIDE[1]:
                side, pushing = -nearer, PUSHING_BESIDE
            rolls += 1
            reach, push = _one_side(side, REACHED_BACK, tucked), _one_side(side, pushing, tucked)
            yield ServoJoints("reach back", ((0.5, reach), (0.1, reach)), kp=80.0)
            yield ServoJoints("push over", ((0.24, push), (0.4, push)), kp=80.0)
            yield _fold(tucked)


def _fold(tucked: Float[np.ndarray, "12"]) -> ServoJoints:
    return ServoJoints("fold legs", ((0.6, tucked), (0.3, tucked)), kp=60.0)


def _freed(
    measured: Float[np.ndarray, "12"], jammed: list[Leg], tucked: Float[np.ndarray, "12"]
) -> ServoJoints:
    """Turn the hips of ``jammed`` legs outwards, fold them out there, and draw them in."""
    out, folded = measured.copy(), tucked.copy()
    for leg in jammed:
        hip = leg.joints.start
        out[hip] = folded[hip] = leg.side * OUTWARDS
    targets = ((0.3, out), (0.1, out), (0.8, folded), (0.4, tucked), (0.2, tucked))
    return ServoJoints("free legs", targets, kp=60.0)


def _one_side(
    side: int, joints: tuple[float, float, float], tucked: Float[np.ndarray, "12"]
) -> Float[np.ndarray, "12"]:
    target = tucked.copy()
    for leg in LEGS:
        if leg.side == side:
            target[leg.joints] = np.array(joints) * (side, 1.0, 1.0)
    return target
