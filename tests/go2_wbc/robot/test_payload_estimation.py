"""What a robot carries is felt as it is; what it does not carry is not believed."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import JointFriction
from go2_wbc.robot.payload_estimation import PayloadConfig, PayloadEstimator, follow_wrench
from go2_wbc.robot.rigid_body import NO_PAYLOAD, Payload
from go2_wbc.robot.state import RobotState
from tests.compiled import assert_plain_is_compiled
from tests.engine_helpers import random_state, standing_q, state_of

TICK = 0.002
MODEL = RobotModel()
Z = PayloadConfig().middle[2]
ALL = np.ones(4, dtype=bool)
AT_ONCE = PayloadConfig(memory=TICK, most_rise=1e3, most_speed=(1e3, 1e3), least_height=0.01)
ASIDE = Payload(4.0, (0.03, 0.08, Z))


def standing(
    carried: Payload, time: float = 0.0, contact: np.ndarray = ALL, share: float = 1.0
) -> RobotState:
    """At rest on all feet with torques that hold ``share`` of robot and payload."""
    state = replace(state_of(standing_q(), time=time), feet_in_contact=contact)
    snapshot = MODEL.snapshot(state, carried)
    J = np.concatenate(list(snapshot.J_contacts))
    forces = np.linalg.pinv(J[:, :6].T) @ snapshot.bias[:6]
    return replace(state, tau=share * (snapshot.bias - J.T @ forces)[6:])


def after(
    estimator: PayloadEstimator, carried: Payload, seconds: float, start: float = 0.0, **how: object
) -> Payload:
    """What is believed after standing so for a while."""
    payload = NO_PAYLOAD if start == 0.0 else estimator.update(MODEL.snapshot(standing(carried)))
    for tick in range(round(seconds / TICK)):
        state = standing(carried, start + tick * TICK, **how)  # type: ignore[arg-type]
        payload = estimator.update(MODEL.snapshot(state, payload))
    return payload


def make(config: PayloadConfig | None = None) -> PayloadEstimator:
    return PayloadEstimator(MODEL, JointFriction.none(), config)


def test_a_payload_beside_the_middle_is_found_with_its_place() -> None:
    found = after(make(), ASIDE, 5.0)
    assert found.mass == pytest.approx(4.0, abs=0.01)
    assert found.place == pytest.approx(ASIDE.place, abs=1e-3)


def test_the_belief_grows_slowly() -> None:
    assert after(make(), ASIDE, 1.2).mass < 3.0
    assert after(make(), ASIDE, 2.5).mass > 3.0


def test_what_does_not_last_is_not_believed() -> None:
    estimator, config = make(), PayloadConfig()
    most = np.zeros(3)
    for tick in range(1000):
        blow = Payload(10.0, (0.0, 0.1, Z)) if tick * TICK < 0.15 else NO_PAYLOAD
        state = standing(blow, tick * TICK)
        assert estimator.update(MODEL.snapshot(state)) is NO_PAYLOAD
        most = np.maximum(most, estimator.felt)
    assert most[0] > config.least_mass
    assert most[2] > config.least_moment[1]


def test_what_the_robot_no_longer_carries_is_forgotten_for_good() -> None:
    estimator = make()
    payload = after(estimator, ASIDE, 5.0)
    for tick in range(3000):
        state = standing(NO_PAYLOAD, 5.0 + tick * TICK)
        payload = estimator.update(MODEL.snapshot(state, payload))
    assert payload is NO_PAYLOAD


@pytest.mark.parametrize(
    "little", [Payload(1.6, (0.0, 0.0, Z)), Payload(3.5, (0.02, 0.0, Z)), Payload(0.9, (0, 0.1, Z))]
)
def test_a_little_is_not_believed(little: Payload) -> None:
    assert after(make(), little, 4.0) is NO_PAYLOAD


def test_one_that_is_in_the_middle_is_believed_from_a_greater_mass_on() -> None:
    found = after(make(), Payload(6.0, (0.0, 0.0, Z)), 5.0)
    assert found.mass == pytest.approx(6.0, abs=0.02)


def test_the_belief_is_bounded() -> None:
    config = PayloadConfig()
    found = after(make(), Payload(11.0, (0.3, -0.25, Z)), 6.0)
    assert found.mass == pytest.approx(config.most_mass, abs=0.02)
    assert found.place[:2] == pytest.approx([config.reach[0], -config.reach[1]], abs=1e-3)


def test_a_foot_that_measures_no_contact_makes_no_payload() -> None:
    one_broken = np.array([True, True, False, True])
    assert after(make(), NO_PAYLOAD, 4.0, contact=one_broken) is NO_PAYLOAD


def test_nothing_is_felt_without_any_contact() -> None:
    assert after(make(), ASIDE, 4.0, contact=~ALL) is NO_PAYLOAD


def test_nothing_is_felt_on_the_belly_in_a_rise_and_at_speed() -> None:
    lying = replace(PayloadConfig(), least_height=0.35)
    assert after(make(lying), ASIDE, 4.0) is NO_PAYLOAD
    for velocity in ([0.0, 0.0, 0.2], [1.6, 0.0, 0.0], [0.0, 0.5, 0.0]):
        estimator, payload = make(), NO_PAYLOAD
        for tick in range(2000):
            state = standing(ASIDE, tick * TICK)
            v = np.concatenate([velocity, np.zeros(15)])
            payload = estimator.update(MODEL.snapshot(replace(state, v=v), payload))
        assert payload is NO_PAYLOAD


def test_a_tick_after_a_pause_is_not_compared_with_one_before() -> None:
    estimator = make(AT_ONCE)
    still = standing(NO_PAYLOAD)
    estimator.update(MODEL.snapshot(still))
    estimator.pause()
    moved = replace(standing(NO_PAYLOAD, 9.0), v=np.ones(18))
    estimator.update(MODEL.snapshot(moved))
    assert estimator.felt == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def moving(
    rng: np.random.Generator, carried: Payload, friction: JointFriction
) -> tuple[RobotState, RobotState, np.ndarray]:
    """A state, one a tick later that its torques bring about, and the payload's wrench.

    By Pinocchio's inverse dynamics of the robot with the payload joined to its trunk, and without.
    """
    contact = rng.random(4) < 0.7
    contact[rng.choice(4, 2, replace=False)] = True
    before, state = random_state(rng, 0.3), random_state(rng, 0.3)
    loaded = MODEL.pin_model.copy()
    loaded.inertias[1] = loaded.inertias[1] + carried.inertia
    motion = (state.q, state.v, (state.v - before.v) / TICK)
    needed = pin.rnea(loaded, loaded.createData(), *motion)
    wrench = (needed - MODEL.inverse_dynamics(*motion))[:6]
    J = MODEL.snapshot(state).J_contacts[contact].reshape(-1, 18)
    forces = np.linalg.lstsq(J[:, :6].T, needed[:6], rcond=None)[0]
    # What the feet cannot give somebody else does, who must not be taken for a payload.
    helped = needed[:6] - J[:, :6].T @ forces
    tau = (needed - J.T @ forces)[6:] + friction.torque(state.v[6:], np.zeros(12))
    return before, replace(state, time=TICK, tau=tau, feet_in_contact=contact), wrench - helped


@pytest.mark.parametrize("known", [NO_PAYLOAD, Payload(2.5, (0.1, -0.05, 0.02)), ASIDE])
def test_what_is_felt_is_what_the_joined_body_adds_to_the_inverse_dynamics(known: Payload) -> None:
    """Whatever of it is known already, and with what friction takes of the torques."""
    rng = np.random.default_rng(4)
    friction = JointFriction.by_part((0.3, 0.2, 0.5), (0.1, 0.2, 0.3))
    for _ in range(100):
        before, state, wrench = moving(rng, ASIDE, friction)
        estimator = PayloadEstimator(MODEL, friction, AT_ONCE)
        estimator._place = np.array(known.place)
        estimator.update(MODEL.snapshot(before))
        estimator.update(MODEL.snapshot(state, known))
        # The known one is a part of the trunk: a point mass feels nothing of turns about itself.
        turning = turned_point(state, before, known)
        found = np.concatenate([estimator._mean.force, estimator._mean.moment])
        np.testing.assert_allclose(found, wrench + turning, rtol=1e-8, atol=1e-6)


def turned_point(state: RobotState, before: RobotState, known: Payload) -> np.ndarray:
    """What turning the trunk asks of the known payload, beside what its middle weighs.

    m (dw x p + w x w x p) and its moment: in the snapshot it is there, in what is added for what is
    known it is left out.
    """
    p, w = np.array(known.place), state.v[3:6]
    dw = (w - before.v[3:6]) / TICK
    force = -known.mass * (np.cross(dw, p) + np.cross(w, np.cross(w, p)))
    return np.concatenate([force, np.cross(p, force)])


def test_compiled_is_plain() -> None:
    rng, friction = np.random.default_rng(7), JointFriction()
    estimator = PayloadEstimator(MODEL, friction)
    for config in (PayloadConfig(), AT_ONCE):
        numbers = PayloadEstimator(MODEL, friction, config)._numbers
        before, state, _ = moving(rng, ASIDE, friction)
        measured = (before.v, state.tau, state.feet_in_contact, TICK)
        snapshot, place = MODEL.snapshot(state, ASIDE), np.array(ASIDE.place)
        given = (snapshot, *measured, place, numbers, estimator._mean)
        assert_plain_is_compiled(follow_wrench, *given)


@pytest.mark.parametrize("name", ["memory", "response", "least_mass", "most_mass", "reach"])
def test_numbers_that_make_no_sense_are_refused(name: str) -> None:
    bad = (0.1, -0.1) if name == "reach" else -1.0
    with pytest.raises(ConfigError, match=rf"PayloadConfig.{name} must be positive"):
        PayloadConfig(**{name: bad})  # type: ignore[arg-type]


def test_its_inertia_is_that_of_a_point() -> None:
    place = np.array([0.1, -0.2, 0.3])
    inertia = Payload(2.0, (0.1, -0.2, 0.3)).inertia.matrix()
    assert np.diag(inertia)[:3] == pytest.approx(2.0)
    about_origin = 2.0 * (place @ place * np.eye(3) - np.outer(place, place))
    np.testing.assert_allclose(inertia[3:, 3:], about_origin, atol=1e-12)


def test_nothing_has_no_mass() -> None:
    assert NO_PAYLOAD.mass == 0.0


@pytest.mark.parametrize("mass", [-0.1, np.nan, np.inf])
def test_a_mass_that_cannot_be_is_refused(mass: float) -> None:
    with pytest.raises(ConfigError, match=r"Payload.mass must be at least 0"):
        Payload(mass)


def test_a_place_that_is_none_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"Payload.place must be finite"):
        Payload(1.0, (0.0, np.nan, 0.0))
