"""Small plans whose feet step, written by hand: a step to a new place, and a hop."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline, PPoly

from go2_wbc.contacts import ContactSchedule
from go2_wbc.legs import LEGS, Leg
from go2_wbc.motion_plan import Posture
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from motions.plan.compiled_plan import CompiledPlan
from motions.postures import standing_feet
from tests.engine_helpers import STAND_JOINTS

STAND_HEIGHT = find_profile().stand_height

LIFT_OFF, TOUCHDOWN = 0.8, 1.2  #: Of the step [s]
TAKE_OFF, SPEED = 0.5, 1.2  #: Of the hop: when [s] and how fast [m/s]
LANDING = TAKE_OFF + 2 * SPEED / 9.81
_HOP_RAMP, _STEP_RAMP = 0.01, 0.1


@dataclass
class Knots:
    """CoM and feet at some instants, with their velocities."""

    times: list[float]
    rows: list[np.ndarray]
    rates: list[np.ndarray]

    def add(self, time: float, com: np.ndarray, v_com: np.ndarray, feet: np.ndarray) -> None:
        joints = STAND_JOINTS
        self.times.append(time)
        self.rows.append(np.concatenate([com, np.zeros(3), joints, feet.ravel()]))
        self.rates.append(np.concatenate([v_com, np.zeros(27)]))

    def plan(self, name: str, contacts: ContactSchedule, ramp: float) -> CompiledPlan:
        curves = CubicHermiteSpline(self.times, self.rows, self.rates)
        return CompiledPlan(
            name=name,
            entry=Posture.STAND,
            exit=Posture.STAND,
            curves=PPoly(curves.c, curves.x),
            contacts=contacts,
            swings=~contacts.modes,
            ramp=ramp,
            problems=(),
            spans={},
        )


def step_plan(model: RobotModel, leg: Leg, x: float, y: float = 0.0) -> CompiledPlan:
    """The foot of ``leg`` moves by x and y [m], the CoM to the middle of the feet in the end."""
    feet, still, up = standing_feet(model), np.zeros(3), np.array([0.0, 0.0, STAND_HEIGHT])
    others = [other for other in LEGS if other is not leg]
    over = feet[others].mean(axis=0) * [1.0, 1.0, 0.0] + up
    raised, landed = feet.copy(), feet.copy()
    landed[leg, :2] += [x, y]
    raised[leg] = 0.5 * (feet[leg] + landed[leg]) + [0.0, 0.0, 0.05]
    knots = Knots([], [], [])
    for time, com, place in (
        (0.0, up, feet),
        (0.7, over, feet),
        (LIFT_OFF, over, feet),
        (0.5 * (LIFT_OFF + TOUCHDOWN), over, raised),
        (TOUCHDOWN, over, landed),
        (TOUCHDOWN + 0.2, over, landed),
        (TOUCHDOWN + 1.0, landed.mean(axis=0) * [1.0, 1.0, 0.0] + up, landed),
    ):
        knots.add(time, com, still, place)
    modes = np.ones((3, 4), dtype=bool)
    modes[1, leg] = False
    schedule = ContactSchedule((0.0, LIFT_OFF, TOUCHDOWN), modes)
    return knots.plan("step", schedule, _STEP_RAMP)


def hop_plan(model: RobotModel, x: float = 0.0, count: int = 1) -> CompiledPlan:
    """``count`` hops from four feet to four feet, each x [m] ahead."""
    feet, flight = standing_feet(model), LANDING - TAKE_OFF
    ahead, still, knots = np.array([1.0, 0.0, 0.0]), np.zeros(3), Knots([], [], [])
    vx, times, begin = x / (flight + 0.1), [0.0], 0.0
    for hop in range(count):
        start, end = hop * x * ahead, (hop + 1) * x * ahead
        off, down = start + 0.05 * vx * ahead, end - 0.05 * vx * ahead
        middle, tucked = 0.5 * (start + end), np.array([0.0, 0.0, 0.04])
        top = 0.31 + 0.5 * SPEED**2 / 9.81
        lift, fall = np.array([vx, 0.0, SPEED]), np.array([vx, 0.0, -SPEED])
        for time, com, v_com, place in (
            (0.0, start + [0.0, 0.0, STAND_HEIGHT], still, feet + start),
            (0.3, start + [0.0, 0.0, 0.23], still, feet + start),
            (TAKE_OFF, off + [0.0, 0.0, 0.31], lift, feet + start),
            (TAKE_OFF + flight / 2, middle + [0, 0, top], vx * ahead, feet + middle + tucked),
            (LANDING, down + [0.0, 0.0, 0.31], fall, feet + end),
            (LANDING + 0.2, end + [0.0, 0.0, 0.23], still, feet + end),
        ):
            knots.add(begin + time, com, v_com, place)
        times += [begin + TAKE_OFF, begin + LANDING]
        begin += LANDING + 0.5
    end = count * x * ahead
    knots.add(begin, end + [0.0, 0.0, STAND_HEIGHT], still, feet + end)
    modes = np.ones((2 * count + 1, 4), dtype=bool)
    modes[1::2] = False
    return knots.plan("hop", ContactSchedule(tuple(times), modes), _HOP_RAMP)
