"""What the robot does on its own sensors: IMU, encoders and feet, nothing else, judged by MuJoCo.

The estimator's numbers were tuned on seeds 0 to 9 and 7000 to 7035, at 0.5 to 3 m/s; those judged
begin at 14000, as in ``benchmarks.locomotion``, whose runs are repeated here. Errors, in a world
that begins where the robot lies:

- creep: way of the estimate of a standing robot over 60 s, beyond the way in truth;
- drift: the way walked by the estimate against that in truth, over 20 s.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from benchmarks.robots import plant_of
from benchmarks.study import Direction, Measurement, Metric, Study
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.rotations import yaw_rotation

FIRST_SEED = 14000
MASS_RANGE = (0.9, 1.1)
"""As in ``benchmarks.locomotion``."""
STANDING_TIME, WALKING_TIME = 60.0, 20.0
"""s"""
WALKING_SPEED = 0.5
"""m/s"""
_STANDING, _WALKING = "sensors: standing, 60 s", "sensors: trot 0.5 m/s, 20 s"
STANDING_METRICS = (
    Metric("creep", _STANDING, "creep of the estimate", "mm", 3.0),
    Metric("moved", _STANDING, "way in truth", "mm", None),
)
WALKING_METRICS = (
    Metric("drift", _WALKING, "drift of odometry / way", "%", 1.5),
    Metric("turned", _WALKING, "drift of the heading", "deg", None),
)
CALLS = ("stand", "high_five", "sit", "stand_again", "stop", "lie_down")
CALL_METRICS = tuple(
    Metric(f"done.{name}", "sensors: calls", f"{name} done", "", 1.0, Direction.AT_LEAST)
    for name in CALLS
)


def sensing_plant(trial: Trial) -> MujocoPlant:
    """A simulated robot under the conditions of the trial that lives on its own sensors."""
    return plant_of(trial, FIRST_SEED, MASS_RANGE, sensors="imu")


def _place(plant: MujocoPlant) -> Float[np.ndarray, "2 3"]:
    """x, y [m] and heading [rad] by the estimate, and in truth."""
    return np.array([[*state.q[:2], state.yaw] for state in (plant.read(), plant.truth())])


def measure_standing(trial: Trial) -> Measurement:
    """Stand for a minute."""
    with TrialRobot(sensing_plant(trial)) as robot:
        robot.require(robot.go2.stand())
        before = _place(robot.plant)
        for _ in range(int(STANDING_TIME)):
            robot.wait(1.0)
            robot.truth.clear()  # a minute's recording would be a gigabyte
        seen, true = _place(robot.plant) - before
    turn = yaw_rotation(before[0, 2] - before[1, 2])[:2, :2]  # from the true world into its own
    off = seen[:2] - turn @ true[:2]
    millimetres = {"creep": off, "moved": true[:2]}
    return Measurement({n: 1000.0 * float(np.linalg.norm(way)) for n, way in millimetres.items()})


def measure_walking(trial: Trial) -> Measurement:
    """Trot straight ahead."""
    with TrialRobot(sensing_plant(trial)) as robot:
        robot.require(robot.go2.stand())
        robot.require(robot.go2.walk())
        before = _place(robot.plant)
        robot.go2.move(WALKING_SPEED)
        robot.wait(WALKING_TIME)
        seen, true = _place(robot.plant) - before
    turn = yaw_rotation(before[0, 2] - before[1, 2])[:2, :2]
    off = float(np.linalg.norm(seen[:2] - turn @ true[:2]))
    turned = abs(np.degrees(seen[2] - true[2] + np.pi) % 360.0 - 180.0)
    way = float(np.linalg.norm(true[:2]))
    return Measurement({"drift": 100.0 * off / way, "turned": float(turned)})


def measure_calls(trial: Trial) -> Measurement:
    """Stand, raise a paw, sit, stand, trot and stop, lie down: what says ``True``, upright."""
    values: dict[str, float] = dict.fromkeys((f"done.{name}" for name in CALLS), 0.0)
    failures: dict[str, str] = {}
    with TrialRobot(sensing_plant(trial)) as robot:
        go2 = robot.go2

        def stop() -> bool:
            robot.require(go2.walk())
            go2.move(WALKING_SPEED)
            robot.wait(3.0)
            go2.stop()
            return go2.last_outcome.ok

        calls = (go2.stand, go2.high_five, go2.sit, go2.stand, stop, go2.lie_down)
        for name, call in zip(CALLS, calls, strict=True):
            try:
                done = call()
                if name != "lie_down":  # the trunk is on the ground then
                    robot.require(done)
                values[f"done.{name}"] = float(done)
            except TrialFailed as failed:
                failures[f"done.{name}"] = str(failed)
    return Measurement(values, failures)


STUDIES = (
    Study("standing", STANDING_METRICS, measure_standing, group="sensors"),
    Study("odometry", WALKING_METRICS, measure_walking, group="sensors"),
    Study("calls", CALL_METRICS, measure_calls, group="sensors"),
)
