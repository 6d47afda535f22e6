"""Velocity command -> Reference: one tick of a gait, and the planner that makes them.

Every quantity is in the world frame unless its name says otherwise; commands are in the heading
frame (z up, x along the reference's yaw).

- Trunk (``trunk``): the command is integrated to a pose. It is the CoM's, with the snapshot's
  payload, and the footholds (``footholds``) are moved as that moves the CoM.
- Ground: its height is learnt from the feet that should stand, each where its contact is first
  measured. A foot that comes down late has no contact yet when it should; taken for landed, it
  would raise the ground, and with it the trunk, step by step.
- Stepping without a command: until the robot can rest, and where it is pushed (``rest``).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.arguments import typed
from go2_wbc.compilation import Foreign, kernel, subroutine
from go2_wbc.contacts import TIE, Gait
from go2_wbc.errors import CommandError
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.footholds import foothold, goes_as_told, is_thrown, nominal_feet
from go2_wbc.planning.force_mpc import apply_force_plan
from go2_wbc.planning.gait_clock import adapt, foot_phase, pace, restart
from go2_wbc.planning.ground import (
    LATE,
    carry_ground,
    expect_steps,
    greatest_speed,
    ground_at,
    ground_below,
    haste,
    is_rough,
    landing_height,
    late_share,
    learn_ground,
    level_friction,
    note_stumble,
    on_leash,
    slow_down,
)
from go2_wbc.planning.height_map import HeightMap
from go2_wbc.planning.rest import (
    come_to_rest,
    is_square,
    may_rest,
    must_step,
    rest_in_place,
    start_stepping,
    why_not_resting,
)
from go2_wbc.planning.sight import look, steps_by_sight
from go2_wbc.planning.sighted_steps import height_to_land, swing_by_sight
from go2_wbc.planning.slip import LEAST_FRICTION, MOST_FRICTION, Slip, observe_slip
from go2_wbc.planning.swing import (
    FootContact,
    Swing,
    begin_swing,
    follow_contact,
    is_held_up,
    lead_beyond,
    loaded_time,
    own_progress,
    resume_swing,
    swing_foot,
)
from go2_wbc.planning.trunk import (
    LEVEL,
    BodyPose,
    Command,
    Trunk,
    accelerate,
    advance_pose,
    correct_height,
    fill_body,
    follow_heading,
    follow_position,
    give_way,
    is_settled,
    is_zero,
    level,
    world_velocity,
)
from go2_wbc.planning.walk import (
    GREATEST_HEIGHT,
    LEAST_HEIGHT,
    Foot,
    LocomotionConfig,
    PlannedForces,
    Planner,
    Rest,
    Walk,
    carried_height,
)
from go2_wbc.records import packed
from go2_wbc.reference import STANCE, SWING, Reference, Target
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot

__all__ = ["GREATEST_HEIGHT", "LEAST_HEIGHT", "LocomotionConfig", "LocomotionPlanner"]

LONGEST_DELAY = 1.0  # of commands [s]
DELAY_STAYS = 60.0
"""Time [s] in which it is forgotten that commands were late, to 1/e. Where they act 0 to 18 ms late
(drawn anew each 20 ms), 2 to 16 ms are found: with 10 s the robot took them for prompt in between,
went back at 1.8 m/s, and one of 20 fell."""
NEARLY_STRAIGHT, STRAIGHT = 0.21, 0.04
"""Angles [rad] of a standing leg's knee from its limit between which the gait hurries."""
HURRY = 1.5  #: How much faster it goes on at most, as a share
MID_SWING = 0.2
"""Share of a swing before and after its middle in which a foot that has contact stumbles."""


@subroutine
def hurry(now: Snapshot, s: Planner, c: Walk) -> float:
    """How much faster the gait goes on, as a share, as the knee of a standing leg gets straight.

    Beyond its limit the foot bears nothing and the trunk drops onto the other one. The feet of a
    robot that is thrown need their time to come down far from below it: 31 of 90 that were pushed
    aside with 26 to 30 N s fell as they hurried, 5 as they did not.
    """
    most = 0.0
    if not goes_as_told(now, s, c):
        return 0.0
    for leg in range(4):
        if s.feet[leg].contact.was_stance:
            bent = c.knees[leg] - now.q[9 + 3 * leg]
            most = max(most, (NEARLY_STRAIGHT - bent) / (NEARLY_STRAIGHT - STRAIGHT))
    return HURRY * min(most, 1.0)


@subroutine
def is_waiting(s: Planner) -> bool:
    """Whether the gait waits for a foot."""
    waits = False
    for leg in range(4):
        waits = waits or is_held_up(s.feet[leg].swing, s.feet[leg].contact, s.clock, leg)
    return waits


@subroutine
def advance_phase(now: Snapshot, s: Planner, c: Walk, command: Command, dt: float) -> None:
    """Start, go on, or come to rest."""
    if s.is_stepping:
        s.clock.is_waiting = is_waiting(s)
        s.clock.time += dt * pace(s.clock) * (1.0 + hurry(now, s, c))
        if not is_zero(command):
            s.rest.landings = 0.0
        elif may_rest(now, s, c):
            come_to_rest(now, s, c)
    elif not is_zero(command) or must_step(now, c):
        start_stepping(s, c)


@subroutine
def adapt_gait(now: Snapshot, s: Planner, c: Walk, command: Command, dt: float) -> None:
    """Bring the gait's form towards that wanted; the phases of the feet do not jump."""
    arm = np.hypot(c.p_base_feet_nominal[0, 0], c.p_base_feet_nominal[0, 1])
    speed = np.hypot(s.trunk.velocity[0], s.trunk.velocity[1])
    thrown = np.hypot(now.v_world_com[0], now.v_world_com[1]) - c.config.stride_margin
    is_thrown = thrown > speed
    speed = max(thrown, speed) + arm * abs(s.trunk.velocity[2])
    is_resting = is_zero(command) and is_settled(s.trunk)
    s.clock.is_rough, s.clock.is_seen = is_rough(s.ground), steps_by_sight(s.sight)
    adapt(s.clock, c.cadence, dt, speed, is_resting, is_thrown)


@subroutine
def integrate(now: Snapshot, s: Planner, c: Walk, command: Command, dt: float) -> None:
    """Ramp velocity and pose, integrate to the place, apply the leash, correct the height."""
    trunk, config = s.trunk, c.config
    advance_pose(trunk.pose, trunk.pose_rate, config.pose, command.pose, dt)
    if s.clock.is_waiting:
        give_way(trunk, now)
    share = haste(s.ground, config.rough, s.slip.friction, s.delay, trunk.velocity)
    linear = share * config.linear_acceleration
    accelerate(trunk, command, linear, config.angular_acceleration, dt)
    follow_heading(trunk, now, config.yaw_leash, dt)
    if s.is_stepping:
        follow_position(trunk, now, config.position_leash, dt)
    else:
        rest_in_place(now, s, config.position_leash, dt)
    carry_ground(s.ground, now, dt)
    expect_steps(s.ground, now, world_velocity(trunk), dt)
    correct_height(trunk, now, s.ground.height + carried_height(s, c), dt)


@subroutine
def note_liftoffs(
    now: Snapshot,
    s: Planner,
    c: Walk,
    contact: Foreign[Bool[np.ndarray, "4"]],
    stance: Bool[np.ndarray, "4"],
    progress: Float[np.ndarray, "4"],
) -> None:
    """Remember where feet leave the ground; learn of it where they meet it, or stumble."""
    met, stumbles = np.zeros(4, dtype=np.bool_), np.zeros(4, dtype=np.bool_)
    for leg in range(4):
        foot = s.feet[leg].contact
        if foot.was_stance and not stance[leg]:
            place, ahead = now.p_world_feet[leg], world_velocity(s.trunk)
            begin_swing(s.feet[leg].swing, place, s.ground, c.config.rough, ahead)
            s.feet[leg].step.is_sighted = False
        if not stance[leg]:
            foot.is_awaited = False
            is_middle = abs(progress[leg] - 0.5) <= MID_SWING + TIE
            stumbles[leg] = is_middle and contact[leg]
        elif not foot.was_stance:
            foot.is_awaited = True
        if foot.is_awaited and contact[leg]:
            met[leg], foot.is_awaited = True, False
        foot.was_stance = stance[leg]
    if s.sight.sees:
        for leg in range(4):
            if met[leg]:
                s.ground.p_met[leg] = now.p_world_feet[leg]
        return
    tells = is_rough(s.ground) or not is_thrown(now, s, c)
    learn_ground(s.ground, now, c.foot_radius, met, s.delay, tells)
    if stumbles.any() and tells:
        note_stumble(s.ground)
    speed = np.hypot(s.trunk.velocity[0], s.trunk.velocity[1])
    is_fast = s.clock.is_waiting or speed > c.config.rough.speed + TIE
    for leg in range(4):
        if stumbles[leg]:
            resume_swing(s.feet[leg].swing, leg, now, s.ground, progress[leg], is_fast)


@subroutine
def fill_feet(
    now: Snapshot,
    s: Planner,
    c: Walk,
    stance: Bool[np.ndarray, "4"],
    stands: Bool[np.ndarray, "4"],
    elapsed: Float[np.ndarray, "4"],
    remaining: Float[np.ndarray, "4"],
    target: Target,
    m: HeightMap,
    dt: float,
) -> None:
    """What each leg does, its load, and the way of a foot in the air."""
    nominal, goal, config = np.empty((4, 2)), np.empty(3), c.config
    nominal_feet(now, s, c, s.clock.width, nominal)
    for leg in range(4):
        foot = s.feet[leg]
        target.legs[leg] = STANCE if stands[leg] else SWING
        target.p_world_feet[leg] = now.p_world_feet[leg]
        share = 0.0
        if stands[leg]:
            loaded = loaded_time(foot.contact, stance[leg], elapsed[leg], remaining[leg])
            share = min(loaded / max(config.mpc.load_ramp, TIE), 1.0)
        else:
            foothold(leg, now, s, c, nominal, remaining[leg], goal)
            lead_beyond(foot.swing, world_velocity(s.trunk), s.ground, goal)
            progress = elapsed[leg] / (elapsed[leg] + remaining[leg])
            p, v, a = target.p_world_feet[leg], target.v_world_feet[leg], target.a_world_feet[leg]
            if foot.step.is_sighted or (steps_by_sight(s.sight) and elapsed[leg] < dt):
                spans = elapsed[leg], remaining[leg]
                swing_by_sight(leg, now, s, c, m, spans, goal, dt, p, v, a)
            else:
                land = landing_height(s.ground, goal[2])
                swing_foot(foot.swing, s.clock, config.swing, progress, goal, land, p, v, a)
        target.normal_force_min[leg] = config.normal_force_min * share
        target.normal_force_max[leg] = config.normal_force_max * share


@kernel
def plan(
    now: Snapshot,
    time: float,
    contact: Foreign[Bool[np.ndarray, "4"]],
    tau: Foreign[Float[np.ndarray, "12"]],
    s: Planner,
    c: Walk,
    command: Command,
    target: Target,
    m: HeightMap,
) -> None:
    """Bring the state to ``time`` and fill the reference of this tick.

    ``contact`` are the feet in measured contact, ``tau`` [N m] the measured torques, ``m`` what is
    known of the ground.
    """
    dt = time - s.time
    s.time = time
    if m.is_used:
        look(s.sight, s.ground, m, now, s.trunk.yaw, command.velocity, dt)
    slow_down(s.ground, c.config.rough, s.delay, command.velocity)
    advance_phase(now, s, c, command, dt)
    integrate(now, s, c, command, dt)
    if s.sight.sees:
        s.ground.rough_way = s.ground.high_way = s.ground.ramp_way = 0.0
    if s.is_stepping:
        adapt_gait(now, s, c, command, dt)
    stance, stands = np.ones(4, dtype=np.bool_), np.ones(4, dtype=np.bool_)
    elapsed, remaining, progress = np.full(4, np.inf), np.full(4, np.inf), np.zeros(4)
    for leg in range(4):
        if s.is_stepping:
            stance[leg], elapsed[leg], remaining[leg] = foot_phase(s.clock, leg)
        if not stance[leg]:
            progress[leg] = elapsed[leg] / (elapsed[leg] + remaining[leg])
        foot, p = s.feet[leg].contact, now.p_world_feet[leg]
        above = p[2] - c.foot_radius - ground_at(s.ground, p[0], p[1])
        if s.feet[leg].step.is_sighted:
            above = height_to_land(m, p[0], p[1], p[2] - c.foot_radius)
        swing = s.feet[leg].swing
        own = own_progress(swing, progress[leg]) if swing.is_awaited else progress[leg]
        stands[leg] = follow_contact(foot, above, contact[leg], stance[leg], own, dt)
    observe_slip(s.slip, now, contact, tau, stands, s.is_stepping, c.stands_beside_com, dt)
    note_liftoffs(now, s, c, contact, stance, progress)
    target.friction = level_friction(s.ground, s.slip.friction, LEAST_FRICTION)
    fill_body(s.trunk, s.ground, carried_height(s, c), target)
    target.p_world[2] = on_leash(s.ground, target.p_world[2], now)
    level(s.trunk, now, contact, s.is_stepping, dt, target)
    fill_feet(now, s, c, stance, stands, elapsed, remaining, target, m, dt)
    target.q_joints[:] = now.q[7:]
    if s.is_stepping:
        apply_force_plan(now, s, c, command, target)


class LocomotionPlanner:
    """Turns a velocity command into references, one tick after the other.

    Attributes:
        sight: what has been seen of the way.
        ground: what the feet have told of it.
    """

    @typed()
    def __init__(
        self,
        model: RobotModel,
        gait: Gait,
        config: LocomotionConfig,
        heights: HeightMap | None = None,
    ) -> None:
        """Prepare a planner; ``start`` sets it on its way.

        ``heights``: of the ground, as they are known at each tick; None for a robot that is blind.
        """
        self._model, self._config = model, config
        self._heights = HeightMap() if heights is None else heights
        self._state, self._command = Planner(), Command()
        self.sight, self.ground = self._state.sight, self._state.ground
        self.change_gait(gait)

    def __repr__(self) -> str:
        """With which gait."""
        return f"<LocomotionPlanner: {self._gait!r}>"

    @typed()
    def start(
        self, snapshot: Snapshot, friction: float | None = None, has_slid: bool = True
    ) -> None:
        """Begin from the measured state, standing.

        Args:
            snapshot: of this tick.
            friction: of the ground, as it is known; None if nothing is.
            has_slid: whether a foot has shown that, and not only that it is at least as high.

        Raises:
            CommandError: for a friction of 0 or less.
        """
        known = self._config.ground_friction if friction is None else friction
        if known <= 0.0:
            raise CommandError(f"friction must be above 0, got {friction}")
        feet = [
            Foot(
                contact=FootContact(since=np.inf, was_stance=True),
                swing=Swing(start=p_foot),
            )
            for p_foot in snapshot.p_world_feet
        ]
        self._state = Planner(
            time=snapshot.state.time,
            trunk=Trunk(yaw=snapshot.state.yaw, position=snapshot.p_world_com[:2]),
            rest=Rest(place=snapshot.p_world_com[:2], middle=snapshot.p_world_feet.mean(axis=0)),
            ground=ground_below(snapshot, self._model.foot_radius),
            slip=Slip(
                friction=min(known, MOST_FRICTION), has_slid=friction is not None and has_slid
            ),
            feet=feet,
            planned=PlannedForces(next=-np.inf),
        )
        self.sight, self.ground = self._state.sight, self._state.ground
        restart(self._state.clock, self._walk.cadence)

    @typed()
    def change_gait(self, gait: Gait) -> None:
        """Walk on with ``gait``; while it walks the strides pass over into it one after the other.

        The command, and the velocity that is left of one before, must be within its envelope.
        """
        self._gait, self._walk = gait, packed(Walk.of(self._model, gait, self._config))
        self._state.planned.next = -np.inf

    @property
    def velocity(self) -> Float[np.ndarray, "3"]:
        """Ramped command in the heading frame [m/s, m/s, rad/s]; 0 before ``start``."""
        return self._state.trunk.velocity.copy()

    @property
    def is_slowed(self) -> bool:
        """Whether rough ground or late commands keep the robot slower than it is told."""
        x, y = self._state.trunk.velocity[:2].tolist()
        if self.is_late and late_share(x, y) > 1.0 - TIE:
            return True
        most = greatest_speed(self._state.ground, self._walk.config.rough)
        return bool(np.hypot(x, y) > most - TIE)

    @property
    def is_late(self) -> bool:
        """Whether commands act so late that the robot walks slower."""
        return bool(self._state.delay >= LATE)

    @property
    def is_stepping(self) -> bool:
        """Whether the gait is running; not before ``start``."""
        return self._state.is_stepping

    @property
    def phase(self) -> float:
        """Share of the front left foot's stride that has passed since it touched down."""
        clock = self._state.clock
        return float((clock.time / clock.period - clock.offsets[0]) % 1.0)

    def follow_feet(self, landed: Bool[np.ndarray, "4"], share: float) -> None:
        """Somebody else moves the feet: keep in step, and learn nothing of rough ground by them.

        Args:
            landed: which have just come down.
            share: of the way to where the stride would be by them, that its clock goes.
        """
        clock, ground = self._state.clock, self._state.ground
        for leg in np.flatnonzero(landed).tolist():
            ahead = (clock.time / clock.period - clock.offsets[leg] + 0.5) % 1.0 - 0.5
            clock.time = float(clock.time - share * ahead * clock.period) % clock.period
        ground.rough_way = ground.high_way = ground.ramp_way = 0.0

    @property
    def heading(self) -> float:
        """Yaw [rad] of the reference; 0 before ``start``."""
        return float(self._state.trunk.yaw)

    @property
    def friction(self) -> float:
        """Of the ground, as far as it has been shown; 0 before ``start``."""
        return float(self._state.slip.friction)

    @property
    def has_slid(self) -> bool:
        """Whether a foot has, and has shown that friction."""
        return bool(self._state.slip.has_slid)

    @typed(late=True)
    def square_up(self, snapshot: Snapshot) -> bool:
        """Start stepping unless every foot is below its hip; returns whether they all are."""
        if not (is_done := bool(is_square(snapshot, self._state, self._walk))):
            start_stepping(self._state, self._walk)
        return is_done

    def why_not_resting(self, snapshot: Snapshot) -> str:
        """Why a robot without a command has not come to rest, in plain words; "" if it has."""
        return why_not_resting(snapshot, self._state, self._walk)

    @typed(late=True)
    def update(
        self,
        snapshot: Snapshot,
        command: VelocityCommand,
        pose: BodyPose = LEVEL,
        delay: float = 0.0,
    ) -> Reference:
        """The reference of this tick.

        Args:
            snapshot: of this tick.
            command: wanted velocity, already inside the envelope.
            pose: wanted pose of the trunk, already inside its envelope.
            delay: after which commands act [s]; they count as that late for some time.

        Raises:
            CommandError: for a delay that cannot be.
        """
        if not 0.0 <= delay <= LONGEST_DELAY:
            raise CommandError(f"delay must be 0 to {LONGEST_DELAY:g} s, got {delay}")
        asked, state, target = self._command, snapshot.state, Target()
        left = 1.0 - min((state.time - self._state.time) / DELAY_STAYS, 1.0)
        self._state.delay = max(delay, left * self._state.delay)
        velocity = command.linear_x, command.linear_y, command.angular_z
        asked.row[:] = *velocity, pose.height, pose.roll, pose.pitch, pose.yaw
        contact, tau = state.feet_in_contact, state.tau
        own = self._state, self._walk, asked, target, self._heights
        plan(snapshot, state.time, contact, tau, *own)
        return Reference.of_row(target.row)
