"""A TOML file overrides what it names, and everything that is wrong in it is named."""

from contextlib import closing
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from controller import GO2Controller
from go2_wbc.config import Config, load_config, override
from go2_wbc.errors import ConfigError, MotionInfeasible
from go2_wbc.planning.command import VelocityEnvelope
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.state import JointCommand
from tests.controller.plants import StillPlant


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_overrides_the_half_of_a_table_that_it_names_and_an_empty_one_nothing(
    tmp_path: Path,
) -> None:
    assert load_config(written(tmp_path, "")) == Config()
    config = load_config(written(tmp_path, "\ufeff[wbc.swing_foot]\nkp = [1, 2, 3]"))
    assert config.wbc.swing_foot.kp == (1.0, 2.0, 3.0)
    assert config.wbc.swing_foot.kd == Config().wbc.swing_foot.kd


def test_a_file_overrides_what_it_names_and_nothing_else(tmp_path: Path) -> None:
    text = """
    backend = "full"
    motor = "ideal"
    [locomotion]
    height = 0.27
    [wbc]
    solver = "proxqp"
    swing_foot = { kp = [400, 401, 402.5], kd = [35, 35, 35] }
    [safety]
    qp_patience = 3
    """
    config, default = load_config(written(tmp_path, text)), Config()
    assert config.backend == "full"
    assert (config.motor, default.motor) == ("ideal", "torque-speed")
    assert config.locomotion.height == 0.27
    assert config.wbc.solver == "proxqp"
    assert config.wbc.swing_foot.kp == (400.0, 401.0, 402.5)
    assert all(type(gain) is float for gain in config.wbc.swing_foot.kp)
    assert config.safety.qp_patience == 3
    assert config.envelope is default.envelope is None
    assert config.wbc.body_position == default.wbc.body_position
    assert config.locomotion.swing == default.locomotion.swing


def test_an_envelope_that_is_not_configured_is_the_careful_one_beside_hardware(
    tmp_path: Path,
) -> None:
    none = load_config(written(tmp_path, ""))
    assert none.beside_hardware.envelope == VelocityEnvelope()
    some = load_config(written(tmp_path, "[envelope]\nforward = 2"))
    assert some.envelope == VelocityEnvelope(forward=2.0)
    assert some.beside_hardware == some


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[locomotion.mpc]\nenabled = false", r"MpcConfig.enabled .*every gait are planned ahead"),
        ("[locomotion]\nload_ramp = 0.02", r"load_ramp .*LocomotionConfig\.mpc\.load_ramp counts"),
        ("[locomotion.mpc]\nstep = 0.05", r"MpcConfig\.step .*: it is always 0\.03"),
        ("[locomotion.rough]\nleash = 0.05", r"RoughConfig\.leash .*: it is always 0\.04"),
        ("[feasibility]\nend_speed = 0.2", r"FeasibilityLimits\.end_speed .*: it is always 0\.1"),
        ("[locomotion.slip]\nmost = 0.9", r"LocomotionConfig\.slip .*, most=0\.6, half_speed=0\.5"),
    ],
)
def test_a_retired_key_warns_and_changes_nothing(tmp_path: Path, text: str, message: str) -> None:
    with pytest.warns(FutureWarning, match=message):
        assert load_config(written(tmp_path, text)) == Config()


def test_a_retired_key_that_asks_for_what_there_is_is_taken(tmp_path: Path) -> None:
    text = "[locomotion]\nload_ramp = 0.03\nmpc = { enabled = true }"
    assert load_config(written(tmp_path, text)) == Config()
    with pytest.raises(ConfigError, match=r"mpc: enabled must be of type bool, got 1"):
        load_config(written(tmp_path, "[locomotion.mpc]\nenabled = 1"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "speed = 1",
            r"unknown key 'speed'; valid: backend, envelope, estimator, feasibility, locomotion,"
            " motor, payload, pose, robot, safety, wbc",
        ),
        ("[wbc]\nsolvr = 'daqp'", r"mine\.toml: wbc: unknown key 'solvr'; valid: .*solver"),
        ("[wbc.swing_foot]\nki = [1, 1, 1]", r"wbc: swing_foot: unknown key 'ki'; valid: kd, kp"),
        ("wbc = 3", r"wbc must be a table, got 3"),
        ("[locomotion]\nheight = 'low'", r"locomotion: height must be a finite number, got 'low'"),
        ("[estimator]\nforce = 9", r"estimator: unknown key 'force'; valid: .*contact_force"),
        ("[locomotion.ground]\nsteep = 1", r"ground: unknown key 'steep'; valid: .*follow"),
        ("[safety]\nqp_patience = 2.5", r"qp_patience must be of type int, got 2\.5"),
        ("backend = 1", r"backend must be of type str, got 1"),
        ("[wbc.swing_foot]\nkp = [1, 2]", r"kp must be a list of 3 numbers, got \[1, 2\]"),
        ("[wbc.swing_foot]\nkp = [1, 'a', 3]", r"kp must be a finite number, got 'a'"),
        ("[envelope]\nforward = 0", "VelocityEnvelope.forward must be positive, got 0.0"),
        ("motor = 'perfect'", "unknown motor 'perfect'; valid: ideal, torque-speed"),
        ("[wbc]\nfriction = -0.6", "WbcConfig.friction must be between 0.0001 and 2, got -0.6"),
        ("[wbc]\ntorque_share = 1.5", "WbcConfig.torque_share must be above 0 and at most 1"),
        ("[wbc]\nswing_weight = -1", "swing_weight must be between 0.001 and 1000, got -1.0"),
        ("[wbc.swing_foot]\nkp = [1, -1, 1]", r"kp must be between 0 and 1e\+06, got \(1.0, -1.0"),
        ("[locomotion]\nheight = 0", "LocomotionConfig.height must be positive"),
        ("[locomotion]\nnormal_force_max = 1\nnormal_force_min = 2", "must be below"),
        ("[locomotion.swing]\napex = 0", "SwingConfig.apex must be positive"),
        ("[estimator]\nslip = 0", "EstimatorConfig.slip must be positive, got 0.0"),
        ("[estimator]\ncontact_force = 30", "contact_force"),
        ("[feasibility]\njolt = -1", "FeasibilityLimits.jolt must be positive, got -1.0"),
        ("[safety]\nqp_patience = 0", "SafetyConfig.qp_patience must be positive, got 0"),
    ],
)
def test_a_wrong_key_or_value_is_refused_by_its_name(
    tmp_path: Path, text: str, message: str
) -> None:
    with pytest.raises(ConfigError, match=message):
        load_config(written(tmp_path, text))


def test_a_file_that_is_no_text_no_toml_or_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"mine\.toml is not valid TOML: .*line 1"):
        load_config(written(tmp_path, "height = = 3"))
    path = tmp_path / "mine.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match=r"mine\.toml is not valid TOML"):
        load_config(path)
    with pytest.raises(ConfigError, match=r"cannot read .*gone\.toml: No such file"):
        load_config(tmp_path / "gone.toml")
    with pytest.raises(ConfigError, match=r"cannot read .*: Is a directory"):
        load_config(tmp_path)


def test_what_a_motion_must_keep_and_how_the_state_is_estimated_is_set_by_a_file(
    tmp_path: Path,
) -> None:
    text = "[estimator]\nstill_time = 0.02\n[feasibility]\ntorque_share = 0.01"
    config = load_config(written(tmp_path, text))
    with (
        GO2Controller(plant=StillPlant(), config=config) as go2,
        pytest.raises(MotionInfeasible, match="torque"),
    ):
        go2.prepare("nod")
    kept = {}
    for estimator in (None, config.estimator):
        with closing(MujocoPlant(sensors="imu", estimator=estimator)) as plant:
            for _ in range(60):
                plant.write(JointCommand.damping(1.0))
            kept[estimator] = plant.read().q
    assert not np.array_equal(*kept.values())


def test_what_is_overridden_may_be_every_part_and_leaves_the_original_alone() -> None:
    original = Config()
    changed = override(original, {"safety": {"tilt_limit": 0.5}}, where="a test")
    assert changed.safety.tilt_limit == 0.5
    assert original == Config()
    for part in fields(Config):
        value = getattr(Config(), part.name)
        if not isinstance(value, str):
            usual = Config().beside_hardware if value is None else Config()
            assert override(Config(), {part.name: {}}, where="a test") == usual


def test_a_controller_takes_a_file_a_path_or_a_config(tmp_path: Path) -> None:
    path = written(tmp_path, "[envelope]\nforward = 0.5")
    for config in (path, str(path), load_config(path)):
        GO2Controller(plant=StillPlant(), config=config).close()
    with pytest.raises(ConfigError, match=r"gone\.toml"):
        GO2Controller(plant=StillPlant(), config=tmp_path / "gone.toml")


def test_a_margin_that_leaves_the_joints_no_range_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="joint_margin leaves no range"):
        GO2Controller(plant=StillPlant(), config=written(tmp_path, "[wbc]\njoint_margin = 1.0"))
