"""What the robot does on its own sensors: IMU, encoders and feet, nothing else, judged by MuJoCo.

The estimator's numbers were tuned on seeds 0 to 9 and 7000 to 7035, at 0.5 to 3 m/s; those judged
begin at 14000, as in ``benchmarks.locomotion``, whose runs are repeated here. Errors, in a world
that begins where the robot lies:

- creep: way of the estimate of a standing robot over 60 s, beyond the way in truth;
- drift: the way walked by the estimate against that in truth, over 20 s.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from jaxtyping import Float

from benchmarks.robots import UNTOLD, plant_of
from benchmarks.study import IMU, Study, TrialResult
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.rotations import yaw_rotation

FIRST_SEED = 14000  # As in ``benchmarks.locomotion``
SPEED = 0.5  # m/s
CALLS = ("stand", "high_five", "sit", "stand_again", "stop", "lie_down")


def _place(plant: MujocoPlant) -> Float[np.ndarray, "2 3"]:
    """x, y [m] and heading [rad] by the estimate, and in truth."""
    return np.array([[*state.q[:2], state.yaw] for state in (plant.read(), plant.truth())])


def measure_drift(trial: Trial, found: TrialResult, seconds: int, *, walks: bool) -> None:
    """Stand, or trot straight ahead."""
    with TrialRobot(plant_of(trial, FIRST_SEED, UNTOLD)) as robot:
        robot.require(robot.go2.stand())
        if walks:
            robot.require(robot.go2.walk())
        before = _place(robot.plant)
        if walks:
            robot.go2.move(SPEED)
        for _ in range(seconds):
            robot.wait(1.0)
            robot.truth.clear()  # a minute's recording would be a gigabyte
        seen, true = _place(robot.plant) - before
    turn = yaw_rotation(before[0, 2] - before[1, 2])[:2, :2]  # from the true world into its own
    off, way = (float(np.linalg.norm(p)) for p in (seen[:2] - turn @ true[:2], true[:2]))
    turned = float(abs(np.degrees(seen[2] - true[2] + np.pi) % 360.0 - 180.0))
    if walks:
        found.values = {"drift": 100.0 * off / way, "turned": turned}
    else:
        found.values = {"creep": 1000.0 * off, "moved": 1000.0 * way}


def measure_calls(trial: Trial, found: TrialResult) -> None:
    """Stand, raise a paw, sit, stand, trot and stop, lie down: what says ``True``, upright."""
    found.values |= dict.fromkeys(CALLS, 0.0)
    with TrialRobot(plant_of(trial, FIRST_SEED, UNTOLD)) as robot:
        go2 = robot.go2

        def stop() -> bool:
            robot.require(go2.walk())
            go2.move(SPEED)
            robot.wait(3.0)
            go2.stop()
            return go2.last_outcome.ok

        calls = (go2.stand, go2.high_five, go2.sit, go2.stand, stop, go2.lie_down)
        for name, call in zip(CALLS, calls, strict=True):
            try:
                done = call()
                if name != "lie_down":  # the trunk is on the ground then
                    robot.require(done)
                found.values[name] = float(done)
            except TrialFailed as failed:
                found.failures[name] = str(failed)


_stand = partial(measure_drift, seconds=60, walks=False)
_trot = partial(measure_drift, seconds=20, walks=True)
_CREEP = (("creep", "creep of the estimate", "<= 3 mm"), ("moved", "way in truth", "mm"))
_DRIFT = (
    ("drift", "drift of odometry / way", "<= 1.5 %"),
    ("turned", "drift of the heading", "deg"),
)
_DONE = tuple((call, f"{call} done", ">= 1") for call in CALLS)
STUDIES = tuple(
    Study(name, {f"sensors: {item}": rows}, measure, prefix, group="sensors", sensors=IMU)
    for name, item, rows, measure, prefix in (
        ("standing", "standing, 60 s", _CREEP, _stand, ""),
        ("odometry", "trot 0.5 m/s, 20 s", _DRIFT, _trot, ""),
        ("calls", "calls", _DONE, measure_calls, "done"),
    )
)
