"""The robot lies down once: later starts continue from what was kept, with the same bits."""

from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest

from go2_wbc.errors import PlantError
from go2_wbc.machine_code import CACHE_VARIABLE, kernel_folder
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco import setup as settling
from go2_wbc.robot.state import JointCommand

STEPS = 200


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache; the process's own one is used again afterwards."""
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    kernel_folder.cache_clear()
    yield tmp_path
    kernel_folder.cache_clear()


@pytest.fixture
def falls(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The mass of each robot that fell in simulation."""
    fallen, fall = [], settling._come_to_rest

    def counted(model: mujoco.MjModel, *others: object) -> None:
        fallen.append(float(model.body_mass.sum()))
        fall(model, *others)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(settling, "_come_to_rest", counted)
    return fallen


def driven(plant: MujocoPlant) -> bytes:
    """Every number of the simulation after a while of shaking."""
    states = []
    for step in range(STEPS):
        states.append(plant.read().q)
        plant.write(JointCommand.torque(5.0 * np.sin(0.1 * step + np.arange(12.0))))
    physics = np.empty(mujoco.mj_stateSize(plant.model, settling._STATE))
    mujoco.mj_getState(plant.model, plant.data, physics, settling._STATE)
    return np.concatenate([*states, physics]).tobytes()


def kept(folder: Path) -> list[Path]:
    return list(folder.rglob("lying/*"))


def test_a_robot_that_lay_down_before_moves_on_with_the_same_bits(
    folder: Path, falls: list[float]
) -> None:
    first, second = driven(MujocoPlant()), driven(MujocoPlant())
    assert len(falls) == len(kept(folder)) == 1
    assert second == first


def test_another_robot_falls_for_itself(folder: Path, falls: list[float]) -> None:
    MujocoPlant()
    MujocoPlant(payload=2.0)
    MujocoPlant(initial_yaw=1.0)
    MujocoPlant(initial_joint_noise=0.01, seed=1)
    MujocoPlant(initial_joint_noise=0.01, seed=2)
    assert len(falls) == len(kept(folder)) == 5


def test_what_mujoco_has_warned_of_is_not_kept(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fall = settling._come_to_rest

    def badly(model: mujoco.MjModel, data: mujoco.MjData, *others: object) -> None:
        fall(model, data, *others)  # pyright: ignore[reportArgumentType]
        data.warning[mujoco.mjtWarning.mjWARN_CNSTRFULL].number = 1

    monkeypatch.setattr(settling, "_come_to_rest", badly)
    with pytest.raises(PlantError, match="arena"):
        MujocoPlant()
    assert not kept(folder)


@pytest.mark.parametrize("damage", [b"", b"x" * 99, None])
def test_a_damaged_file_is_made_anew(
    folder: Path, falls: list[float], damage: bytes | None
) -> None:
    good = driven(MujocoPlant())
    (file,) = kept(folder)
    content = file.read_bytes()
    file.write_bytes(content[:8] + b"~" + content[9:] if damage is None else damage)
    assert driven(MujocoPlant()) == good
    assert len(falls) == 2
    assert file.read_bytes() == content


def test_where_nothing_can_be_kept_every_robot_falls(
    folder: Path, falls: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    kernel_folder().joinpath("lying").touch()  # pyright: ignore[reportOptionalMemberAccess]
    MujocoPlant()
    monkeypatch.setenv(CACHE_VARIABLE, str(folder / "a file" / "below"))
    (folder / "a file").touch()
    kernel_folder.cache_clear()
    MujocoPlant()
    assert len(falls) == 2


def test_what_is_kept_does_not_grow_without_end(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(settling, "_KEPT_STATES", 2)
    for yaw in (0.1, 0.2, 0.3):
        MujocoPlant(initial_yaw=yaw)
    assert len(kept(folder)) == 1
