"""Planner, estimator, watches and whole-body controller say, tick by tick, what they once said.

What they are given is made here, and depends on nothing that a simulator does.
"""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from go2_wbc.config import Config, override
from go2_wbc.contacts import GAITS, Gait
from go2_wbc.errors import Go2WbcError, QpInfeasible
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand
from go2_wbc.planning.envelopes import GaitChoice
from go2_wbc.planning.locomotion import LocomotionConfig, LocomotionPlanner
from go2_wbc.planning.trunk import LEVEL, BodyPose
from go2_wbc.plant.faults import FaultKind, Faults, InjectedFault
from go2_wbc.plant.sensors import ImuSample, Proprioception, SensorErrors, SensorNoise
from go2_wbc.plant.terrain import (
    BOTH,
    DOWN,
    Blocks,
    Boxes,
    Course,
    Gap,
    Patch,
    Ramp,
    Slope,
    Stairs,
    Stones,
    Terrain,
    Waves,
)
from go2_wbc.reference import LegTask, Reference
from go2_wbc.robot.estimator import EstimatorConfig, SensorReading, StateEstimator
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import JointFriction
from go2_wbc.robot.payload_estimation import PayloadConfig, PayloadEstimator
from go2_wbc.robot.rigid_body import NO_PAYLOAD
from go2_wbc.robot.rotations import quaternion_from_rpy, rpy_from_rotation
from go2_wbc.robot.state import RobotState, Snapshot
from tests.engine_helpers import fast_cases, standing_q, state_of
from tests.go2_wbc.planning.seen import exact_map
from tests.go2_wbc.planning.test_plain import AT_ONCE, SWIFT, TICK, stumbling
from tests.go2_wbc.wbc.situations import KINDS, PLAIN, situations
from tests.recorded import assert_as_recorded

FILE = Path(__file__).with_name("recorded.json")
TICKS, CHUNK = 600, 60
MODEL = RobotModel()
EASY = LocomotionConfig()
WALKS: dict[str, tuple[Gait, LocomotionConfig, Terrain | None]] = {
    **{name: (gait, EASY, None) for name, gait in GAITS.items()},
    "swift": (GAITS["trot"], SWIFT, None),
    "at once": (AT_ONCE, SWIFT, None),
    "up stairs": (GAITS["trot"], EASY, Stairs(0.12, 3, 0.31, start=0.3)),
    "blocks": (GAITS["trot"], EASY, Blocks(0.1, start=0.2)),
    "waves": (GAITS["walk"], EASY, Waves(0.08, start=0.2)),
    "slope": (GAITS["trot"], EASY, Slope(0.2)),
}


def following(reference: Reference, rng: np.random.Generator, tick: int) -> RobotState:
    """A robot that does nearly what it is told; a foot now and then comes down early or late."""
    body, R, q, v = reference.body, reference.body.R_world_base, standing_q(), np.zeros(18)
    q[:3] = body.p_world + rng.normal(scale=0.004, size=3)
    q[3:7] = quaternion_from_rpy(*rpy_from_rotation(R) + rng.normal(scale=0.01, size=3))
    q[7:] += 0.15 * np.sin(0.03 * tick + np.arange(12))
    v[:3], v[3:6] = R.T @ body.v_world, R.T @ body.w_world
    v += rng.normal(scale=0.03, size=18)
    touches = np.array([task is LegTask.STANCE for task in reference.legs])
    touches ^= np.random.default_rng(tick // 12).random(4) < 0.15
    tau = rng.normal(scale=6.0, size=12)
    forces = np.where(touches, 40.0, 0.0) + rng.normal(size=4)
    return RobotState(tick * TICK, q, v, tau, forces, touches)


def walked(name: str, *, wild: bool) -> Iterator[tuple[LocomotionPlanner, Snapshot, Reference]]:
    """A planner's ticks, with a robot that follows it or one that is thrown about."""
    gait, config, terrain = WALKS[name]
    rng = np.random.default_rng(8)
    heights = None if terrain is None else exact_map(terrain, -1.5, 1.5, 0.8)
    planner = LocomotionPlanner(MODEL, gait, config, heights)
    now = MODEL.snapshot(state_of(standing_q()))
    planner.start(now)
    reference, command, pose = None, ZERO_COMMAND, LEVEL
    for tick in range(1, TICKS + 1):
        if tick % 100 == 1:
            command = VelocityCommand(*(rng.normal(size=3) if wild else rng.uniform(-0.2, 0.7, 3)))
            command = ZERO_COMMAND if tick % 300 > 200 else command
            pose = BodyPose(*rng.uniform(-0.1, 0.1, 4)) if tick % 200 == 1 else LEVEL
        if wild:
            at = np.zeros(2) if reference is None else reference.body.p_world[:2]
            now = stumbling(MODEL, rng, tick, at)
        elif reference is not None:
            now = MODEL.snapshot(following(reference, rng, tick))
        reference = planner.update(now, command, pose)
        yield planner, now, reference


def kept(rows: dict[str, list[Any]]) -> dict[str, Any]:
    """Each by some ticks at a time."""
    return {
        f"{name} {start}": np.concatenate([np.ravel(row) for row in each[start : start + CHUNK]])
        for name, each in rows.items()
        for start in range(0, len(each), CHUNK)
    }


@pytest.mark.parametrize("wild", [False, True], ids=["calm", "wild"])
@pytest.mark.parametrize("name", WALKS)
def test_plans_are_those_recorded(name: str, wild: bool) -> None:
    rows = defaultdict[str, list[Any]](list)
    for planner, _, reference in walked(name, wild=wild):
        rows["target"].append(reference.row)
        rows["planner"].append(planner._state.row)
    assert_as_recorded(FILE, f"plan {name} {'wild' if wild else 'calm'}", kept(rows))


def sensed(now: Snapshot, rng: np.random.Generator) -> SensorReading:
    """What a robot senses in such a state, with noise."""
    state, force = now.state, now.R_world_base.T @ np.array([0.0, 0.0, MODEL.gravity])
    gyro, felt = (part + rng.normal(scale=0.02, size=3) for part in (state.v[3:6], force))
    q, v = state.q[7:] + 1e-4 * rng.normal(size=12), state.v[6:]
    forces = np.where(state.feet_in_contact, 40.0, 1.0) + rng.normal(size=4)
    return SensorReading(state.time, gyro, felt, q, v, state.tau, forces)


SENSED: dict[str, tuple[tuple[str, str, float | None], ...]] = {
    "sound": (),
    "gyro": ((FaultKind.GYRO, "y", 0.4),),
    "accelerometer": ((FaultKind.ACCELEROMETER, "z", 3.0),),
    "encoder": ((FaultKind.ENCODER, "FR_calf_joint", 0.2),),
    "stuck": ((FaultKind.ENCODER_STUCK, "RL_thigh_joint", None),),
    "foot": ((FaultKind.FOOT_FORCE, "RR_foot", 80.0),),
    "no number": ((FaultKind.NOT_A_NUMBER, "FL_hip_joint", None),),
    "several": ((FaultKind.GYRO, "", None), (FaultKind.ENCODER, "FL_hip_joint", -0.1)),
}


@pytest.mark.parametrize("wild", [False, True], ids=["calm", "wild"])
@pytest.mark.parametrize("broken", SENSED)
def test_states_and_broken_parts_are_those_recorded(broken: str, wild: bool) -> None:
    faults, rows = Faults(MODEL.description), defaultdict[str, list[Any]](list)
    faults.known = tuple(InjectedFault.of(k, part, 0.4, value) for k, part, value in SENSED[broken])
    estimator = StateEstimator(MODEL, EstimatorConfig())
    rng = np.random.default_rng(3)
    for _, now, _ in walked("trot", wild=wild):
        state = estimator.update(faults.broken(sensed(now, rng)))
        rows["state"].append([*state.q, *state.v, *state.foot_forces, *state.feet_in_contact])
        rows["estimator"].append(estimator._state.row)
    assert estimator.watch is not None
    told = {"faults": "; ".join(map(str, estimator.watch.faults))}
    assert_as_recorded(FILE, f"sensed {broken} {'wild' if wild else 'calm'}", kept(rows) | told)


def test_what_is_carried_is_that_recorded() -> None:
    config = PayloadConfig(memory=0.05, most_rise=1e3, most_speed=(1e3, 1e3), least_height=0.01)
    estimator = PayloadEstimator(MODEL, JointFriction.none(), config)
    rows, payload = defaultdict[str, list[Any]](list), NO_PAYLOAD
    for _, now, _ in walked("trot", wild=False):
        payload = estimator.update(MODEL.snapshot(now.state, payload))
        rows["felt"].append([*estimator.felt, payload.mass, *payload.place])
    assert_as_recorded(FILE, "carried", kept(rows))


def test_tight_ticks_are_solved_and_explained_as_recorded() -> None:
    for kind in KINDS:
        told: dict[str, Any] = {}
        for index, one in enumerate(situations(kind, 3, seed=5)):
            found = one.wbc.explain(one.snapshot, one.reference)
            told[f"{index}"] = f"{found}\n{found!r}\n{found.table()}"
            try:
                solution = one.wbc.solve(one.snapshot, one.reference)
            except QpInfeasible as error:
                told[f"{index} error"] = str(error)
                continue
            told[f"{index} tau"] = [*solution.tau, *solution.qdd, *np.ravel(solution.forces)]
        assert_as_recorded(FILE, f"explained {kind.__name__}", told)


def test_fast_ticks_are_solved_as_recorded() -> None:
    solved = [PLAIN.solve(*case) for case in fast_cases(MODEL, 30, seed=4)]
    rows = {"tau": [one.tau for one in solved], "forces": [one.forces for one in solved]}
    assert_as_recorded(FILE, "fast", kept(rows))


TERRAINS: tuple[Terrain, ...] = (
    *(Boxes(), Boxes(0.1, 0.3, 7, 2.0, 0.4, seed=3), Stairs(), Stairs(0.1, 3, 0.31, 0.5, DOWN)),
    *(Stairs(0.1, 2, way=BOTH, landing=1.3), Stairs(is_open=True), Blocks(), Blocks(0.2, 0.5, 0.3)),
    *(Slope(0.2), Ramp(0.2), Ramp(0.1, 0.7, 0.4), Waves(), Waves(0.1, 0.7, 2, 0.3)),
    *(Stones(), Stones(0.2, 0.15, 4, 0.3, 0.03, 5), Gap(), Gap(0.3, 0.5, 0.4), Patch()),
    *(Course((Ramp(0.2), Gap(0.2), Blocks(0.1))), *map(Course.drawn, range(6))),
)


def test_terrains_are_those_recorded() -> None:
    told = dict[str, Any]()
    for index, one in enumerate(TERRAINS):
        blocks = [(*fields_of(block),) for block in one.blocks()]
        told[f"{index} {type(one).__name__}"] = [x for block in blocks for x in block]
        ends = [one.floor_height, one.floor_pitch, getattr(one, "end", 0.0)]
        told[f"{index} whole"] = [*ends, *np.ravel(one.pits)]
    assert_as_recorded(FILE, "terrains", told)


def fields_of(value: Any) -> Iterator[float]:  # noqa: ANN401 - a number, an array or a record of them
    """All numbers of a value."""
    if is_dataclass(value):
        for field in fields(value):
            yield from fields_of(getattr(value, field.name))
    elif not isinstance(value, str) and value is not None:
        yield from np.asarray(value, dtype=float).ravel().tolist()


def test_what_errs_senses_as_recorded() -> None:
    rng = np.random.default_rng(4)
    for name, errors in {"usual": SensorErrors(), "late": SensorErrors(latency=0.008)}.items():
        sense = Proprioception(errors, MODEL, TICK, np.random.default_rng(1))
        rows = defaultdict[str, list[Any]](list)
        for _, now, _ in walked("trot", wild=False):
            imu = ImuSample(now.state.q[3:7], now.state.v[3:6], rng.normal(size=3) + [0, 0, 9.8])
            state, felt = sense.sense(now.state, imu)
            rows["state"].append([*state.q, *state.v, *state.foot_forces])
            np.testing.assert_array_equal(felt.quaternion, state.q[3:7])
            rows["imu"].append([*felt.gyro, *felt.accelerometer])
            rows["noisy"].append(SensorNoise().corrupt_state(now.state, rng).q)
        assert_as_recorded(FILE, f"senses {name}", kept(rows))


def test_gaits_are_chosen_as_recorded() -> None:
    choice, rng, told = GaitChoice(None), np.random.default_rng(6), list[str]()
    for tick in range(400):
        v = np.abs(np.sin(tick / 60.0)) * np.array([2.2, 0.4, 0.8]) + rng.normal(scale=0.05, size=3)
        gait, slower = choice.update(0.05 * tick, v, VelocityCommand(*(1.1 * v)))
        told.append(f"{gait.name} {slower}")
    assert_as_recorded(FILE, "gaits", {"told": "\n".join(told), "envelope": repr(choice.envelope)})


@pytest.mark.filterwarnings("ignore::FutureWarning")  # of keys that have no effect any more
def test_wrong_keys_of_files_are_refused_in_the_words_recorded() -> None:
    def refused(part: object, place: tuple[str, ...]) -> Iterator[str]:
        for name in part.__dataclass_fields__:  # type: ignore[attr-defined]
            value = getattr(part, name)
            if hasattr(value, "__dataclass_fields__"):
                yield from refused(value, (*place, name))
            if isinstance(value, str):  # what is valid depends on what is installed
                continue
            for wrong in ("x", True, 3, -1.0, [1.0], [1.0, 2.0, "x"], float("inf"), {}, {"y": 1}):
                table: Any = {name: wrong}
                for key in reversed(place):
                    table = {key: table}
                try:
                    override(Config(), table, "file")
                except Go2WbcError as error:
                    yield str(error)
                else:
                    yield f"{place} {name} {wrong}"

    assert_as_recorded(FILE, "config", {"refused": "\n".join(refused(Config(), ()))})
