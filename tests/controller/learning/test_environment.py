"""Gymnasium's environments: valid by its own checker, reproducible, in physical units."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason='needs pip install "go2-wbc[learning]"')

import gymnasium
from gymnasium.utils.env_checker import check_env

from benchmarks.robots import menagerie_go2
from controller.learning import ENVIRONMENTS, TASKS, Go2Env, LearningTask
from controller.learning.tasks import WEIGHTS
from controller.observation import OBSERVATION, RATE, STANCE, TARGETS, TORQUES
from go2_wbc.errors import CommandError, ModelMismatch
from go2_wbc.robot.state import JointCommand
from tests.script_server import python

SETTLED = 0.03
"""Share of the reward that a robot misses that still sinks into its servos, at 6 cm/s."""
STAND = np.zeros(12, dtype=np.float32)
ANY = np.random.default_rng(0).uniform(-0.3, 0.3, (60, 12)).astype(np.float32)


def run(environment: Go2Env, seed: int, steps: int = 60) -> list[Any]:
    """All that an episode tells."""
    told: list[Any] = [environment.reset(seed=seed)]
    for action in ANY[:steps]:
        told.append(environment.step(action))
        if told[-1][2]:
            break
    return told


def stood(environment: Go2Env, steps: int) -> Any:  # noqa: ANN401
    """What the last step tells of a robot that does nothing until then, or until its end."""
    step = environment.step(STAND)
    for _ in range(steps - 1):
        if step[2] or step[3]:
            break
        step = environment.step(STAND)
    return step


def test_another_authors_file_is_an_environment_like_any_other() -> None:
    file = menagerie_go2()
    check_env(gymnasium.make("Go2-v0", mjcf=file).unwrapped)
    environment, built = Go2Env("push", mjcf=file), Go2Env("push")
    first, again = (run(environment, seed=2) for _ in range(2))
    for own, other in zip(first, again, strict=True):
        assert np.array_equal(own[0], other[0])
    assert environment.plant.total_mass < built.plant.total_mass - 0.1
    assert not np.allclose(first[-1][0], run(built, seed=2)[-1][0])
    with pytest.raises(CommandError, match="'rough' has terrains, an mjcf brings its own ground"):
        Go2Env("rough", mjcf=file)
    with pytest.raises(ModelMismatch, match="no such file"):
        Go2Env(mjcf="nowhere.xml")


@pytest.mark.parametrize("kind", [TARGETS, TORQUES])
@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_gymnasium_finds_nothing_to_warn_of(name: str, kind: str) -> None:
    check_env(gymnasium.make(name, action=kind).unwrapped)


def test_they_are_registered_by_an_import_and_by_the_name_of_the_module() -> None:
    program = (
        "import gymnasium; env = gymnasium.make('controller.learning:Go2-v0'); "
        "print(env.observation_space.shape)"
    )
    done = python("-c", program)
    assert done.stdout.strip() == f"({OBSERVATION.size},)", done.stderr


def test_without_the_extra_the_room_opens_and_what_is_missing_is_named() -> None:
    program = """
import sys
sys.modules.update(gymnasium=None, pyarrow=None)
import controller.learning as learning
print(learning.OBSERVATION.size)
for use in (lambda: learning.Go2Env(), lambda: learning.record("walk.parquet")):
    try:
        use()
    except Exception as error:
        print(type(error).__name__, error)
"""
    done = python("-c", program)
    size, *told = done.stdout.splitlines()
    assert int(size) == OBSERVATION.size, done.stderr
    assert len(told) == 2
    for line in told:
        assert line.startswith("MissingDependency")
        assert "go2-wbc[learning]" in line


@pytest.mark.parametrize("name", TASKS)
def test_a_seed_gives_the_same_bits_whatever_was_before(name: str) -> None:
    fresh, used = Go2Env(name, sensors="noisy"), Go2Env(name, sensors="noisy")
    for seed in (3, 8, 1):
        run(used, seed, 30)
    for seed in (7, 8):
        first, second = run(fresh, seed), run(used, seed)
        assert np.array_equal(first[0][0], second[0][0])
        assert len(first) == len(second)
        for one, other in zip(first[1:], second[1:], strict=True):
            assert np.array_equal(one[0], other[0])
            assert one[1:4] == other[1:4]
    assert not np.array_equal(run(fresh, 7)[-1][0], run(fresh, 8)[-1][0])


def test_noise_is_drawn_from_the_seed_too() -> None:
    environment = Go2Env(terms=("joint_positions",), sensors="noisy", randomise=False)
    first, second = (environment.reset(seed=seed)[0] for seed in (1, 2))
    assert (first != second).all()


def test_a_seed_draws_the_world_within_the_spread_of_the_task() -> None:
    environment, worlds = Go2Env("rough"), []
    for seed in range(30):
        _, info = environment.reset(seed=seed)
        worlds.append(list(info["world"].values()) + [info["terrain"]])
        assert environment.plant.model.geom("FL_foot").friction[0] == info["world"]["friction"]
    least, most = np.min(worlds, axis=0), np.max(worlds, axis=0)
    assert (least[:4] >= [0.5, 0.9, 0.5, 0.0]).all()
    assert (most[:4] <= [1.0, 1.1, 1.5, 0.01]).all()
    assert (most[:4] - least[:4] > [0.3, 0.1, 0.6, 0.006]).all()
    assert set(np.array(worlds)[:, 4]) == set(range(len(TASKS["rough"].terrains)))
    exact = Go2Env("rough", randomise=False)
    assert exact.reset(seed=1)[1]["world"] == exact.reset(seed=2)[1]["world"]


def test_the_observation_is_what_the_plant_tells() -> None:
    environment = Go2Env(randomise=False)
    environment.reset(seed=0, options={"command": (0.4, 0.1, -0.2)})
    seen = [environment.step(action)[0] for action in ANY[:5]][-1]
    terms, state = OBSERVATION.split(seen), environment.plant.truth()
    assert terms["command"] == pytest.approx([0.4, 0.1, -0.2], abs=1e-6)
    assert terms["joint_positions"] == pytest.approx(state.joint_positions, abs=1e-6)
    assert terms["linear_velocity"] == pytest.approx(state.v[:3], abs=1e-6)
    assert np.array_equal(terms["last_action"], ANY[4])
    assert state.time == pytest.approx(5 / RATE)
    few = Go2Env(terms=("gravity", "command"))
    assert few.reset(seed=0)[0].shape == few.observation_space.shape == (6,)


def test_targets_are_pursued_by_a_servo_in_every_physics_step() -> None:
    environment = Go2Env(randomise=False, kp=30.0, kd=0.7)
    environment.reset(seed=0)
    saved = environment.plant.save()
    environment.step(ANY[0])
    q = environment.plant.truth().q
    environment.plant.restore(saved)
    targets = np.tile(STANCE, 4) + ANY[0]
    environment.plant.write(JointCommand.servo(targets, np.zeros(12), 30.0, 0.7))
    assert q == pytest.approx(environment.plant.truth().q, abs=1e-12)


def test_torques_are_shares_of_the_limits() -> None:
    environment = Go2Env(action=TORQUES, randomise=False)
    environment.reset(seed=0)
    environment.step(np.full(12, 0.1, dtype=np.float32))
    tau = environment.plant.truth().tau
    assert tau == pytest.approx(0.1 * environment.plant.torque_limits, rel=1e-6)


def test_the_reward_is_the_sum_of_its_terms_in_info() -> None:
    environment = Go2Env(randomise=False)
    environment.reset(seed=0, options={"command": (0.0, 0.0, 0.0)})
    _, reward, has_fallen, _, info = stood(environment, 50)
    gains = info["reward_terms"]
    assert gains.keys() == WEIGHTS.keys()
    assert reward == pytest.approx(sum(gains.values()))
    assert gains["velocity"] == pytest.approx(WEIGHTS["velocity"] / RATE, rel=SETTLED)
    assert gains["turn"] == pytest.approx(WEIGHTS["turn"] / RATE, rel=SETTLED)
    assert gains["fall"] == gains["knock"] == gains["change"] == 0.0
    assert gains["effort"] < 0.0
    assert not has_fallen
    own = replace(TASKS["velocity"], weights={"turn": 2.0})
    other = Go2Env(own, randomise=False)
    other.reset(seed=0, options={"command": (0.0, 0.0, 1.0)})
    *_, info = other.step(STAND)
    assert info["reward_terms"]["turn"] == pytest.approx(
        2.0 / RATE * math.exp(-((1.0 - other.plant.truth().v[5]) ** 2) / 0.25)
    )


def test_a_fall_terminates_and_the_time_limit_truncates() -> None:
    limp = Go2Env(action=TORQUES, randomise=False)
    limp.reset(seed=0)
    _, _, has_fallen, is_late, info = stood(limp, 100)
    assert has_fallen
    assert not is_late
    assert info["reward_terms"]["fall"] == pytest.approx(-WEIGHTS["fall"])
    with pytest.raises(CommandError, match="reset"):
        limp.step(STAND)
    short = Go2Env(episode_time=0.1)
    short.reset(seed=0)
    ends = [short.step(STAND)[2:4] for _ in range(5)]
    assert ends == [(False, False)] * 4 + [(False, True)]


def test_a_shove_moves_the_robot_aside_in_the_push_task_only() -> None:
    speeds = {}
    for name in ("velocity", "push"):
        environment = Go2Env(name)
        environment.reset(seed=4)
        seen = [OBSERVATION.split(environment.step(STAND)[0]) for _ in range(300)]
        speeds[name] = max(float(np.abs(terms["linear_velocity"][:2]).max()) for terms in seen[30:])
    assert speeds["velocity"] < 0.2
    assert speeds["push"] > 0.3


def test_the_command_is_drawn_anew_or_kept_as_asked() -> None:
    environment, drawn = Go2Env(), set()
    environment.reset(seed=2)
    for _ in range(600):
        environment.step(STAND)
        drawn.add(tuple(environment.command))
    assert len(drawn) == 3
    environment.reset(seed=2, options={"command": (0.3, 0.0, 0.1)})
    for _ in range(300):
        environment.step(STAND)
    assert tuple(environment.command) == (0.3, 0.0, 0.1)


def test_frames_show_the_robot_and_its_ground() -> None:
    pictures = []
    for name in ("velocity", "rough"):
        environment = Go2Env(name, render_mode="rgb_array")
        environment.reset(seed=3)
        pictures.append(environment.render())
        assert pictures[-1].shape == (320, 480, 3)
        assert pictures[-1].dtype == np.uint8
        assert pictures[-1].std() > 10.0
    assert Go2Env().render() is None
    assert not np.array_equal(*pictures)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"task": "swim"}, "velocity"),
        ({"action": "speeds"}, "torques"),
        ({"sensors": "imu"}, "noisy"),
        ({"render_mode": "human"}, "rgb_array"),
        ({"terms": ("height",)}, "gravity"),
        ({"episode_time": 0.0}, "positive"),
        ({"kp": -1.0}, "positive"),
    ],
)
def test_wrong_settings_are_named(settings: dict[str, Any], told: str) -> None:
    with pytest.raises(CommandError, match=told):
        Go2Env(**settings)


def test_wrong_options_actions_and_weights_are_named() -> None:
    with pytest.raises(CommandError, match="bounce"):
        LearningTask("own", weights={"bouncing": 1.0})
    environment = Go2Env()
    commands = [(1.0,), (math.nan, 0.0, 0.0), "fast"]
    for options in ({"speed": 1.0}, *({"command": command} for command in commands)):
        with pytest.raises(CommandError, match="command"):
            environment.reset(options=options)
    environment.reset(seed=0)
    for action in (np.zeros(3), np.full(12, np.nan), np.array(12 * ["ahead"])):
        with pytest.raises(CommandError, match="an action is 12 finite numbers, got"):
            environment.step(action)
    assert not environment.step(np.full(12, 1e300))[2]  # it is clipped, without a warning
