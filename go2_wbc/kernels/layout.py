"""Rows of floats: where each array of a value lies in the one array that kernels read or fill."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float


class Layout:
    """Named arrays, one after the other in a row of float64.

    Attributes:
        size: length of the row.
        start: index in the row at which each array begins.
    """

    def __init__(self, **shapes: tuple[int, ...]) -> None:
        """Args: shapes: of each array, in the order of the row; () for a single number."""
        lengths = [math.prod(shape) for shape in shapes.values()]
        ends = np.cumsum(lengths).tolist()
        self.start = {n: e - k for n, e, k in zip(shapes, ends, lengths, strict=True)}
        self.size = ends[-1]
        self._places = {
            name: (slice(end - length, end), shape)
            for end, length, (name, shape) in zip(ends, lengths, shapes.items(), strict=True)
        }

    def slice(self, name: str) -> slice:
        """Where one of the arrays lies in a row."""
        return self._places[name][0]

    def view(self, row: Float[np.ndarray, " size"], name: str) -> Float[np.ndarray, "..."]:
        """One of the arrays that ``row`` holds; changing it changes the row."""
        place, shape = self._places[name]
        return row[place] if len(shape) == 1 else row[place].reshape(shape)

    def views(self, row: Float[np.ndarray, " size"]) -> list[Float[np.ndarray, "..."]]:
        """The arrays that ``row`` holds, in order; changing one changes the row."""
        return [row[place].reshape(shape) for place, shape in self._places.values()]

    def pack(self, values: Sequence[Any]) -> Float[np.ndarray, " size"]:
        """A new row that holds ``values``, arrays and numbers, given in order.

        Raises:
            ValueError: for a value of another shape, or one that is not made of numbers.
        """
        row = np.empty(self.size)
        for (name, (place, shape)), value in zip(self._places.items(), values, strict=True):
            if np.shape(value) != shape:
                raise ValueError(f"{name} must have the shape {shape}, got {np.shape(value)}")
            try:
                row[place] = np.ravel(value)
            except (TypeError, ValueError) as error:
                raise ValueError(f"{name} must hold numbers: {error}") from error
        return row

    def place(self, index: int) -> tuple[str, str]:
        """The array in which the number at ``index`` of a row lies, and where in it: [1, 2]."""
        name = max((n for n in self.start if self.start[n] <= index), key=lambda n: self.start[n])
        shape = self._places[name][1]
        inside = [str(i) for i in np.unravel_index(index - self.start[name], shape)]
        return name, f"[{', '.join(inside)}]" if inside else ""


SNAPSHOT = Layout(
    q=(19,),
    v=(18,),
    R_world_base=(3, 3),
    mass_matrix=(18, 18),
    bias=(18,),
    p_world_com=(3,),
    v_world_com=(3,),
    J_com=(3, 18),
    drift_com=(3,),
    p_world_feet=(4, 3),
    v_world_feet=(4, 3),
    J_feet=(4, 3, 18),
    drift_feet=(4, 3),
    J_contacts=(4, 3, 18),
    drift_contacts=(4, 3),
    v_world_contacts=(4, 3),
    payload=(2,),
    com_shift=(3,),
)
"""Of ``robot.snapshot.Snapshot``, the state's q and v first."""

REFERENCE = Layout(
    is_com=(),
    p_world=(3,),
    v_world=(3,),
    a_world=(3,),
    R_world_base=(3, 3),
    w_world=(3,),
    dw_world=(3,),
    legs=(4,),
    normal_force_min=(4,),
    normal_force_max=(4,),
    p_world_feet=(4, 3),
    v_world_feet=(4, 3),
    a_world_feet=(4, 3),
    q_joints=(12,),
    v_joints=(12,),
    a_joints=(12,),
    f_world_feet=(4, 3),
    force_weight=(),
    friction=(),
    orientation_discount=(),
)
"""Of ``reference.Reference`` and its ``BodyTarget``."""

PROGRAM = Layout(
    position_kp=(3,),
    position_kd=(3,),
    position_weight=(),
    orientation_kp=(3,),
    orientation_kd=(3,),
    orientation_weight=(),
    swing_kp=(3,),
    swing_kd=(3,),
    swing_weight=(),
    posture_kp=(3,),
    posture_kd=(3,),
    posture_weight=(),
    flight_weight=(),
    force_weight=(),
    weight_of_robot=(),
    stance_damping=(),
    friction=(),
    keeps_cone=(),
    peak_torque=(12,),
    knee_speed=(12,),
    no_load_speed=(12,),
    q_lower=(12,),
    q_upper=(12,),
    speed=(12,),
    braking=(),
    horizon=(),
    singular_determinant=(),
)
"""Numbers of the built-in tasks and constraints of the whole-body controller."""

DECISION = Layout(z=(30,), tau=(12,), tau_motors=(12,))
"""What the QP decides: z of ``wbc.problem``, and torques without and with friction."""

PLANNER = Layout(
    yaw=(),
    position=(2,),
    velocity=(3,),
    is_stepping=(),
    phase_time=(),
    time=(),
    ground=(),
    height_offset=(),
    period=(),
    duty=(),
    offsets=(4,),
    width=(),
    goal_offsets=(4,),
    liftoff=(4, 3),
    was_stance=(4,),
    is_awaited=(4,),
    friction=(),
    loaded=(4,),
    sliding=(4,),
    is_early=(4,),
    since=(4,),
    slope=(2,),
    p_seen=(2,),
    p_met=(4, 3),
    roughness=(),
    pose=(4,),
    pose_rate=(4,),
    lean_offset=(2,),
    swing_raised=(4,),
    swing_delay=(4,),
    swing_begun=(4,),
)
"""State of the locomotion planner from tick to tick."""

LOCOMOTION = Layout(
    period=(),
    duty=(),
    offsets=(4,),
    width=(),
    rest_period=(),
    rest_duty=(),
    rest_offsets=(4,),
    rest_width=(),
    stride=(5,),
    adaptation=(5,),
    stride_margin=(),
    height=(),
    acceleration=(3,),
    velocity_feedback=(),
    position_leash=(),
    yaw_leash=(),
    foothold_reach=(),
    normal_force_min=(),
    normal_force_max=(),
    load_ramp=(),
    settle_speed=(),
    settled_command=(),
    capture_margin=(),
    square_tolerance=(),
    apex=(),
    touchdown_depth=(),
    full_depth_way=(),
    ground_share=(),
    correction_rate=(),
    correction_window=(),
    correction_limit=(),
    gravity=(),
    foot_radius=(),
    p_base_feet_nominal=(4, 3),
    slip=(9,),
    contact=(2,),
    ground=(7,),
    least_determinant=(),
    most_slope=(),
    mid_swing=(),
    pose_path=(3,),
    levelling=(2, 3),
)
"""Numbers of the locomotion planner: gait, configuration, robot."""

COMMAND = Layout(velocity=(3,), pose=(4,))
"""What the locomotion planner is asked for: ahead, left, turning; height, roll, pitch, yaw."""

MPC_NODES = 12
"""Nodes of the MPC's horizon."""

MPC = Layout(
    step=(),
    mass=(),
    gravity=(),
    pose_weights=(6,),
    rate_weights=(6,),
    force_weight=(),
    friction=(),
    force_max=(),
    least_share=(),
    interval=(),
    prior=(),
    throw_time=(),
    throw_speed=(),
)
"""Numbers of the MPC: the turn's axes before those of the way."""

FORCES = Layout(next=(), forces=(4, 3))
"""What the MPC has planned: when it plans again, and the force of each foot while it stands."""

PLAN_CURVES = 30
"""Curves of a plan: CoM, roll pitch yaw, twelve joints, and the places of the four feet."""

CORRECTION = Layout(rate=(), window=(6,), limit=(6,), handed_over=(3,))
"""Numbers of the steady-state correction."""

PLAYBACK = Layout(
    offset=(6,),
    place=(),
    attitude=(),
    joints=(),
    ticks=(),
    raised_ticks=(),
    sag=(),
    lean=(),
    anchor=(4,),
    origin=(4,),
    planned=(4,),
    is_in_air=(4,),
    is_awaited=(4,),
    touchdown=(4,),
    missed=(),
    landing_error=(),
    carried=(3,),
)
"""State of a playback: the correction, how far the robot has been off its plan, and is now; where
the plan is (x, y, z, yaw), now and at first; and of each foot that steps what the plan asks of it,
whether it is in the air, whether its landing is still to be judged, and when it came down; last
what the correction would have to do against the payload that is known."""

LANDING = Layout(
    earliest=(),
    press_speed=(),
    press_depth=(),
    time_out=(),
    ground_share=(),
    foot_radius=(),
    near=(),
    ramp=(),
    normal_force_min=(),
    normal_force_max=(),
)
"""Numbers by which the feet of a plan land: of ``planning.landing`` and of the plan."""

FRICTION = Layout(
    dry=(12,),
    viscous=(12,),
    transition=(),
    lookahead=(),
    peak_torque=(12,),
    knee_speed=(12,),
    no_load_speed=(12,),
)
"""Of ``robot.joint_friction.JointFriction``, and of the ``MotorModel`` that no torque exceeds."""

LEAST_LOAD, MOST_LOAD = 0.05, 2.0
"""Bounds of a foot's load, over the mean of the standing feet, by which it is spared (see
``wbc.loads``): own choice."""
LEAST_PRESSURE = 0.2
"""Share of the weight by which moments are divided at least: the zero-moment point stays near."""
SPREAD = 1e-6
"""[m^2] by which two feet, between which there is no area, count as spread to all sides."""
