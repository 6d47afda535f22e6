"""Drops the robot in random attitudes with random joint angles, and lets it get up.

``python -m tests.scenarios.random_drops --count 100 --first 1000`` runs a hundred of them.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from controller import GO2Controller
from controller.behaviours import DAMPING
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand

CONTROL_PERIOD = 0.004  #: Seconds; twice the usual one: a drop takes half the time
HEIGHT = 0.5  #: Height [m] of the base at the start; no leg reaches the ground
GREATEST_SPIN = 3.0  #: Greatest angular velocity [rad/s] per axis at the start
SETTLE_TIME = 1.5  #: Time [s] for which the limp robot falls and comes to rest
UPRIGHT = np.radians(6)  #: Tilt [rad] below which a robot that stands is upright


@dataclass(frozen=True, slots=True)
class Drop:
    """One drop and what came of it."""

    seed: int  #: makes it repeatable
    q_joints: tuple[float, ...]  #: angles [rad] in which the legs came to rest
    tilt: float  #: of the trunk at rest [rad]
    ok: bool  #: whether the robot stands, by its own word and by the simulator's state
    reason: str  #: its own, in plain words
    duration: float  #: robot time [s] that it took

    def __str__(self) -> str:
        """One line."""
        joints = " ".join(f"{angle:5.2f}" for angle in self.q_joints)
        verdict = "stands" if self.ok else f"does not stand: {self.reason}"
        tilt = f"tilt {np.degrees(self.tilt):3.0f} deg"
        return f"seed {self.seed}: {tilt}, joints {joints}: {verdict}, {self.duration:.1f} s"


def dropped(seed: int) -> MujocoPlant:
    """A limp robot that has fallen: any attitude, any joint angles, spinning.

    Legs may begin inside one another or inside the trunk; that drives them where they jam.
    """
    rng, model = np.random.default_rng(seed), RobotModel()
    plant = MujocoPlant(control_period=CONTROL_PERIOD, seed=seed)
    joints = rng.uniform(model.q_lower, model.q_upper)
    v = np.zeros(18)
    v[3:6] = rng.uniform(-GREATEST_SPIN, GREATEST_SPIN, 3)
    plant.place(np.concatenate([[0.0, 0.0, HEIGHT], rng.normal(size=4), joints]), v)
    for _ in range(round(SETTLE_TIME / CONTROL_PERIOD)):
        plant.write(JointCommand.damping(DAMPING))
    return plant


def recovered(seed: int) -> Drop:
    """Drop the robot and let it get up."""
    plant = dropped(seed)
    with GO2Controller(plant=plant) as go2:
        joints, tilt = tuple(go2.state.joint_positions.tolist()), go2.state.tilt
        says_so = go2.recover()
        state = plant.read()
        stands = state.tilt < UPRIGHT and state.feet_in_contact.all()
        fits = _legs_are_in_range(plant)
        reason = go2.last_outcome.reason
        if says_so and not (stands and fits):
            reason = f"said that it stands: {np.round(state.joint_positions, 2)}"
        duration = go2.last_outcome.duration
    plant.close()
    return Drop(seed, joints, tilt, bool(says_so and stands and fits), reason, duration)


def _legs_are_in_range(plant: MujocoPlant) -> bool:
    model, q_joints = RobotModel(), plant.read().joint_positions
    return bool(((model.q_lower <= q_joints) & (q_joints <= model.q_upper)).all())


def drops(seeds: range) -> Iterator[Drop]:
    """One drop per seed."""
    return map(recovered, seeds)


def main() -> None:
    """Run drops and count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    args = parser.parse_args()
    stood = 0
    for done, drop in enumerate(drops(range(args.first, args.first + args.count)), 1):
        stood += drop.ok
        print(f"{drop}; {stood} of {done}", flush=True)


if __name__ == "__main__":
    main()
