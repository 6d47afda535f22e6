from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.base import Scan
from go2_wbc.plant.mujoco.lidar import PLACE, DepthConfig, LidarConfig
from go2_wbc.plant.terrain import Blocks
from go2_wbc.robot.state import JointCommand
from tests.engine_helpers import standing_q

EXACT = LidarConfig(noise=0.0, latency=0.0)


def scans(plant: MujocoPlant, ticks: int) -> list[tuple[float, Scan]]:
    """What it tells, and when."""
    told = []
    for _ in range(ticks):
        scan = plant.scan()
        if scan is not None:
            told.append((plant.time, scan))
        plant.write(JointCommand.damping(5.0))
    return told


def test_scans_come_at_their_rate_and_change_nothing_else() -> None:
    config = LidarConfig(rate=25.0, latency=0.03)
    told = scans(MujocoPlant(lidar=config), 200)
    np.testing.assert_allclose([scan.time for _, scan in told], 0.04 * np.arange(10), atol=1e-9)
    np.testing.assert_allclose([t - scan.time for t, scan in told], config.latency, atol=1e-9)
    assert all(scan.deviation == config.noise for _, scan in told)
    assert not scans(MujocoPlant(), 50)
    blind, seeing = (
        MujocoPlant(sensors="imu", seed=3),
        MujocoPlant(sensors="imu", seed=3, lidar=True),
    )
    scans(blind, 40)
    scans(seeing, 40)
    np.testing.assert_array_equal(blind.read().q, seeing.read().q)


def test_points_lie_on_the_ground_with_the_noise_along_their_rays() -> None:
    plants = [MujocoPlant(lidar=config, seed=2) for config in (EXACT, replace(EXACT, noise=0.02))]
    exact, noisy = (standing(plant) for plant in plants)
    R, p = plants[0].truth().R_world_base, plants[0].truth().p_world_base
    np.testing.assert_allclose((exact.p_base_points @ R.T + p)[:, 2], 0.0, atol=1e-9)
    assert len(exact.p_base_points) == len(noisy.p_base_points) > 500
    far = [np.linalg.norm(scan.p_base_points - PLACE, axis=1) for scan in (exact, noisy)]
    assert np.std(far[1] - far[0]) == pytest.approx(0.02, rel=0.1)


def standing(plant: MujocoPlant, height: float = 0.3) -> Scan:
    plant.place(standing_q(height))
    scan = plant.scan()
    assert scan is not None
    return scan


def test_the_robots_own_legs_are_in_the_way() -> None:
    plant = MujocoPlant(lidar=EXACT)
    shown = standing(plant).p_base_points
    lifted = standing_q(0.3)
    lifted[7::3], lifted[8::3], lifted[9::3] = 0.0, -1.5, -0.9  # legs out of the way
    other = MujocoPlant(lidar=EXACT)
    other.place(lifted)
    free = other.scan()
    assert free is not None
    hidden = {tuple(p) for p in free.p_base_points.round(6)} - {tuple(p) for p in shown.round(6)}
    assert len(hidden) > 20
    assert all(x < PLACE[0] for x, _, _ in hidden)  # they are behind the nose


def test_what_happens_next_is_saved() -> None:
    plant = MujocoPlant(lidar=True, terrain=Blocks(0.2))
    scans(plant, 35)
    saved = plant.save()
    first = scans(plant, 60)
    plant.restore(saved)
    for (_, a), (_, b) in zip(first, scans(plant, 60), strict=True):
        np.testing.assert_array_equal(a.p_base_points, b.p_base_points)


def test_of_a_users_own_model_nobody_knows_what_is_ground(tmp_path: object) -> None:
    with pytest.raises(ConfigError, match="lidar is only for the built model"):
        MujocoPlant(f"{tmp_path}/own.xml", lidar=True)
    with pytest.raises(ConfigError, match="depth is only for the built model"):
        MujocoPlant(f"{tmp_path}/own.xml", depth=DepthConfig())
    with pytest.raises(ConfigError, match="not with both"):
        MujocoPlant(lidar=True, depth=True)


def test_a_depth_camera_sees_the_ground_ahead_with_a_noise_that_grows_with_the_square() -> None:
    exact, noisy = DepthConfig(noise=0.0, latency=0.0), DepthConfig(latency=0.0)
    plants = [MujocoPlant(depth=config, seed=2) for config in (exact, noisy)]
    scan, other = (standing(plant) for plant in plants)
    R, p = plants[0].truth().R_world_base, plants[0].truth().p_world_base
    points = scan.p_base_points @ R.T + p
    np.testing.assert_allclose(points[:, 2], 0.0, atol=1e-9)
    assert 0.2 < points[:, 0].min() - noisy.place[0] < 0.3  # 59 deg below the horizontal
    far, off = (np.linalg.norm(s.p_base_points - noisy.place, axis=1) for s in (scan, other))
    assert far.max() < noisy.farthest
    off -= far
    for low, high in ((0.3, 0.8), (1.5, 3.0)):
        here = (far > low) & (far < high)
        assert here.sum() > 100
        assert np.std(off[here] / far[here] ** 2) == pytest.approx(noisy.noise, rel=0.15)
    assert other.deviation == pytest.approx(np.sqrt(np.mean(off**2)), rel=0.2)
