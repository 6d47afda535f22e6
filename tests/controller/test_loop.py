"""The loop damps a robot whose QP, plant or posture fails, and says why."""

import logging
import re
from dataclasses import replace

import numpy as np
import pytest

from controller.behaviours import Behaviour, Damped, ServoJoints
from controller.loop import OLDEST_SCAN, ControlLoop
from controller.modes import Fault
from controller.telemetry import SeenTerrain, Telemetry
from go2_wbc.contacts import find_gait
from go2_wbc.errors import PlantError, PlantTimeout, QpInfeasible, ResidualRow
from go2_wbc.planning.command import ZERO_COMMAND
from go2_wbc.planning.locomotion import LocomotionConfig, LocomotionPlanner
from go2_wbc.plant.base import Scan
from go2_wbc.reference import JointReference, Reference
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.foot_watch import PULLED, SUNK
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.safety import SafetyConfig
from go2_wbc.robot.state import PartFault, Snapshot
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.controller import WbcSolution, WholeBodyController
from go2_wbc.wbc.solvers import LIMITS
from tests.controller.plants import PERIOD, StillPlant, break_qp, is_limp

TUCKED_JOINTS = find_profile().tucked_joints

SAFETY = SafetyConfig()
# Ticks that a silent plant is borne with.
BORNE = int(SAFETY.stale_limit / PERIOD)
STANDING = np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0, *np.tile([0.0, 0.8, -1.6], 4)])


class Balance(Behaviour):
    """Stands still by the whole-body controller."""

    label = "balance"

    def __init__(self, model: RobotModel) -> None:
        self._planner = LocomotionPlanner(model, find_gait("trot"), LocomotionConfig())

    def start(self, snapshot: Snapshot) -> None:
        self._planner.start(snapshot)
        self._reference = self._planner.update(snapshot, ZERO_COMMAND)

    def update(self, snapshot: Snapshot) -> Reference | JointReference:
        return self._reference

    def is_finished(self, snapshot: Snapshot) -> bool:
        return False


@pytest.fixture
def plant() -> StillPlant:
    plant = StillPlant()
    plant.state = replace(plant.state, q=STANDING.copy())
    return plant


@pytest.fixture
def loop(plant: StillPlant, model: RobotModel) -> ControlLoop:
    wbc = WholeBodyController(model)
    return ControlLoop(plant, model, wbc, Telemetry(model, 1000), SAFETY)


def run(loop: ControlLoop, ticks: int) -> None:
    for _ in range(ticks):
        loop.tick()


def fault_of(loop: ControlLoop) -> Fault:
    assert loop.fault is not None
    return loop.fault


def tilt(plant: StillPlant, roll: float) -> None:
    q = plant.state.q.copy()
    q[3:7] = [np.sin(roll / 2), 0.0, 0.0, np.cos(roll / 2)]
    plant.state = replace(plant.state, q=q)


@pytest.mark.parametrize("is_hardware", [False, True])
def test_a_simulated_robot_is_taken_where_it_will_be_and_one_that_may_be_real_where_it_is(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, *, is_hardware: bool
) -> None:
    monkeypatch.setattr(StillPlant, "is_hardware", is_hardware)
    loop: ControlLoop = request.getfixturevalue("loop")
    plant: StillPlant = request.getfixturevalue("plant")
    loop.engage(Balance(loop.model))
    run(loop, 3)
    assert loop.snapshot.state is loop.state
    assert not plant.commands[-1].kp.any()
    loop.latency._lag.ticks = 2.0
    run(loop, 1)
    assert (loop.snapshot.state is loop.state) is is_hardware
    assert loop.snapshot.state.time == loop.state.time
    assert is_hardware or plant.commands[-1].kp.all()


@pytest.mark.parametrize("broken", [range(5, 6), range(5, 9)])
def test_an_infeasible_qp_holds_the_last_command_for_a_tick_and_more_damp_the_robot_meanwhile(
    loop: ControlLoop, plant: StillPlant, monkeypatch: pytest.MonkeyPatch, broken: range
) -> None:
    break_qp(monkeypatch, lambda n: n in broken)
    loop.engage(Balance(loop.model))
    run(loop, 11)
    assert plant.commands[5] is plant.commands[4]
    assert plant.commands[broken.stop] is not plant.commands[broken.stop - 1]
    assert [is_limp(command) for command in plant.commands] == [n in broken[1:] for n in range(11)]
    assert loop.telemetry.qp_failures == len(broken)
    assert loop.fault is None


def test_infeasible_qps_are_logged_and_the_residual_table_once_in_a_tumble(
    loop: ControlLoop, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    break_qp(monkeypatch, lambda n: n % 2 == 0)
    loop.engage(Balance(loop.model))
    with caplog.at_level(logging.WARNING):
        run(loop, 6)
    assert caplog.text.count("QP failure at t=") == 3
    assert caplog.text.count("found no solution of the whole-body QP") == 3
    for row in ("contact forces", "torque limits", "base dynamics"):
        assert caplog.text.count(row) == 1


def test_failures_that_are_not_in_a_row_do_not_add_up(
    loop: ControlLoop, monkeypatch: pytest.MonkeyPatch
) -> None:
    break_qp(monkeypatch, lambda n: n % SAFETY.qp_patience != 0)
    loop.engage(Balance(loop.model))
    run(loop, 5 * SAFETY.qp_patience)
    assert loop.fault is None
    assert loop.telemetry.qp_failures == 5 * (SAFETY.qp_patience - 1)


def test_a_new_behaviour_has_the_whole_patience_again(
    loop: ControlLoop, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The count once went on from the behaviour before: it passed the limit without meeting it,
    # and a second behaviour was neither held nor ever ended.
    break_qp(monkeypatch, lambda n: True)
    for _ in range(3):
        loop.engage(Balance(loop.model))
        run(loop, SAFETY.qp_patience - 1)
        assert loop.fault is None
        loop.tick()
        what = f"damped after {SAFETY.qp_patience} QP failures in a row: .* found no solution"
        assert re.match(f"{what}[^\n]*$", fault_of(loop).reason)
    assert loop.telemetry.qp_failures == 3 * SAFETY.qp_patience


def relax(monkeypatch: pytest.MonkeyPatch, stance: float) -> None:
    """Make every solution a relaxed one, the stance feet violated by ``stance`` [m/s^2]."""
    real = WholeBodyController.solve

    def solve(
        self: WholeBodyController, snapshot: Snapshot, reference: Reference, *, relax: bool = False
    ) -> WbcSolution:
        assert relax, "the loop must always ask for an answer"
        return replace(real(self, snapshot, reference), is_relaxed=True)

    rows = (ResidualRow("stance feet", stance, "m/s^2"),)
    monkeypatch.setattr(WholeBodyController, "solve", solve)
    monkeypatch.setattr(WbcSolution, "violations", property(lambda _: rows))


def test_a_relaxed_answer_is_followed_and_counted(
    loop: ControlLoop, plant: StillPlant, monkeypatch: pytest.MonkeyPatch
) -> None:
    relax(monkeypatch, 0.9 * LIMITS["stance feet"])
    loop.engage(Balance(loop.model))
    run(loop, 3 * SAFETY.qp_patience)
    assert loop.fault is None
    assert not any(is_limp(command) for command in plant.commands)
    counts = (loop.telemetry.relaxed_ticks, loop.telemetry.grave_ticks, loop.telemetry.qp_failures)
    assert counts == (3 * SAFETY.qp_patience, 0, 0)


def test_grave_violations_damp_the_robot_only_when_they_last(
    loop: ControlLoop, plant: StillPlant, monkeypatch: pytest.MonkeyPatch
) -> None:
    within = round(SAFETY.grave_limit_time / plant.control_period)
    loop.engage(Balance(loop.model))
    with monkeypatch.context() as patch:
        relax(patch, 1.1 * LIMITS["stance feet"])
        run(loop, within)
    run(loop, 1)
    assert loop.fault is None
    assert not any(is_limp(command) for command in plant.commands)
    relax(monkeypatch, 1.1 * LIMITS["stance feet"])
    run(loop, within + 2)
    assert "s of broken constraints: " in fault_of(loop).reason
    assert "stance feet 33 m/s^2" in fault_of(loop).reason
    assert is_limp(plant.commands[-1])
    assert 2 * within <= loop.telemetry.grave_ticks <= 2 * within + 2


def test_a_plant_whose_clock_stands_still_is_reported_after_the_limit(
    loop: ControlLoop, plant: StillPlant
) -> None:
    # The state that a silent plant returns may be the very same object each time.
    loop.tick()
    plant.is_clock_standing = True
    run(loop, BORNE)
    with pytest.raises(PlantTimeout, match="no new state from the plant for 32 ms"):
        run(loop, 2)
    assert loop.fault == Fault("plant failed: no new state from the plant for 32 ms")
    assert is_limp(plant.commands[-1])


@pytest.mark.parametrize("late", [0.0, 0.02, OLDEST_SCAN * PERIOD + 0.1])
def test_a_scan_is_taken_in_unless_nobody_knows_where_it_was_taken(
    loop: ControlLoop, plant: StillPlant, monkeypatch: pytest.MonkeyPatch, late: float
) -> None:
    points = np.array([[0.4, 0.1, -0.25]], dtype=np.float32)  # as lidars give them
    monkeypatch.setattr(plant, "scan", lambda: Scan(plant.read().time - late, points, 0.01))
    run(loop, 2)
    seen = SeenTerrain(loop.heights, "").height(0.4, 0.1)
    assert np.isnan(seen) == (late > 0.1)
    assert loop.fault is None


@pytest.mark.parametrize(
    ("scan", "message"),
    [
        (Scan(np.nan, np.zeros((4, 3)), 0.01), "time .* must be finite"),
        (Scan(0.0, np.zeros((4, 3)), np.nan), "its deviation .* above 0; got 0.0 and nan"),
        (Scan(0.0, np.zeros((4, 3)), 0.0), "its deviation .* above 0"),
    ],
)
def test_a_scan_that_cannot_be_placed_is_told_in_words(scan: Scan, message: str) -> None:
    with pytest.raises(PlantError, match=message):
        scan.checked()


def test_a_slow_period_and_a_short_silence_are_borne_with(
    loop: ControlLoop, plant: StillPlant, model: RobotModel
) -> None:
    for _ in range(3):
        plant.is_clock_standing = True
        run(loop, BORNE)
        plant.is_clock_standing = False
        run(loop, 2)
    assert loop.fault is None
    plant = StillPlant(period=2 * SAFETY.stale_limit)
    loop = ControlLoop(plant, model, WholeBodyController(model), Telemetry(model, 10), SAFETY)
    for _ in range(3):
        loop.engage(Damped())
        loop.tick()
    assert loop.fault is None


def test_a_plant_without_a_finite_first_state_is_refused(
    plant: StillPlant, model: RobotModel
) -> None:
    plant.state = replace(plant.state, q=np.full(19, np.nan))
    with pytest.raises(PlantError, match="first state of the plant is not finite"):
        ControlLoop(plant, model, WholeBodyController(model), Telemetry(model, 10), SAFETY)


def test_a_robot_whose_legs_have_folded_has_fallen(loop: ControlLoop, plant: StillPlant) -> None:
    loop.engage(Balance(loop.model))
    q = STANDING.copy()
    q[7:] = np.tile([0.0, 2.6, -2.7], 4)
    plant.state = replace(plant.state, q=q, time=1.0)
    loop.tick()
    assert fault_of(loop).is_fall
    assert "above the feet" in fault_of(loop).reason


def test_a_robot_that_lies_on_its_side_may_move_its_joints(
    loop: ControlLoop, plant: StillPlant
) -> None:
    tilt(plant, 2.0)
    loop.engage(ServoJoints("fold", ((0.1, TUCKED_JOINTS),)))
    run(loop, 5)
    assert loop.fault is None


def test_a_damped_robot_that_tips_over_later_has_fallen_after_all(
    loop: ControlLoop, plant: StillPlant
) -> None:
    loop.abandon(Fault("damped after 10 QP failures in a row", may_fall=True))
    loop.tick()
    assert loop.fault is not None
    assert not loop.fault.is_fall
    tilt(plant, 1.5)
    run(loop, 3)
    assert fault_of(loop).is_fall
    assert fault_of(loop).reason.startswith("fell at t=")
    assert fault_of(loop).reason.endswith("after: damped after 10 QP failures in a row")


def test_engaging_a_behaviour_clears_the_fault(loop: ControlLoop) -> None:
    loop.abandon(Fault("a test"))
    loop.engage(Damped())
    assert loop.fault is None


def test_a_part_that_is_found_sound_after_all_is_no_longer_told(
    loop: ControlLoop, monkeypatch: pytest.MonkeyPatch
) -> None:
    dead = PartFault("RR_foot", "feels nothing", True, 0.0)
    for faults in ((dead,), (replace(dead, part="FL_foot"),), ()):
        monkeypatch.setattr(StillPlant, "sensor_faults", faults)
        run(loop, 1)
        assert loop.health.faults == faults


def test_a_raised_foot_of_a_robot_that_has_sunk_is_not_held(
    plant: StillPlant, loop: ControlLoop, monkeypatch: pytest.MonkeyPatch
) -> None:
    held = np.array([3.0 * PULLED, 0.0, 0.0, 0.0])
    monkeypatch.setattr(StillPlant, "motors_obey", True)
    monkeypatch.setattr("controller.loop.hold_feet", lambda *asked: np.copyto(asked[3], held) or 99)
    forces = np.array([0.0, 50.0, 50.0, 50.0])
    plant.state = replace(plant.state, foot_forces=forces)
    loop.engage(Balance(loop.model))
    q = plant.state.q.copy()
    q[2] -= 1.2 * SUNK
    sound, plant.state = plant.state, replace(plant.state, q=q)
    run(loop, 20)
    assert loop.health.is_sound
    plant.state = replace(sound, time=plant.state.time)
    run(loop, 20)
    assert [fault.part for fault in loop.health.faults] == ["FL_foot"]


class Broken(WholeBodyController):
    """Solves nothing."""

    def solve(
        self, snapshot: Snapshot, reference: Reference, *, relax: bool = False
    ) -> WbcSolution:
        raise QpInfeasible("condensed", "asked for nothing that it can do")


@pytest.mark.parametrize("is_dynamic", [False, True])
def test_a_dynamic_behaviour_is_followed_with_the_numbers_for_one(
    plant: StillPlant, model: RobotModel, *, is_dynamic: bool
) -> None:
    config = WbcConfig()
    usual, broken = WholeBodyController(model), Broken(model, config=config.for_dynamics)
    loop = ControlLoop(plant, model, usual, Telemetry(model, 1000), SAFETY, broken)
    behaviour = Balance(model)
    behaviour.is_dynamic = is_dynamic
    loop.engage(behaviour)
    loop.tick()
    assert loop.telemetry.qp_failures == is_dynamic
