"""One motion played in MuJoCo: what was measured, and what went wrong by the simulator's truth.

Slip and loads, how far the robot was from its plan, and from what was written.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float

from controller.go2_controller import GO2Controller
from controller.modes import Mode
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.plant.mujoco.ground_truth import TOUCH, GroundTruth, TruthRecording
from go2_wbc.recording import true_runs
from go2_wbc.records import layout_of
from go2_wbc.reference import STANCE, Anchor, LegTask, Target
from go2_wbc.robot.leg_kinematics import LegGeometry, foot_places
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from motions.batch_kinematics import attitudes
from motions.dynamics.phases import PhaseProblem
from motions.feasibility.goal_errors import misses_of
from motions.plan.compiled_plan import CompiledPlan, DynamicSpan

STRIDE = 5  #: Every fifth tick is compared with what was written
LANDED = 0.1
"""Time [s] after a touchdown at which the place of a foot counts: it has its load by then."""


def placed(plan: MotionPlan, times: Float[np.ndarray, " m"], anchor: Anchor) -> np.ndarray:
    """The targets (m,) of ``plan`` at ``times`` [s], as ``plan.at(t).placed(anchor)`` has each.

    That is a structured array: fields ``legs``, ``p_world``, ``R_world_base``, ``p_world_feet`` and
    ``q_joints`` of ``Target`` are those of a motion that began at ``anchor``.
    """
    R, layout = yaw_rotation(anchor.yaw), layout_of(Target)
    rows = np.empty((len(times), layout.size))
    for k, t in enumerate(times.tolist()):
        rows[k] = plan.row_at(t)
    asked = rows.view(layout.dtype)[:, 0]
    asked["p_world"] = anchor.p_world + asked["p_world"] @ R.T
    asked["R_world_base"] = R @ asked["R_world_base"]
    asked["p_world_feet"] = anchor.p_world + asked["p_world_feet"] @ R.T
    return asked


def trunk_off(asked: np.ndarray, truth: TruthRecording) -> Float[np.ndarray, " m"]:
    """Distances [m] of the tracked point from its place in ``placed`` targets of the same times."""
    point = np.where(asked["is_com"][:, None] != 0.0, truth.p_world_com, truth.q[:, :3])
    return np.linalg.norm(point - asked["p_world"], axis=1)


def turned_off(asked: np.ndarray, truth: TruthRecording) -> Float[np.ndarray, " m"]:
    """Angles [rad] between the trunk's orientation and the planned one, 0 to pi."""
    turn = asked["R_world_base"] @ attitudes(truth.rpy).transpose(0, 2, 1)
    pairs = ((2, 1), (0, 2), (1, 0))
    twice_sine = np.linalg.norm([turn[:, i, j] - turn[:, j, i] for i, j in pairs], axis=0)
    return np.arctan2(twice_sine, turn.trace(axis1=1, axis2=2) - 1.0)


def off_written(
    recorded: TruthRecording, plan: MotionPlan, model: RobotModel
) -> Float[np.ndarray, "4"]:
    """Largest deviations of the recording of a played ``plan`` from what was written.

    They are those of the tracked point of the trunk [m], of its attitude [rad], of a foot in the
    air, and of one that came down, in the world [m].

    Parts that follow curves are compared with these in every ``STRIDE``-th tick; solved parts with
    what was asked of them (see ``motions.feasibility.goal_errors``): their plan is only one answer.
    """
    anchor = Anchor.of_feet(recorded.p_world_feet[0].copy(), model.foot_radius)
    spans = plan.dynamic if isinstance(plan, CompiledPlan) else ()
    times = recorded.time - recorded.time[0]
    solved = np.zeros(len(times), dtype=bool)
    for span in spans:
        solved |= (times >= span.start) & (times < span.end)
    found = _off_curves(recorded, plan, anchor, solved)
    for span in spans:
        if span.start < times[-1]:
            found = np.maximum(found, _off_asked(recorded, span, anchor, model))
    return found


def _off_curves(
    recorded: TruthRecording, plan: MotionPlan, anchor: Anchor, solved: Bool[np.ndarray, " n"]
) -> Float[np.ndarray, "4"]:
    """Trunk and feet against the plan's curves, where no part is solved."""
    truth = recorded.part(np.flatnonzero(~solved[::STRIDE]) * STRIDE)
    asked = placed(plan, truth.time - recorded.time[0], anchor)
    trunk, turned = trunk_off(asked, truth), turned_off(asked, truth)
    stance = asked["legs"] == STANCE
    feet = np.linalg.norm(truth.p_world_feet - asked["p_world_feet"], axis=2)
    in_air, landed = feet[~stance].max(initial=0.0), _landed_off(truth.time, stance, feet)
    return np.array([trunk.max(initial=0.0), turned.max(initial=0.0), in_air, landed])


def _landed_off(
    times: Float[np.ndarray, " m"], stance: Bool[np.ndarray, "m 4"], off: Float[np.ndarray, "m 4"]
) -> float:
    """Largest distance [m] of a foot from its place, ``LANDED`` after it should have come down."""
    worst = 0.0
    for leg in LEGS:
        for phase in true_runs(stance[:, leg]):
            if phase.start > 0:
                settled = int(np.searchsorted(times, times[phase.start] + LANDED))
                worst = max(worst, float(off[min(settled, phase.stop - 1), leg]))
    return worst


def _off_asked(
    recorded: TruthRecording, span: DynamicSpan, anchor: Anchor, model: RobotModel
) -> Float[np.ndarray, "4"]:
    """A solved part against what was asked: as its plan is judged, with the truth instead of it."""
    plan, R = span.trajectory, yaw_rotation(anchor.yaw)
    when = recorded.time[0] + span.start + plan.times
    rows = np.minimum(np.searchsorted(recorded.time, when), len(recorded.time) - 1)
    q, turn = recorded.q[rows].copy(), pin.Quaternion(R.T)
    q[:, :3] = (q[:, :3] - anchor.p_world) @ R
    q[:, 3:7] = [(turn * pin.Quaternion(xyzw)).coeffs() for xyzw in q[:, 3:7]]
    places = (recorded.p_world_feet[rows] - anchor.p_world) @ R
    found = misses_of(replace(span, trajectory=replace(plan, q=q)), places, model)
    lands = np.ones((len(found.times), 4), dtype=bool)
    if isinstance(span.asked, PhaseProblem):
        lands = _landings(span.asked)
    away, turned = np.nan_to_num(found.away), np.nan_to_num(found.turned)
    feet = away[:, 1:]
    in_air, landed = (feet[which].max(initial=0.0) for which in (~lands, lands))
    return np.array([away[:, 0].max(), turned.max(), in_air, landed])


def _landings(asked: PhaseProblem) -> Bool[np.ndarray, "k 4"]:
    """Which feet come down at the end of each phase."""
    stands = np.array([[leg in phase.stance for leg in LEGS] for phase in asked.phases])
    return ~stands & np.vstack([stands[1:], stands[-1:]])


HALF_LENGTH = 0.2  #: Distance [m] from the trunk's middle to its ends: what a wrong attitude moves
FULL = 0.999  #: Share of a torque limit from which on a motor gives all it has
SETTLED_CONTACT = 0.1
"""Time [s] after a touchdown, and before a lift-off, in which an unloaded foot may skid."""

OF_FEET = ("feet_off", "paw_off", "landed_off")
"""What is measured of feet that were raised or came down: 0 to the last bit if there were none."""


@dataclass(frozen=True, slots=True)
class MotionMeasurement:
    """What was measured while a motion was played.

    The last four count from where the robot stood at first, and where a part is solved, from where
    it stood then: at the ends of its phases, what was asked there.
    """

    fall: str | None  #: why the robot fell, or went limp because it fell, or None
    said: bool  #: what ``play`` said
    reason: str  #: in its words
    slip: float
    """Largest distance [m] that the material of a standing foot slid at its contact point."""
    torque: float  #: largest share of a joint's torque limit
    speed: float  #: largest share of a joint's speed limit
    saturated: float  #: time [s] in which some motor gave all it has
    tracking: float  #: largest distance [m] of the CoM from its plan
    ends_off: float
    """Largest distance [m] of the trunk's ends from their plan, seen from its middle."""
    feet_off: float  #: largest distance [m] of a raised foot from its plan, seen from the trunk
    joint_distance: float  #: least distance [rad] of a joint to its limit
    stopped: float  #: time [s] in which a joint pressed against the stop at its limit
    touched: float  #: time [s] in which a knee or the trunk touched the ground, or a link another
    trunk_off: float  #: largest distance [m] of the trunk from what was written
    turned_off: float  #: largest angle [rad] of the trunk from what was written
    paw_off: float  #: largest distance [m] of a foot in the air from its place in the world
    landed_off: float  #: largest distance [m] of a foot that came down from its place

    @property
    def ok(self) -> bool:
        """Whether it was done, and the robot is on its feet."""
        return self.said and self.fall is None

    def lines(self) -> list[tuple[str, str, str]]:
        """What was measured: name, value and unit, for a person."""
        return [
            ("CoM off its plan, at most", f"{1000 * self.tracking:.1f}", "mm"),
            ("slip of a standing foot, at most", f"{1000 * self.slip:.1f}", "mm"),
            ("peak joint torque, of its limit", f"{100 * self.torque:.0f}", "%"),
            ("peak joint speed, of its limit", f"{100 * self.speed:.0f}", "%"),
            ("least distance of a joint to its limit", f"{self.joint_distance:.3f}", "rad"),
        ]

    def as_dict(self) -> dict[str, float | bool | str | None]:
        """Plain values, for JSON; None where no foot was raised or came down to be compared."""
        feet = {name: getattr(self, name) or None for name in OF_FEET}
        return {"ok": self.ok, **asdict(self), **feet}


def measure_motion(
    go2: GO2Controller, truth: GroundTruth, plan: MotionPlan, model: RobotModel
) -> MotionMeasurement:
    """Play ``plan``, unchecked, on a robot that is in its entry posture.

    Args:
        go2: the controller, whose plant is ``truth``.
        truth: cleared before the motion.
        plan: the motion.
        model: of the robot, for its limits.
    """
    truth.clear()
    said = go2.play(plan, check=False)
    # It goes limp as soon as a fall cannot be stopped, before the trunk lies on the ground.
    given_up = go2.last_outcome.reason if go2.mode in (Mode.FALLEN, Mode.DAMPED) else None
    fall, dt = truth.fall() or given_up, truth.control_period
    recorded = during_motion(go2, truth, plan.name)
    shares = recorded.torque_shares(model)
    force = np.maximum(recorded.trunk_force, recorded.limb_force)
    com, attitude, feet = _off_plan(recorded, plan, model)
    trunk, turned, paw, landed = off_written(recorded, plan, model).tolist()
    return MotionMeasurement(
        fall=fall,
        said=said,
        reason=go2.last_outcome.reason,
        slip=_slip(recorded, plan, dt),
        torque=float(shares.max()),
        speed=recorded.peak_speed_share(model),
        saturated=dt * float((shares >= FULL).sum()),
        tracking=com,
        ends_off=HALF_LENGTH * attitude,
        feet_off=feet,
        joint_distance=recorded.joint_distance(model),
        stopped=dt * float((recorded.joint_distances(model) <= 0.0).sum()),
        touched=dt * float((recorded.touches_itself | (force > TOUCH)).sum()),
        trunk_off=trunk,
        turned_off=turned,
        paw_off=paw,
        landed_off=landed,
    )


def during_motion(go2: GO2Controller, truth: GroundTruth, name: str) -> TruthRecording:
    """The ticks in which the plan was played."""
    ticks = go2.telemetry.samples(1.0 / truth.control_period, since=truth.start).unfinished
    recorded, times = truth.recording(), ticks.time[np.array(ticks.labels) == name]
    if len(times) == 0:
        return recorded
    first, last = np.searchsorted(recorded.time, [times[0], times[-1] + 1e-9])
    return recorded.part(slice(int(first), max(int(last), int(first) + 2)))


def _slip(recorded: TruthRecording, plan: MotionPlan, dt: float) -> float:
    """Largest distance [m] slid in a stance phase, less its edges inside of the motion."""
    start, n = float(recorded.time[0]), len(recorded.time)
    rows = [plan.row_at(t) for t in (recorded.time - start).tolist()]
    stance = np.array([Target.of(row).legs for row in rows]) == STANCE
    margin, worst = round(SETTLED_CONTACT / dt), 0.0
    for leg in LEGS:
        for phase in true_runs(stance[:, leg]):
            first = phase.start + (margin if phase.start > 0 else 0)
            last = phase.stop - (margin if phase.stop < n else 0)
            path = np.cumsum(dt * recorded.v_world_contacts[first : max(first, last), leg], axis=0)
            worst = max(worst, float(np.linalg.norm(path, axis=1).max(initial=0.0)))
    return worst


def _off_plan(
    recorded: TruthRecording, plan: MotionPlan, model: RobotModel
) -> tuple[float, float, float]:
    """Largest deviations from the plan: CoM [m], attitude [rad], raised feet [m]."""
    anchor = Anchor.of_feet(recorded.p_world_feet[0].copy(), model.foot_radius)
    truth = recorded.part(slice(None, None, STRIDE))
    asked = placed(plan, truth.time - recorded.time[0], anchor)
    raised, feet = asked["legs"] == LegTask.JOINTS, 0.0
    for leg in LEGS:
        rows, geometry = raised[:, leg], LegGeometry.of(model, leg)
        real, planned = truth.q[rows, 7:][:, leg.joints], asked["q_joints"][rows][:, leg.joints]
        off = foot_places(geometry, real) - foot_places(geometry, planned)
        feet = max(feet, float(np.linalg.norm(off, axis=1).max(initial=0.0)))
    return float(trunk_off(asked, truth).max()), float(turned_off(asked, truth).max()), feet


UNPLANNED, NOT_DONE, FELL = "no plan was found", "not done", "fell"
OFF_TRUNK, OFF_TURN, OFF_PAW, OFF_LANDING = 0.030, math.radians(8.0), 0.030, 0.015
"""How far [m, rad] trunk, raised feet and landed feet may be off what was written."""
SOLVED_OFF, SOLVED_LANDING = 0.050, 0.040
"""The same where a part is solved: the tolerance that a timeline gives by itself, and how near its
place a jump must land."""
SLIP = 0.010  #: Distance [m] that a standing foot may slide
MOMENT = 0.010
"""Time [s] for which motors may be saturated, joints on a stop, and what must not touch touch."""
BEYOND = 0.02  #: Angle [rad] by which a joint may be past its limit


def failures_of(run: MotionMeasurement, plan: MotionPlan) -> tuple[str, ...]:
    """What went wrong, in words, as an author sees it: not done, or not as it was written."""
    unplanned = any(problem.check == "dynamic plan" for problem in getattr(plan, "problems", ()))
    wrong = {
        UNPLANNED: unplanned,
        FELL: run.fall is not None,
        NOT_DONE: not (run.said or unplanned),
    }
    found = tuple(what for what, is_so in wrong.items() if is_so)
    if unplanned:
        return found
    return (*found, *(words for share, words in shares_of(run, plan).values() if share > 1.0))


def shares_of(run: MotionMeasurement, plan: MotionPlan) -> dict[str, tuple[float, str]]:
    """What ``failures_of`` looks at, by name: its share of what is allowed, and in words.

    A share above 1 is wrong.
    """
    is_solved = isinstance(plan, CompiledPlan) and bool(plan.dynamic)
    off, landing = (SOLVED_OFF, SOLVED_LANDING) if is_solved else (OFF_TRUNK, OFF_LANDING)
    paw, landed = max(run.paw_off, short_legs(plan)), run.landed_off
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


def short_legs(plan: MotionPlan) -> float:
    """Largest distance [m] by which a leg is too short for what was written."""
    misses = [problem.miss for problem in getattr(plan, "problems", ())]
    return max((miss for miss in misses if miss > 0.0), default=0.0)
