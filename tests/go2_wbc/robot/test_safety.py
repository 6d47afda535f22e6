"""What is no state, and what is a fall: tilt at once, a trunk too low or aslant after a while."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.description import BASE_LINK, find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.safety import FallDetector, SafetyConfig, heights, is_plausible
from go2_wbc.robot.state import Snapshot
from tests.compiled import assert_plain_is_compiled
from tests.engine_helpers import random_state, standing_q, state_of

TRUNK_UNDERSIDE = find_profile().underside_points
FOOT_RADIUS = find_profile().foot_radius

# m; how closely few points can stand for the mesh of the trunk.
POINT_TOLERANCE = 0.01
TICK = 0.01
FOLDED_LEG = (0.0, 1.36, -2.72)  # rad; the foot is 89 mm below the hip
NEARLY_FOLDED_LEG = (0.0, 1.31, -2.64)  # rad; 20 mm more below the trunk


MODEL = RobotModel()


@pytest.fixture
def falls() -> FallDetector:
    return FallDetector(SafetyConfig())


def standing(model: RobotModel, time: float = 0.0) -> Snapshot:
    return model.snapshot(state_of(standing_q(), time=time))


def on_the_belly(
    model: RobotModel, time: float = 0.0, leg: tuple[float, float, float] = FOLDED_LEG
) -> Snapshot:
    """Legs folded so far that the trunk touches, but not below the limit of its height."""
    q = standing_q(0.11)
    q[7:] = np.tile(leg, 4)
    snapshot = model.snapshot(state_of(q, time=time))
    height = q[2] - snapshot.p_world_feet[:, 2].min()
    assert height > SafetyConfig().height_limit
    return snapshot


def tilted(model: RobotModel, angle: float) -> Snapshot:
    q = standing_q()
    q[3:7] = [np.sin(angle / 2), 0.0, 0.0, np.cos(angle / 2)]
    return model.snapshot(state_of(q))


def test_the_points_of_the_trunk_lie_where_its_mesh_does_however_it_is_tilted() -> None:
    plant = MujocoPlant()
    model, base = plant.model, plant.model.body(BASE_LINK).id
    is_mesh = model.geom_type == mujoco.mjtGeom.mjGEOM_MESH
    (geom, *_) = np.flatnonzero(is_mesh & (model.geom_bodyid == base) & (model.geom_contype > 0))
    mesh = model.geom_dataid[geom]
    rows = slice(model.mesh_vertadr[mesh], model.mesh_vertadr[mesh] + model.mesh_vertnum[mesh])
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, model.geom_quat[geom])
    vertices = model.mesh_vert[rows] @ R.reshape(3, 3).T + model.geom_pos[geom]
    rng = np.random.default_rng(1)
    for tilt, azimuth in zip(
        rng.uniform(0.0, SafetyConfig().tilt_limit, 500), rng.uniform(-np.pi, np.pi, 500),
        strict=True,
    ):  # fmt: skip
        z = [np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)]
        assert (TRUNK_UNDERSIDE @ z).min() == pytest.approx(
            (vertices @ z).min(), abs=POINT_TOLERANCE
        )


def clearance(snapshot: Snapshot, ground: float) -> float:
    """Height of the trunk's lowest point over flat ground."""
    R = snapshot.R_world_base
    return float((snapshot.q[2] + TRUNK_UNDERSIDE @ R[2]).min()) - ground


def test_heights_are_over_the_lowest_foot() -> None:
    rng = np.random.default_rng(11)
    for _ in range(50):
        snapshot = MODEL.snapshot(random_state(rng))
        lowest = float(snapshot.p_world_feet[:, 2].min())
        expected = (snapshot.q[2] - lowest, clearance(snapshot, lowest - FOOT_RADIUS))
        assert heights(snapshot, TRUNK_UNDERSIDE) == pytest.approx(expected, abs=1e-12)


def test_a_standing_robot_has_not_fallen(falls: FallDetector) -> None:
    snapshot = standing(MODEL)
    assert falls.reason(snapshot, 0.0, 0.0, may_lie=False) is None
    assert clearance(snapshot, 0.0) == pytest.approx(0.3 - 0.107, abs=1e-6)


CONFIG = SafetyConfig()


@pytest.mark.parametrize(
    ("lean", "may_lie", "limit", "degrees"),
    [
        (0.0, False, CONFIG.tilt_limit, 61),  # a motion rears by 59 deg
        (0.0, True, CONFIG.astray_tilt_limit, 58),
        (0.6 * CONFIG.lean_limit, False, CONFIG.astray_tilt_limit, 58),
    ],
)
def test_a_tilted_trunk_is_a_fall_at_once(
    falls: FallDetector, *, lean: float, may_lie: bool, limit: float, degrees: int
) -> None:
    assert falls.reason(tilted(MODEL, limit - 0.01), 0.0, lean, may_lie=may_lie) is None
    reason = falls.reason(tilted(MODEL, limit + 0.01), 0.0, lean, may_lie=may_lie)
    assert reason == f"fell at t=0.00 s: roll {degrees} deg, pitch 0 deg"


def test_a_tilt_limit_that_was_lowered_holds_for_a_robot_that_is_astray_too() -> None:
    config = SafetyConfig(tilt_limit=0.5)
    lean, snapshot = 0.6 * config.lean_limit, tilted(MODEL, 0.51)
    assert FallDetector(config).reason(snapshot, 0.0, lean, may_lie=False)


@pytest.mark.parametrize(("lean", "has_fallen"), [(0.0, False), (0.4, True)])
def test_a_robot_aslant_touches_the_ground_from_further_above(
    falls: FallDetector, *, lean: float, has_fallen: bool
) -> None:
    # Its nose lay on the ground, which feet that press into it and a degree put 1 to 2 cm below.
    snapshot, reason = standing(MODEL), None
    for time in (0.0, 0.09, 0.12):
        snapshot = on_the_belly(MODEL, time, NEARLY_FOLDED_LEG)
        reason = falls.reason(snapshot, 0.0, lean, may_lie=False)
    ground = snapshot.p_world_feet[:, 2].min() - MODEL.foot_radius
    assert 0.015 < clearance(snapshot, ground) < 0.025
    assert (reason is not None) is has_fallen


def test_touches_that_end_in_between_are_stumbles(falls: FallDetector) -> None:
    limit = SafetyConfig().touch_limit
    for time in np.arange(0.0, 1.0, 0.8 * limit).tolist():
        assert falls.reason(on_the_belly(MODEL, time), 0.0, 0.0, may_lie=False) is None
        assert falls.reason(standing(MODEL, time + 0.01), 0.0, 0.0, may_lie=False) is None


@pytest.mark.parametrize(
    ("touch", "sag", "lean", "falls_at"),
    [
        (1.0, 0.0, 0.0, 1.0 + SafetyConfig().touch_limit),  # it stays there
        (0.07, 0.1, 0.0, 1.1),
        (0.07, 0.0, 0.4, 1.1),
        (0.07, 0.05, 0.2, None),
        (0.04, 0.1, 0.4, None),
    ],
)
def test_a_trunk_on_the_ground_has_fallen_after_the_limit_unless_it_rises(
    falls: FallDetector, touch: float, sag: float, lean: float, falls_at: float | None
) -> None:
    # Thrown up by a push, it struck the ground for 0.06 s and was said to stand for 0.28 s.
    # A trot that withstood a hard push had grazed it.
    first = None
    for time in np.arange(1.0, 1.2, TICK).tolist():
        posture = on_the_belly if time < 1.0 + touch else standing
        reason = falls.reason(posture(MODEL, time), sag, lean, may_lie=False)
        first = time if reason and first is None else first
    assert first == (None if falls_at is None else pytest.approx(falls_at, abs=1.5 * TICK))


def test_where_the_belly_may_be_down_it_may_lie_for_ever(falls: FallDetector) -> None:
    for time in np.arange(0.0, 2.0, 0.1).tolist():
        assert falls.reason(on_the_belly(MODEL, time), 0.5, 0.0, may_lie=True) is None
    assert falls.reason(on_the_belly(MODEL, 2.0), 0.5, 0.0, may_lie=False) is None


@pytest.mark.parametrize(
    ("what", "told", "may_lie"),
    [
        ("sink", "13 cm below where it should be", False),
        ("lean", "tilted 30 deg from where it should be", False),
        ("lean", "tilted 30 deg from where it should be", True),
    ],
)
def test_a_trunk_that_is_off_where_it_should_be_is_a_fall_after_the_limit(
    falls: FallDetector, *, what: str, told: str, may_lie: bool
) -> None:
    limit, longest = (getattr(CONFIG, f"{what}_limit{end}") for end in ("", "_time"))

    def reason(time: float, off: float) -> str | None:
        sag, lean = (off, 0.0) if what == "sink" else (0.0, off)
        return falls.reason(standing(MODEL, time), sag, lean, may_lie=may_lie)

    much, just_less = limit + 0.01, limit - 0.01
    for time in np.arange(-1.0, 0.0, 0.1).tolist():
        assert reason(time, just_less) is None
    for time, off in ((0.0, much), (0.2, just_less), (0.3, much), (0.3 + longest, much)):
        assert reason(time, off) is None
    late = 0.31 + longest
    assert reason(late, much) == f"fell at t={late:.2f} s: trunk {told}"
    falls.begin()
    assert reason(late, much) is None


@pytest.mark.parametrize("name", [name for name in SafetyConfig.__slots__])
def test_a_limit_that_is_not_positive_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match=f"SafetyConfig.{name} must be positive"):
        replace(SafetyConfig(), **{name: 0})


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["q", "v", "tau", "foot_forces"])
def test_every_number_of_a_state_must_be_finite(name: str, bad: float) -> None:
    state = random_state(np.random.default_rng(12))
    for index in range(len(getattr(state, name))):
        values = getattr(state, name).copy()
        values[index] = bad
        broken = replace(state, **{name: values})
        rows = (broken.q, broken.v, broken.tau, broken.foot_forces)
        assert not is_plausible(*rows)
    assert is_plausible(state.q, state.v, state.tau, state.foot_forces)


def test_a_quaternion_must_be_of_length_one() -> None:
    state = random_state(np.random.default_rng(13))
    for factor, expected in ((0.985, False), (0.995, True), (1.005, True), (1.015, False)):
        q = state.q.copy()
        q[3:7] *= factor
        assert is_plausible(q, state.v, state.tau, state.foot_forces) is expected


def test_compiled_is_plain() -> None:
    state = random_state(np.random.default_rng(14))
    assert_plain_is_compiled(heights, MODEL.snapshot(state), TRUNK_UNDERSIDE)
    assert_plain_is_compiled(is_plausible, state.q, state.v, state.tau, state.foot_forces)
