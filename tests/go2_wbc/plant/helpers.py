"""What several plant tests use: a standing pose, standing up, flying, and momentum."""

import numpy as np
import pinocchio as pin

from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.robot.state import JointCommand, RobotState

GRAVITY = 9.81
STAND = np.tile([0.0, 0.75, -1.5], 4)


def stand_up(plant: MujocoPlant, seconds: float = 2.0) -> RobotState:
    """Stands the robot up with a joint servo and returns the state at the end."""
    start, ticks = plant.read().joint_positions, round(seconds / plant.control_period)
    for tick in range(ticks):
        share = min(1.0, 2.0 * tick / ticks)
        plant.write(JointCommand.servo(start + share * (STAND - start), np.zeros(12), 60.0, 3.0))
    return plant.read()


def fly(plant: MujocoPlant, seed: int = 0, speed: float = 1.0) -> RobotState:
    """Throws the robot into the air, 5 m up, turned and moving at random."""
    rng = np.random.default_rng(seed)
    q = np.concatenate([[0.0, 0.0, 5.0], rng.standard_normal(4), STAND])
    q[3:7] /= np.linalg.norm(q[3:7])
    plant.place(q, speed * rng.standard_normal(18))
    return plant.read()


def momentum(robot: pin.Model, state: RobotState) -> np.ndarray:
    """Linear momentum, then angular about the centre of mass, along world axes (Pinocchio's)."""
    data = robot.createData()
    return pin.computeCentroidalMomentum(robot, data, state.q, state.v).vector.copy()


def empty_recording(n: int, v_contacts: np.ndarray) -> TruthRecording:
    """What MuJoCo said of a robot at the origin, ``n`` ticks of 2 ms, with sliding feet."""
    return TruthRecording(
        time=0.002 * np.arange(n),
        q=np.zeros((n, 19)),
        v=np.zeros((n, 18)),
        rpy=np.zeros((n, 3)),
        tau=np.zeros((n, 12)),
        tau_asked=np.zeros((n, 12)),
        foot_forces=np.zeros((n, 4)),
        p_world_com=np.zeros((n, 3)),
        p_world_feet=np.zeros((n, 4, 3)),
        p_world_contacts=np.zeros((n, 4, 3)),
        v_world_contacts=v_contacts,
        trunk_force=np.zeros(n),
        limb_force=np.zeros(n),
        touches_itself=np.zeros(n, dtype=bool),
    )
