"""What objects say of themselves at the prompt."""

import copy
import pickle
from collections.abc import Iterator

import numpy as np
import pytest

import go2_wbc
import motions
from controller import GO2Controller
from controller.telemetry import SeenTerrain
from go2_wbc.brief import LONGEST
from go2_wbc.planning.height_map import HeightMap
from go2_wbc.plant.mujoco.lidar import LidarConfig
from go2_wbc.plant.terrain import Course
from go2_wbc.wbc.config import WbcConfig
from motions import Timeline, deg


@pytest.fixture(scope="module")
def go2() -> Iterator[GO2Controller]:
    with GO2Controller() as go2:
        go2.stand()
        yield go2


def test_no_public_value_fills_the_screen(go2: GO2Controller) -> None:
    seen = go2_wbc.MujocoPlant(terrain=Course.drawn(3), lidar=True, sensors="imu", seed=1)
    checker, timeline = motions.FeasibilityChecker(), motions.load_motion("wave")
    snapshot = checker.model.snapshot(go2.state)
    plan = motions.compile_timeline(timeline, checker.model)
    steep = Timeline(name="dive").body(pitch=deg(60), over=0.3).home(over=0.3)
    values = [
        *(go2, go2.plant, go2.state, go2.health, go2.last_outcome, go2.telemetry, go2.command),
        go2.explain(),
        *(go2.recording(), snapshot, snapshot.p_world_com, checker, checker.model, timeline, plan),
        *(plan.at(0.5), motions.check("wave"), motions.check(steep), checker.evaluate("wave")),
        *(*motions.check(steep).failures, motions.check("wave").series, go2_wbc.GAITS["trot"]),
        *(go2_wbc.Config(), WbcConfig(), go2_wbc.World(), go2_wbc.Recording, motions.Tolerance()),
        *(motions.find_motion("wave"), motions.suggest(steep), go2_wbc.JointCommand.damping(2.0)),
        *(Course.drawn(3), LidarConfig(), seen.scan(), seen.save(), seen.imu(), seen.contacts()),
        *(go2_wbc.WholeBodyController(checker.model), SeenTerrain(HeightMap(), "")),
    ]
    for value in [*values, *(part for owner in values for part in parts(owner))]:
        one = value[0] if isinstance(value, tuple) and type(value) is tuple else value
        assert len(repr(one)) <= LONGEST, repr(one)
        assert " object at 0x" not in repr(one)
        if not isinstance(one, go2_wbc.MujocoPlant | GO2Controller):
            assert repr(pickle.loads(pickle.dumps(one))) == repr(one)


def is_ours(value: object) -> bool:
    return type(value).__module__.partition(".")[0] in ("go2_wbc", "motions", "controller")


def parts(value: object) -> list[object]:
    """What of ours the public attributes of a value of ours are."""
    names = [name for name in dir(value) if is_ours(value) and not name.startswith("_")]
    return [part for name in names if is_ours(part := getattr(value, name))]


def test_a_line_says_what_matters(go2: GO2Controller) -> None:
    assert repr(motions.load_motion("wave")) == "Timeline('wave', 6.40 s, 18 moves, stand to stand)"
    assert "'wave', 6.4 s, chance" in repr(motions.check("wave"))
    steep = motions.check(Timeline(name="dive").body(pitch=deg(60), over=0.3).home(over=0.3))
    more = len(steep.failures) - 1
    assert steep.summary() == f"no   dive            {steep.failures[0]}; {more} more limits"
    assert "standing, MujocoPlant" in repr(go2)
    assert "samples" in repr(go2.recording())
    changed = go2_wbc.Config(wbc=WbcConfig(friction=0.5))
    assert repr(changed) == "Config(wbc=WbcConfig(friction=0.5))"
    assert repr(np.ones(3)) not in repr(go2.state)


def test_the_state_is_read_only_and_still_good_for_the_model(go2: GO2Controller) -> None:
    with pytest.raises(ValueError, match="read-only"):
        go2.state.q[0] = 9.0
    assert abs(go2.plant.read().q[0]) < 0.1
    motions.FeasibilityChecker().model.snapshot(go2.state)


def test_what_a_process_pool_needs_is_pickled_and_the_rest_says_why_not(go2: GO2Controller) -> None:
    for value in (motions.find_motion("wave"), motions.load_motion("wave"), go2.recording()):
        assert repr(pickle.loads(pickle.dumps(value))) == repr(value)

    @motions.motion
    def mine() -> Timeline:
        return Timeline().hold(1.0)

    with pytest.raises(pickle.PicklingError, match=r"'mine' is not found as .* in module"):
        pickle.dumps(mine)
    with pytest.raises(TypeError, match="make one in each process"):
        pickle.dumps(go2)
    with pytest.raises(TypeError, match="make one in each process"):
        copy.deepcopy(go2.plant)
