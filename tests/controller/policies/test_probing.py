"""A second of a policy says what is wrong with its sidecar, and accuses none that is right."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.policies import laid_out
from controller.policies import TROT, Policy, Sidecar, probe
from controller.policies.probing import CLEAR, COMMAND, Change, Track, changes, scaled
from go2_wbc.robot.state import RobotState
from tests.controller.policies.layouts import ISAAC_LAB, UNITREE


@pytest.fixture(scope="module")
def policy() -> Policy:
    return Policy.load(TROT)


@pytest.fixture(scope="module")
def track(policy: Policy) -> Track:
    return Track(policy.sidecar)


def test_nothing_is_changed_twice_and_each_change_is_one(policy: Policy) -> None:
    side, seen = policy.sidecar, set()
    for change in changes(side):
        assert (change.key, change.told) not in seen
        seen.add((change.key, change.told))
        other = change.sidecar
        differ = [
            (other.order != side.order).any(),
            (other.signs != side.signs).any(),
            (other.action_scale != side.action_scale).any(),
            (other.kp != side.kp).any(),
            (other.kd != side.kd).any(),
            *((a.scale != b.scale).any() for a, b in zip(other.terms, side.terms, strict=True)),
        ]
        assert sum(map(bool, differ)) == 1
    assert {order_of(change) for change in changes(side)} > {tuple(ISAAC_LAB), tuple(UNITREE)}


def order_of(change: Change) -> tuple[int, ...]:
    return tuple(change.sidecar.order.tolist())


def test_with_anything_changed_by_a_factor_of_2_or_more_it_walks_clearly_worse(
    policy: Policy, track: Track
) -> None:
    right = track.mark(policy)
    missed = [
        f"{change.key}, {change.told}"
        for change in changes(policy.sidecar)
        if not 0.5 < change.factor < 2.0
        and track.mark(Policy("", change.sidecar, policy.network)) < CLEAR * right
    ]
    assert missed == ["scale of joint_velocities, 0.4 times that"], "half of them do for the clone"


def test_a_mark_is_the_sum_of_what_goes_wrong_in_the_last_two_thirds(
    policy: Policy, track: Track, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[RobotState] = []
    read = track._plant.read
    monkeypatch.setattr(track._plant, "read", lambda: seen.append(read()) or seen[-1])
    mark = track.mark(policy)
    last = seen[len(seen) // 3 :]
    v = np.mean([s.v for s in last], axis=0)
    rise = [s.R_world_base[2] @ s.v[:3] for s in last]
    rolling = np.linalg.norm([s.v[3:5] for s in last], axis=1)
    told = sum(
        np.sqrt(np.mean(np.square(of))) / unit
        for of, unit in ((rise, 0.1), (rolling, 0.3), ([s.tilt for s in last], 0.05))
    )
    asked = policy.sidecar.commands.clip(COMMAND)
    told += abs(v[0] - asked.linear_x) / 0.1 + abs(v[1] - asked.linear_y) / 0.1
    assert mark == pytest.approx(told + abs(v[5] - asked.angular_z) / 0.2)


@pytest.mark.parametrize("order", [ISAAC_LAB, UNITREE], ids=["isaac-lab", "unitree"])
def test_a_right_sidecar_has_the_same_mark_in_every_layout(
    policy: Policy, track: Track, order: np.ndarray
) -> None:
    rng = np.random.default_rng(1)
    signs, scales = rng.choice([-1.0, 1.0], size=12), rng.uniform(0.2, 5.0, 8)
    other = laid_out(policy, order, signs, scales, 3.0)
    assert track.mark(other) == pytest.approx(track.mark(policy), rel=0.1)


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of what is changed each seventh, and all gains and orders leg by leg: the rest takes long."""

    def chosen(side: Sidecar) -> list[Change]:
        kept = ("action.kp", "action.kd")
        return [
            change
            for i, change in enumerate(changes(side))
            if i % 7 == 0 or change.key in kept or change.told.endswith("leg by leg")
        ]

    monkeypatch.setattr("controller.policies.probing.changes", chosen)


@pytest.mark.usefixtures("few")
def test_the_probe_names_a_gain_and_what_it_should_be(policy: Policy) -> None:
    wrong = scaled(policy.sidecar, "action.kp", 3.0).sidecar
    finding = probe(Policy("wrong", wrong, policy.network))
    assert not finding
    assert finding.change is not None
    np.testing.assert_allclose(finding.change.sidecar.kp, policy.sidecar.kp, rtol=0.3)
    assert str(finding).startswith("action.kp is wrong: it walks far better with 0.")


@pytest.mark.usefixtures("few")
def test_the_probe_names_the_order_of_another_framework(policy: Policy) -> None:
    wrong = replace(policy.sidecar, order=UNITREE)
    finding = probe(Policy("wrong", wrong, policy.network))
    assert finding.change is not None
    assert order_of(finding.change) == tuple(range(12))
    assert "far better with FL, FR, RL, RR, leg by leg" in str(finding)


@pytest.mark.usefixtures("few")
def test_a_policy_that_cannot_walk_is_not_called_right_and_nothing_is_named(policy: Policy) -> None:
    folded = Policy("folded", policy.sidecar, lambda _: np.tile([0.0, 4.0, -4.0], 4))
    finding = probe(folded)
    assert not finding
    assert finding.change is None
    assert str(finding).startswith("it falls, whatever one thing is changed")
