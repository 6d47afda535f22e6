"""Whole-body inverse kinematics for authored poses, by PlaCo's ``KinematicsSolver``.

``solve_pose`` runs Gauss-Newton steps, each a QP with the joint limits and the CoM polygon as hard
constraints: first with every target soft, so that a far start cannot make it infeasible, then with
the positions of the feet (and the trunk, if asked) as equalities. It then measures the result with
Pinocchio, not with PlaCo: unreachable targets would otherwise end in a silent near miss.

PlaCo's robot is made once for each ``RobotModel`` and kept as long as that lives. Solving changes
both, so a model, with the PlaCo robot that belongs to it, is for one thread at a time: two threads
that solve poses need two models.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
import pinocchio as pin
import placo
from jaxtyping import Float

from go2_wbc.errors import DescriptionError, IkError, ResidualRow
from go2_wbc.geometry import convex_hull, support_margin
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES, LEGS, Leg
from go2_wbc.records import Array4x3, Array19
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation, rotation_from_rpy

FOOT_WEIGHT, BODY_WEIGHT = 1e4, 1.0
"""Of the soft foot positions and of the raised leg's joints, and of the trunk's height, against 1
rad^2 of its orientation; own choice, as the following."""
POSTURE_WEIGHT, DAMPING = 1e-4, 1e-6
"""What pulls the standing legs towards the start, and so chooses among equal poses, and what keeps
the QP of a step definite at singularities."""
MAX_STEP, CONVERGED_STEP = 0.3, 1e-7
"""Longest change [rad or m] of a coordinate in one step, and that below which it has converged."""
MAX_ITERATIONS = 200  #: Of each of the two phases
POSITION_TOLERANCE, ANGLE_TOLERANCE, CONSTRAINT_TOLERANCE = 1e-4, 1e-3, 1e-5
"""Largest error [m] of a foot or of the height, [rad] of the orientation and of a raised leg's
joints, and violation [m, rad] of CoM margin and joint limits."""
_BASE = "base"
_ROBOTS: WeakKeyDictionary[RobotModel, placo.RobotWrapper] = WeakKeyDictionary()
"""PlaCo's robot of every living model for which a pose was solved; loading one takes 6 ms."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseTargets:
    """What a pose must be, in the world frame."""

    p_world_feet: Array4x3  #: foot centres [m]; the row of a raised leg is not used
    rpy: tuple[float, float, float]  #: roll, pitch, yaw [rad] of the trunk
    height: float  #: height [m] of the base's origin
    raised: Leg | None = None  #: leg in the air, if any; its joints stay as they are at the start
    com_margin: float = 0.0  #: least distance [m] of the CoM to the edges of the support polygon
    joint_margin: float = 0.05  #: least distance [rad] of every joint to its limits

    @property
    def stance(self) -> tuple[Leg, ...]:
        """Legs on the ground."""
        return tuple(leg for leg in LEGS if leg is not self.raised)

    @property
    def polygon(self) -> Float[np.ndarray, "k 2"]:
        """Points on the ground [m] that span the polygon for the CoM."""
        return self.p_world_feet[list(self.stance), :2]


def load_placo_robot(model: RobotModel) -> placo.RobotWrapper:
    """A new robot in PlaCo for ``model``: same URDF, joint limits and armature, no geometry.

    Each foot has an extra frame ``<leg>_contact``, at the foot frame until it is moved.

    Raises:
        DescriptionError: if PlaCo orders the joints differently.
    """
    root = ET.parse(model.description.urdf_path).getroot()
    for link in root.findall("link"):
        for geometry in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(geometry)
    for leg in LEGS:
        name = f"{leg.name}_contact"
        ET.SubElement(root, "link", name=name)
        joint = ET.SubElement(root, "joint", name=f"{name}_joint", type="fixed")
        ET.SubElement(joint, "parent", link=leg.foot)
        ET.SubElement(joint, "child", link=name)
    text = ET.tostring(root, encoding="unicode")
    path = str(model.description.urdf_path)
    robot = placo.RobotWrapper(path, placo.Flags.ignore_collisions, text)
    names = list(robot.joint_names())
    if names != list(JOINT_NAMES):
        raise DescriptionError(f"PlaCo has joints {names}; expected {list(JOINT_NAMES)}")
    robot.model.armature = model.pin_model.armature
    _limit_joints(robot, model, 0.0)
    return robot


def solve_pose(model: RobotModel, targets: PoseTargets, q_start: Array19) -> Array19:
    """The pose that meets ``targets``, found from ``q_start`` and as near to it as they allow.

    Only one thread at a time may solve with the same ``model``; see the module.

    Raises:
        IkError: if a target is missed by more than its tolerance; the message gives the table.
    """
    robot = _ROBOTS.get(model)
    if robot is None:
        robot = _ROBOTS[model] = load_placo_robot(model)
    _limit_joints(robot, model, targets.joint_margin)
    robot.state.q = q_start
    robot.update_kinematics()
    solver, exact_tasks = _formulate(robot, targets, q_start)
    iterations, failure = _iterate(solver, robot)
    if not failure:
        soft_q = np.array(robot.state.q)
        for task in exact_tasks:
            task.configure(task.name, "hard", 1.0)
        more, failure = _iterate(solver, robot)
        iterations += more
        if failure:
            robot.state.q = soft_q
    q = np.array(robot.state.q)
    rows = _residuals(model, targets, q_start, q)
    missed = [(row, limit) for row, limit in rows if not row.norm <= limit]
    if missed:
        table = [f"  {r.name:<20} {r.norm:10.3g} {r.unit} (limit {at:g})" for r, at in missed]
        why = f" ({failure})" if failure else ""
        head = f"no pose meets the targets after {iterations} steps{why}"
        raise IkError("\n".join([head, *table]), [row for row, _ in rows])
    return q


def _limit_joints(robot: placo.RobotWrapper, model: RobotModel, margin: float) -> None:
    for name, lower, upper in zip(JOINT_NAMES, model.q_lower, model.q_upper, strict=True):
        robot.set_joint_limits(name, float(lower + margin), float(upper - margin))


def _formulate(
    robot: placo.RobotWrapper, targets: PoseTargets, q_start: Array19
) -> tuple[placo.KinematicsSolver, list[placo.Task]]:
    """PlaCo's solver with every target soft, and the tasks to be made exact afterwards."""
    solver = placo.KinematicsSolver(robot)
    solver.enable_joint_limits(True)
    exact: list[placo.Task] = []
    for leg in targets.stance:
        exact.append(solver.add_position_task(leg.foot, targets.p_world_feet[leg]))
        exact[-1].configure(leg.foot, "soft", FOOT_WEIGHT)
    if targets.raised is not None:
        exact.append(_joints_task(solver, [targets.raised], q_start))
        exact[-1].configure("raised leg", "soft", FOOT_WEIGHT)
    orientation = solver.add_orientation_task(_BASE, rotation_from_rpy(*targets.rpy))
    orientation.configure("orientation", "soft", BODY_WEIGHT)
    height = solver.add_position_task(_BASE, np.array([0.0, 0.0, targets.height]))
    height.mask.set_axises("z")
    height.configure("height", "soft", BODY_WEIGHT)
    exact += [orientation, height]
    posture = _joints_task(solver, targets.stance, q_start)
    posture.configure("posture", "soft", POSTURE_WEIGHT)
    solver.add_regularization_task(DAMPING)
    clockwise = list(convex_hull(targets.polygon)[::-1])
    polygon = solver.add_com_polygon_constraint(clockwise, targets.com_margin)
    polygon.configure("CoM polygon", "hard", 1.0)
    return solver, exact


def _joints_task(
    solver: placo.KinematicsSolver, legs: Sequence[Leg], q: Array19
) -> placo.JointsTask:
    task = solver.add_joints_task()
    for leg in legs:
        task.set_joints(dict(zip(JOINT_NAMES[leg.joints], q[7:][leg.joints], strict=True)))
    return task


def _iterate(solver: placo.KinematicsSolver, robot: placo.RobotWrapper) -> tuple[int, str]:
    """Steps until converged; returns their number and why the QP failed, or an empty text."""
    for iteration in range(MAX_ITERATIONS):
        try:
            step = solver.solve(False)
        except RuntimeError as error:
            return iteration, str(error)
        largest = float(np.abs(step).max())
        step = step * min(1.0, MAX_STEP / max(largest, CONVERGED_STEP))
        robot.state.q = pin.integrate(robot.model, robot.state.q, step)
        robot.update_kinematics()
        if largest < CONVERGED_STEP:
            return iteration + 1, ""
    return MAX_ITERATIONS, ""


def _residuals(
    model: RobotModel, targets: PoseTargets, q_start: Array19, q: Array19
) -> list[tuple[ResidualRow, float]]:
    """How far ``q`` misses each target, with the tolerance."""
    com, feet = model.forward_kinematics(q)
    joints, most = q[7:], POSITION_TOLERANCE
    off = np.linalg.norm(feet - targets.p_world_feet, axis=1)
    rows = [(ResidualRow(FOOT_NAMES[leg], float(off[leg]), "m"), most) for leg in targets.stance]
    rows.append((ResidualRow("height", abs(float(q[2]) - targets.height), "m"), most))
    R_world_base = pin.Quaternion(q[3:7]).matrix()
    turn = float(np.linalg.norm(log_rotation(R_world_base.T @ rotation_from_rpy(*targets.rpy))))
    rows.append((ResidualRow("orientation", turn, "rad"), ANGLE_TOLERANCE))
    if targets.raised is not None:
        moved = float(np.abs(joints - q_start[7:])[targets.raised.joints].max())
        rows.append((ResidualRow("raised joints", moved, "rad"), ANGLE_TOLERANCE))
    short = max(targets.com_margin - support_margin(targets.polygon, com[:2]), 0.0)
    rows.append((ResidualRow("CoM margin short by", short, "m"), CONSTRAINT_TOLERANCE))
    least, greatest = model.q_lower + targets.joint_margin, model.q_upper - targets.joint_margin
    beyond = float(max((least - joints).max(), (joints - greatest).max(), 0.0))
    rows.append((ResidualRow("joint limits beyond", beyond, "rad"), CONSTRAINT_TOLERANCE))
    return rows
