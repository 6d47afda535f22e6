"""Standing: the feet stay where they are while that keeps the balance, and step otherwise.

The capture point (Pratt et al., Capture Point, Humanoids 2006), ``p + v / sqrt(g / h)``, is where
an inverted pendulum of height ``h`` would have to put its foot to come to rest above it. While it
is within the support polygon the feet need not move; outside, the robot falls unless they do.

The steps are those of the walking planner. A push of 36 N s makes the robot as fast as it can walk,
2.3 m/s, within a tenth of a second. So it walks on at a little less than its speed, with strides
for that speed, until it is slow; braking at once would leave its feet behind. The first stride has
a flight phase, like those of a fast trot. In the others the feet stand longer than in a forward
trot, since every flight costs height, and a robot that moves sideways at that speed has none to
lose. Once at rest the robot stands where it is.

A foot that something lifts counts as a swing foot: it swings towards its foothold, and the QP
includes the reaction of the leg's effort on the trunk, whether the foot moves or is held. So the
foot is pressed back with the force that lifts it, and stands again once it is released.

A push does not wait until the ground has shown its friction: unless a walk has found the ground
slippery, the steps use the largest friction that any walk uses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import hypot

import numpy as np
from jaxtyping import Float

from controller.behaviours.plans import ChangePosture
from controller.behaviours.walking import Walking
from go2_wbc.contacts import GAITS, Gait, Stride
from go2_wbc.geometry import support_margin
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand
from go2_wbc.planning.locomotion import LEAST_HEIGHT, LocomotionConfig
from go2_wbc.planning.slip import MOST_FRICTION
from go2_wbc.records import Array4x3
from go2_wbc.reference import SWING, Reference, Target
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from go2_wbc.robot.state import Snapshot

LEAST_MARGIN = 0.03
"""Distance [m] of the capture point inside the edge of the support polygon below which the robot
steps: of 32 pushes of 36 to 45 N s 4 made it fall, at the edge itself 10, beyond it 11."""
WELL_INSIDE = 0.06
"""Distance [m] of the capture point from the feet's middle within which it is not looked closer."""
AT_ONCE = 1e-6  #: Capture margin [m] of the planner: once it is asked to step it does
MIRRORED_OFFSETS = (0.0, 0.5, 0.5, 0.0)  #: Of a trot that begins with FL and RR on the ground
FIRST_PERIOD, FIRST_DUTY = 0.30, 0.40
"""Period [s] and duty of the first stride. Of 24 pushes of 36 to 45 N s 23 were held, and 16 with
the stride of a slow trot (0.36 s, 0.5): feet that stand for 0.18 s are left 0.4 m behind."""
STEPS = replace(
    GAITS["trot"], name="balance", stride=Stride(0.20, 0.12, 0.16, 0.18, 0.02), apex=0.07
)
"""How it steps. With the trot's stances of 0.08 s and swings of 9 cm a robot that was thrown aside
sank by 4 cm in the flight of each stride, faster and faster: of 32 pushes of 36 to 42 N s aside 20
made it fall, 5 with the lower swings alone, 1 with the longer stances alone, with both none."""
KEPT_SPEED = 0.8
"""Share of its speed at which the robot is to go on: of 32 pushes all were held, with 0.7 28, and
with 0.6 26."""
SLOW = 0.3  #: Speed [m/s] from which on it is to stop
AT_ANY_RATE = 30.0
"""Greatest change of that command [m/s^2]: more than that of a velocity under a push."""
SHORT_LEASH = 0.02
"""Distance [m] that the place it is to be at may be behind the robot. With the 0.08 of a walk it
came back to that place at 0.4 m/s, which it then was to go on at: after 72 pushes of 45 N s
straight back it stood again in 1.7 s in the mean, twice too late, now in 1.5 s, at most 2.25."""
THROWN = 0.15
"""Speed [m/s] beyond that at which it is to go on, from which on it counts as thrown: its legs may
cross, and its gait does not hurry as knees get straight. With the 0.4 of a walk a robot counted as
going as told while it still went at 2 m/s, and its feet came down too late, beside their places: on
its own sensors 64 of 80 pushes of 36 N s aside were held, now 40 of 40, 29 of 30 of 43 N s, and 30
of 30 of 50 N s."""
SHARE_OF_NODE = 0.8
"""Part of a node of the MPC below which a foot counts as in the air. With the 0.02 of a walk a foot
that is left far behind was to give, in the last milliseconds of its stance, what the whole node
asked of it: 250 N that it did not give, and the legs in the air were swung for the trunk that these
would have turned. Of 120 pushes by 14 % more than 36 N s aside and 45 back 20 were not held or held
too late, now 1."""

SETTLING = 0.5
"""Time constant [s] by which the posture of a robot with a load follows the feet's heights: where a
trot ends two bear all and are pressed in, and an estimated height drifts. With 6 kg it stood up to
12 mm too low."""
LIFTED, STIFFNESS, DAMPING = 0.02, 1200.0, 1.0
"""Height [m] by which a foot rises over the others if something lifts it, and by what it then
returns to its place besides what swinging feet do [1/s^2], and share of its speed."""


class Standing(ChangePosture):
    """Go to the standing posture, hold it, and step for balance where that cannot be held."""

    def __init__(
        self,
        make_plan: Callable[[Float[np.ndarray, "6"]], MotionPlan],
        model: RobotModel,
        config: LocomotionConfig,
        friction: float | None = None,
    ) -> None:
        """Stand.

        Args:
            make_plan: as for ``ChangePosture``.
            model: of the robot that steps.
            config: how it steps.
            friction: of the ground, as feet have shown it that slid; None if none has.
        """
        super().__init__(make_plan)
        mpc = replace(config.mpc, least_share=SHARE_OF_NODE)
        self._model = model
        self._config = replace(
            config,
            capture_margin=AT_ONCE,
            linear_acceleration=AT_ANY_RATE,
            position_leash=SHORT_LEASH,
            stride_margin=THROWN,
            mpc=mpc,
        )
        self._friction_of_steps = MOST_FRICTION if friction is None else friction
        self._steps: Walking | None = None
        self._places: Array4x3 | None = None

    @property
    def is_stepping(self) -> bool:
        """Whether it steps for balance now."""
        return self._steps is not None

    @property
    def sag_and_lean(self) -> tuple[float, float] | None:
        """From the plan; while it steps, from what is tracked."""
        return None if self.is_stepping else super().sag_and_lean

    def update(self, snapshot: Snapshot) -> Reference:
        """The posture's reference, or that of the steps."""
        if self._steps is not None and self._steps.is_finished(snapshot):
            self._steps = self._places = None
            self.start(snapshot)
        if self._steps is None and not self.may_lie:
            offset = self._capture_offset(snapshot)
            if must_step(snapshot, offset):
                gait, friction = trot_against(snapshot, offset), self._friction_of_steps
                self._steps = Walking(self._model, gait, self._config, friction)
                self._steps.start(snapshot)
        if self._steps is not None:
            return _walk_on(self._steps, snapshot)
        lifted = self._lifted(snapshot)
        if snapshot.payload[0] > 0.0 and not (self.may_lie or lifted is not None):
            self._tracker.follow_ground(snapshot, (snapshot.state.time - self._last) / SETTLING)
        reference = super().update(snapshot)
        if lifted is not None:
            self._press_back(snapshot, lifted, Target.of(reference.row))
        return reference

    def is_finished(self, snapshot: Snapshot) -> bool:
        """Whether the posture is reached, with no step left to do."""
        return not self.is_stepping and super().is_finished(snapshot)

    def _lifted(self, snapshot: Snapshot) -> int | None:
        """The leg whose foot something lifts: it has risen over the others since all stood."""
        feet = snapshot.p_world_feet
        if self._places is None or self.may_lie:
            self._places = None if self.may_lie else feet.copy()
            return None
        rise: list[float] = (feet[:, 2] - self._places[:, 2]).tolist()
        _, low, high, highest = sorted(rise)
        return rise.index(highest) if highest - 0.5 * (low + high) > LIFTED else None

    def _press_back(self, snapshot: Snapshot, lifted: int, target: Target) -> None:
        """Let the lifted foot press towards its place, as a leg in the air.

        What lifts it bears what it presses with; the trunk is held with that reaction.
        """
        target.legs[lifted] = SWING
        target.p_world_feet[:] = self._places
        target.v_world_feet[:] = -DAMPING * snapshot.v_world_feet
        target.a_world_feet[:] = STIFFNESS * (self._places - snapshot.p_world_feet)

    def _capture_offset(self, snapshot: Snapshot) -> tuple[float, float]:
        """Place [m] of the capture point in the world, from the feet's middle."""
        time = (self._config.height / self._model.gravity) ** 0.5
        feet = snapshot.p_world_feet[:, :2]
        capture = snapshot.p_world_com[:2] + time * snapshot.v_world_com[:2]
        x, y = (capture - feet.sum(axis=0) / len(feet)).tolist()
        return x, y


def _walk_on(steps: Walking, snapshot: Snapshot) -> Reference:
    """The reference of the steps, after whose first tick they may become slower."""
    steps.command = going_on(snapshot)
    reference = steps.planned(snapshot)
    if steps.gait.starts_at_once:
        steps.change_gait(replace(STEPS, offsets=steps.gait.offsets))
    return reference


def going_on(snapshot: Snapshot) -> VelocityCommand:
    """The command to walk on at a little less than the robot's velocity, or to stop."""
    x, y = (yaw_rotation(snapshot.state.yaw).T @ snapshot.v_world_com)[:2].tolist()
    if hypot(x, y) < SLOW:
        return ZERO_COMMAND
    return VelocityCommand(KEPT_SPEED * x, KEPT_SPEED * y)


def must_step(snapshot: Snapshot, offset: tuple[float, float]) -> bool:
    """Whether a robot that is up cannot come to rest above its feet.

    Args:
        offset: place [m] of the capture point in the world, from the feet's middle.
    """
    if hypot(*offset) < WELL_INSIDE:
        return False
    feet = snapshot.p_world_feet
    if snapshot.p_world_com[2] - feet[:, 2].min() < LEAST_HEIGHT:
        return False
    return support_margin(feet[:, :2] - feet[:, :2].mean(axis=0), np.array(offset)) < LEAST_MARGIN


def trot_against(snapshot: Snapshot, offset: tuple[float, float]) -> Gait:
    """The first stride, which begins on the two feet whose line lies along the way the robot falls.

    They can press against it from the first step on. Begun on the other two, the robot fell after
    three pushes out of four along their diagonal.
    """
    feet = snapshot.p_world_feet[:, :2]
    mirrored, usual = (
        abs(float(way @ offset)) / float(np.linalg.norm(way))
        for way in (feet[Leg.FL] - feet[Leg.RR], feet[Leg.FR] - feet[Leg.RL])
    )
    offsets = STEPS.offsets if usual >= mirrored else MIRRORED_OFFSETS
    return replace(
        STEPS, period=FIRST_PERIOD, duty=FIRST_DUTY, offsets=offsets, starts_at_once=True
    )
