"""The locomotion planner by its compiled kernel: what the robot walks with."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np
from jaxtyping import Float

from go2_wbc.contacts import DUTY_FALL, DUTY_RATE, OFFSET_RATE, PERIOD_RATE, WIDTH_RATE, Gait
from go2_wbc.kernels.layout import COMMAND, FORCES, LOCOMOTION, MPC, PLANNER, REFERENCE
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.correction import CorrectionConfig
from go2_wbc.planning.gait_clock import resting_gait
from go2_wbc.planning.gait_planner import GaitPlanner
from go2_wbc.planning.ground import (
    GROUND_SHARE,
    LEAST_DETERMINANT,
    MOST_SLOPE,
    GroundPlane,
)
from go2_wbc.planning.locomotion import MID_SWING, LocomotionConfig
from go2_wbc.planning.pose import LEVEL, BodyPose
from go2_wbc.planning.trunk import READY, SETTLED_COMMAND, STRIDE
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.snapshot import Snapshot

_TARGET_FRICTION, _FRICTION = REFERENCE.start["friction"], MPC.start["friction"]
_STATE = PLANNER.start
_GOAL = PLANNER.slice("goal_offsets")
_FORM = slice(PLANNER.start["period"], PLANNER.start["width"] + 1)
_RESTING = slice(LOCOMOTION.start["rest_period"], LOCOMOTION.start["rest_width"] + 1)
"""Period, duty and offsets: those of the gait now, and those in which the robot comes to rest."""


class CompiledPlanner(GaitPlanner):
    """``LocomotionPlanner``, fifteen times faster: the same references, tick by tick."""

    def __init__(self, model: RobotModel, gait: Gait, config: LocomotionConfig) -> None:
        """Prepare a planner; ``start`` sets it on its way."""
        from go2_wbc.kernels.locomotion import is_square, plan
        from go2_wbc.kernels.preview import steer

        self._plan, self._is_square, self._steer = plan, is_square, steer
        self._model, self._config = model, config
        self._mpc = config.mpc.numbers(model.mass, model.gravity)
        self._foot_radius, self._most_friction = model.foot_radius, config.slip.most
        self._mpc_friction, self._ground = config.mpc.friction, config.ground
        self.change_gait(gait)
        self._state = np.zeros(PLANNER.size)
        self._command = np.zeros(COMMAND.size)
        self._contact = np.zeros(4)

    def start(self, snapshot: Snapshot) -> None:
        """Begin from the measured state, standing."""
        feet, self._forces = snapshot.p_world_feet, _nothing_planned()
        ground = GroundPlane(snapshot, self._foot_radius, self._ground)
        self._state = PLANNER.pack(
            [
                snapshot.state.yaw,
                snapshot.p_world_com[:2],
                np.zeros(3),
                0.0,
                0.0,
                snapshot.state.time,
                ground.height,
                0.0,
                *LOCOMOTION.views(self._numbers)[4:8],
                LOCOMOTION.view(self._numbers, "rest_offsets"),
                feet,
                np.ones(4),
                np.zeros(4),
                self._most_friction,
                np.zeros(4),
                np.zeros(4),
                np.zeros(4),
                np.full(4, np.inf),
                ground.slope,
                snapshot.p_world_com[:2],
                feet,
                0.0,
                np.zeros(4),
                np.zeros(4),
                np.zeros(2),
                np.zeros(4),
                np.zeros(4),
                np.zeros(4),
            ]
        )

    def change_gait(self, gait: Gait) -> None:
        """Walk on with ``gait``; see ``GaitPlanner``."""
        self._forces = _nothing_planned()
        self._numbers = _numbers(self._model, gait, self._config)

    @property
    def velocity(self) -> Float[np.ndarray, "3"]:
        """Ramped command; see ``GaitPlanner``."""
        return PLANNER.view(self._state, "velocity").copy()

    @property
    def is_stepping(self) -> bool:
        """Whether the gait is running; not before ``start``."""
        return bool(self._state[_STATE["is_stepping"]])

    @property
    def heading(self) -> float:
        """Yaw [rad] of the reference; 0 before ``start``."""
        return float(self._state[_STATE["yaw"]])

    def square_up(self, snapshot: Snapshot) -> bool:
        """Start stepping unless every foot is below its hip; returns whether they all are."""
        stands = bool(self._is_square(snapshot.row, self._state, self._numbers))
        self._state[_STATE["is_stepping"]] = not stands
        self._state[_STATE["phase_time"]] = 0.0
        self._state[_FORM] = self._numbers[_RESTING]
        self._state[_GOAL] = LOCOMOTION.view(self._numbers, "rest_offsets")
        return stands

    def update(
        self, snapshot: Snapshot, command: VelocityCommand, pose: BodyPose = LEVEL
    ) -> Reference:
        """The reference of this tick; see ``GaitPlanner``."""
        wanted, row = self._command, np.empty(REFERENCE.size)
        wanted[0], wanted[1], wanted[2] = command.linear_x, command.linear_y, command.angular_z
        wanted[3], wanted[4], wanted[5], wanted[6] = pose.height, pose.roll, pose.pitch, pose.yaw
        state = snapshot.state
        self._contact[:] = state.feet_in_contact
        own, numbers = self._state, self._numbers
        self._plan(snapshot.row, state.time, self._contact, state.tau, own, numbers, wanted, row)
        forces, self._mpc[_FRICTION] = self._forces, min(self._mpc_friction, row[_TARGET_FRICTION])
        self._steer(snapshot.row, state.time, own, numbers, self._mpc, wanted, forces, row)
        return Reference.of_row(row)


def _nothing_planned() -> np.ndarray:
    return FORCES.pack([-np.inf, np.zeros((4, 3))])


def _numbers(model: RobotModel, gait: Gait, config: LocomotionConfig) -> np.ndarray:
    correction, rest = CorrectionConfig(), resting_gait(gait)
    return LOCOMOTION.pack(
        [
            gait.period,
            gait.duty,
            gait.offsets,
            gait.width,
            rest.period,
            rest.duty,
            rest.offsets,
            rest.width,
            np.zeros(5) if gait.stride is None else astuple(gait.stride),
            [PERIOD_RATE, DUTY_RATE, OFFSET_RATE, DUTY_FALL, WIDTH_RATE],
            config.stride_margin,
            config.height_on_feet,
            [config.linear_acceleration] * 2 + [config.angular_acceleration],
            config.velocity_feedback,
            config.position_leash,
            config.yaw_leash,
            config.foothold_reach,
            config.normal_force_min,
            config.normal_force_max,
            config.mpc.load_ramp,
            config.settle_speed,
            SETTLED_COMMAND,
            config.capture_margin,
            config.square_tolerance,
            config.swing.at_most(gait.apex).apex,
            config.swing.touchdown_depth,
            config.swing.full_depth_way,
            GROUND_SHARE,
            correction.rate,
            correction.position_window,
            correction.position_limit,
            model.gravity,
            model.foot_radius,
            model.p_base_feet_nominal,
            astuple(config.slip),
            astuple(config.contact),
            astuple(config.ground),
            LEAST_DETERMINANT,
            MOST_SLOPE,
            MID_SWING,
            astuple(config.pose),
            [[n.rate, n.angle_window, n.angle_limit] for n in (READY, STRIDE)],
        ]
    )
