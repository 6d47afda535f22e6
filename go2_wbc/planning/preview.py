"""The forces of a gait, planned ahead: from where the trunk and the feet shall go to a reference.

The MPC (``planning.mpc``) looks at the command as it will be ramped, at the feet that stand where
they are, and at those that come down where their footholds are planned. Lever arms are taken from
the measured CoM on its wanted way: taken from the reference, which may run ahead of the robot, they
make it drift aside. One that a push throws goes on as it is thrown, and slows down: thrown to 3.7
m/s and taken for one that trots at 0.5, it would have its next feet 0.4 m too far ahead, and be
tipped by forces planned for these. Between two solutions the forces of the first node are kept, and
the trunk's acceleration that the whole-body controller is given is what they make of the feet that
stand now.

This is the readable form; ``kernels.preview`` is the compiled one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from go2_wbc.contacts import TIE, Gait
from go2_wbc.kernels.layout import MPC, MPC_NODES
from go2_wbc.planning.ground import GroundPlane, tilt_vector
from go2_wbc.planning.mpc import Horizon, MpcConfig
from go2_wbc.planning.pose import pose_turn
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation, yaw_rotation
from go2_wbc.robot.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class Course:
    """What a gait is about to do.

    Attributes:
        gait: as it is now.
        time: of the gait [s].
        yaw: heading of the reference [rad].
        position: of the reference's CoM [m].
        velocity: ramped command in the heading frame [m/s], [rad/s].
        command: what it is ramped to.
        lean: pose of the trunk, from that of one that walks level: height, roll, pitch, yaw.
        leaning: that pose and its rate at the end of each node.
        acceleration: how fast, per second.
        footholds: where the feet in the air come down [m].
        ground: what is known of the ground.
        friction: greatest coefficient that the feet may count on.
        excess: velocity [m/s] of the CoM beyond the wanted one and the margin; see ``beyond``.
    """

    gait: Gait
    time: float
    yaw: float
    position: Float[np.ndarray, "3"]
    velocity: Float[np.ndarray, "3"]
    command: Float[np.ndarray, "3"]
    lean: Float[np.ndarray, "4"]
    leaning: Float[np.ndarray, "nodes 2 4"]
    acceleration: Float[np.ndarray, "3"]
    footholds: Float[np.ndarray, "4 2"]
    ground: GroundPlane
    friction: float
    excess: Float[np.ndarray, "2"]


class ForcePlanner:
    """Plans forces, and puts them into references."""

    def __init__(self, model: RobotModel, config: MpcConfig) -> None:
        """Prepare for ``model``."""
        from go2_wbc.algebra.active_set import SOLVED
        from go2_wbc.kernels.mpc import solve_mpc

        self._solve, self._solved = solve_mpc, SOLVED
        self._model, self._config = model, config
        self._numbers = config.numbers(model.mass, model.gravity)
        self.start()

    def start(self) -> None:
        """Forget what was planned."""
        self._next = -np.inf
        self._forces = np.zeros((4, 3))

    def update(self, snapshot: Snapshot, course: Course, reference: Reference) -> Reference:
        """``reference`` with the forces and the accelerations that they make."""
        now = snapshot.state.time
        if now >= self._next - TIE:
            if not self._plan(snapshot, course):
                return reference
            self._next = now + self._config.interval
        model = self._model
        forces = np.where(reference.stance[:, None], self._forces, 0.0)
        contacts = snapshot.p_world_feet - [0.0, 0.0, model.foot_radius]
        moment = np.cross(contacts - snapshot.p_world_com, forces).sum(axis=0)
        mass = model.mass + snapshot.payload[0]
        a = forces.sum(axis=0) / mass - [0.0, 0.0, model.gravity]
        dw = np.linalg.solve(inertia_about_com(snapshot), moment)
        return replace(
            reference,
            body=replace(reference.body, a_world=a, dw_world=dw),
            f_world_feet=forces,
            force_weight=self._config.prior_weight,
            orientation_discount=float(np.hypot(*course.excess)) / self._config.throw_speed,
        )

    def _plan(self, snapshot: Snapshot, course: Course) -> bool:
        """Solve for the forces of the first node, while its feet stand; False without solution."""
        horizon = look_ahead(snapshot, course, self._config, self._model)
        forces = np.empty((MPC_NODES, 4, 3))
        friction = min(self._config.friction, course.friction)
        self._numbers[MPC.start["friction"]] = friction
        self._numbers[MPC.start["mass"]] = self._model.mass + snapshot.payload[0]
        parts = horizon.state, horizon.goals, horizon.share, horizon.arms, horizon.inertia
        outcome = self._solve(self._numbers, *parts, forces)
        share = np.maximum(horizon.share[0], self._config.least_share)
        self._forces = forces[0] / share[:, None]
        return bool(outcome == self._solved)


def inertia_about_com(snapshot: Snapshot) -> Float[np.ndarray, "3 3"]:
    """Inertia [kg m^2] of the robot as it is, about its CoM, world axes."""
    R, mass = snapshot.R_world_base, snapshot.mass_matrix[0, 0]
    c = R.T @ (snapshot.p_world_com - snapshot.state.p_world_base)
    about_com = snapshot.mass_matrix[3:6, 3:6] - mass * (c @ c * np.eye(3) - np.outer(c, c))
    return R @ about_com @ R.T


def beyond(velocity: Float[np.ndarray, "2"], margin: float) -> Float[np.ndarray, "2"]:
    """What is left of a velocity when its length is less by ``margin`` [m/s]; 0 if it is less."""
    return velocity * max(0.0, 1.0 - margin / max(float(np.hypot(*velocity)), TIE))


def look_ahead(snapshot: Snapshot, course: Course, config: MpcConfig, model: RobotModel) -> Horizon:
    """What the MPC looks at, in nodes of ``config.step`` [s]."""
    step = config.step
    turn = log_rotation(snapshot.R_world_base @ yaw_rotation(course.yaw + course.lean[3]).T)
    w = snapshot.R_world_base @ snapshot.state.v[3:6]
    goals = _goals(course, step)
    share, landings = _contacts(course, step)
    arms = _arms(snapshot, course, config, model, goals, landings)
    return Horizon(
        state=np.concatenate([turn, snapshot.p_world_com, w, snapshot.v_world_com]),
        goals=_leaned(course, goals),
        share=share,
        arms=arms,
        inertia=inertia_about_com(snapshot),
    )


def _goals(course: Course, step: float) -> Float[np.ndarray, "nodes 12"]:
    """Pose and rate wanted at the end of each node: the command ramped and integrated."""
    goals = np.zeros((MPC_NODES, 12))
    velocity, yaw, position = course.velocity.copy(), course.yaw, course.position.copy()
    slope, turn = course.ground.slope, tilt_vector(course.ground.tilt)
    most = course.acceleration * step
    for goal in goals:
        velocity = velocity + np.clip(course.command - velocity, -most, most)
        yaw += velocity[2] * step
        along = yaw_rotation(yaw) @ [velocity[0], velocity[1], 0.0]
        along[2] = slope @ along[:2]
        position = position + along * step
        goal[:2] = turn
        goal[2], goal[8] = yaw - course.yaw, velocity[2]
        goal[3:6], goal[9:] = position, along
    return goals


def _leaned(course: Course, goals: Float[np.ndarray, "nodes 12"]) -> Float[np.ndarray, "nodes 12"]:
    """The goals of a level trunk with the pose on its way added."""
    leaned = goals.copy()
    for goal, (pose, rate) in zip(leaned, course.leaning, strict=True):
        turn, w = pose_turn(course.yaw + float(goal[2]), pose, rate)
        goal[2] += pose[3] - course.lean[3]
        goal[:3] += turn
        goal[6:9] += w
        goal[5] += pose[0]
        goal[11] += rate[0]
    return leaned


def _contacts(
    course: Course, step: float
) -> tuple[Float[np.ndarray, "nodes 4"], Float[np.ndarray, "nodes 4"]]:
    """Share of each node that each foot stands, and in how many strides it will have landed for it.

    The latter is at most 0 for a foot that stands there now.
    """
    gait = course.gait
    share, landings = np.empty((MPC_NODES, 4)), np.empty((MPC_NODES, 4))
    span = step / gait.period
    for leg, offset in enumerate(gait.offsets):
        first = (course.time / gait.period - offset + TIE) % 1.0 - TIE
        for k in range(MPC_NODES):
            phase = first + k * span
            stride = np.floor(phase + TIE)
            inside = phase - stride
            standing = max(min(inside + span, gait.duty) - inside, 0.0)
            again = max(min(inside + span - 1.0, gait.duty), 0.0)
            share[k, leg] = min((standing + again) / span, 1.0)
            is_present = inside < gait.duty - TIE or gait.duty >= 1.0
            landings[k, leg] = (stride if is_present else stride + 1.0) - first
            if is_present and (stride == 0.0 or gait.duty >= 1.0):
                landings[k, leg] = 0.0
    return share, landings


def _arms(
    snapshot: Snapshot,
    course: Course,
    config: MpcConfig,
    model: RobotModel,
    goals: Float[np.ndarray, "nodes 12"],
    landings: Float[np.ndarray, "nodes 4"],
) -> Float[np.ndarray, "nodes 4 3"]:
    """From the CoM in the middle of each node to the contact points [m].

    A foot that comes down once more is then below its hip in the middle of its stance.
    """
    arms = np.empty((MPC_NODES, 4, 3))
    com, gait = snapshot.p_world_com, course.gait
    base = snapshot.state.p_world_base - com + snapshot.com_shift
    before, nominal = course.position[:2], gait.placed(model.p_base_feet_nominal)
    for k in range(MPC_NODES):
        middle = (k + 0.5) * config.step
        left = np.exp(-middle / config.throw_time)
        way = (before + goals[k, 3:5]) / 2 - course.position[:2]
        way += course.excess * config.throw_time * (1.0 - left)
        before = goals[k, 3:5]
        for leg in range(4):
            arm = arms[k, leg]
            wait = landings[k, leg] * gait.period
            if landings[k, leg] == 0.0:
                foot = snapshot.p_world_feet[leg] - com
                arm[:2], arm[2] = foot[:2] - way, foot[2] - model.foot_radius
            elif landings[k, leg] < 1.0 - gait.duty + TIE:
                arm[:2] = course.footholds[leg] - com[:2] - way
                arm[2] = course.ground.at(course.footholds[leg]) - com[2]
            else:
                yaw, rate = course.yaw + goals[k, 8] * wait, goals[k, 8]
                hip = (yaw_rotation(yaw) @ nominal[leg])[:2]
                speed = goals[k, 9:11] + course.excess * left + rate * np.array([-hip[1], hip[0]])
                arm[:2] = base[:2] + hip + speed * (gait.stance_time / 2 + wait - middle)
                arm[2] = course.ground.at(com[:2] + arm[:2]) - com[2]
    return arms
