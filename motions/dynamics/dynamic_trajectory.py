"""What a solver of dynamic motions finds: states, torques, forces and feedback at its knots.

As curves: the solver integrates by semi-implicit Euler, q[k+1] = q[k] + dt v[k+1], so its
velocities belong to the middle of its configurations (leapfrog; Hairer, Lubich & Wanner 2003).
Taken half a step back, both fit each other to second order, and the cubic through two knots with
their rates is the parabola of the plan's own acceleration, constant from one knot to the next.
Through configurations as they stand it would swing between 4 and -2 times that, and a spline over
several knots would smear a touchdown over its neighbours; both invent torques.
"""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from dataclasses import dataclass, fields
from tokenize import TokenError

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float
from scipy.interpolate import CubicHermiteSpline, PPoly

from go2_wbc.errors import MotionError
from go2_wbc.legs import FOOT_NAMES
from go2_wbc.robot.model import RobotModel

FORMAT = 1  #: Version of the files; others are refused
BALANCING_FEET = 2
"""On so many feet or fewer the plan's own gains are worth keeping: on more, the whole-body
controller balances by itself."""
UNREADABLE = (
    OSError, ValueError, EOFError, SyntaxError, TokenError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
"""What ``numpy.load`` raises for damaged files."""
_ARRAYS = {
    "times": (None,),
    "q": (None, 19),
    "v": (None, 18),
    "tau": (None, 12),
    "forces": (None, 4, 3),
    "stance": (None, 4),
    "gains": (None, 12, 36),
    "p_feet": (None, 4, 3),
}


@dataclass(frozen=True, slots=True)
class Miss:
    """How far one thing is from where it was asked to be."""

    subject: str  #: "trunk" or the name of a foot
    phase: str  #: label of the phase at whose end it was asked
    time: float  #: [s] from the start
    position: float  #: distance [m]
    angle: float  #: [rad], of the trunk, whole turns that were lost included; 0 of a foot

    def __str__(self) -> str:
        angle = "" if self.subject != "trunk" else f", {np.degrees(self.angle):.1f} deg"
        where = f" ({self.phase})" if self.phase else ""
        return f"{self.subject} at {self.time:.2f} s{where}: {1e3 * self.position:.0f} mm{angle}"


@dataclass(frozen=True, slots=True)
class DynamicTrajectory:
    """A motion of the whole robot that obeys its dynamics, in the frame of its problem.

    The frame has z up, x ahead, and its origin on the ground in the middle of the feet at the
    start. Row ``k`` of what has n rows holds from ``times[k]`` to ``times[k + 1]``.
    """

    times: Float[np.ndarray, " n1"]  #: knots [s], from 0
    q: Float[np.ndarray, "n1 19"]  #: base position [m], quaternion x y z w, joint angles [rad]
    v: Float[np.ndarray, "n1 18"]
    """Base linear [m/s] and angular velocity [rad/s] in the base frame, joints."""
    tau: Float[np.ndarray, "n 12"]  #: joint torques [N m]
    forces: Float[np.ndarray, "n 4 3"]  #: of the ground on the feet [N], in the problem's frame
    stance: Bool[np.ndarray, "n 4"]  #: feet that stand
    gains: Float[np.ndarray, "n 12 36"]
    """Feedback of a state error (as Pinocchio's ``difference`` of planned and measured q, then of
    v) into torques: tau - gains @ error."""
    p_feet: Float[np.ndarray, "n1 4 3"]  #: centres of the feet [m]
    iterations: int  #: of the solver, over all its starts
    cost: float  #: at the end
    misses: tuple[Miss, ...]  #: what was asked at the phases' ends, how far the plan is from it
    lag: float = 0.0  #: by which it is late [s] against a motion that was written as a whole

    @property
    def duration(self) -> float:
        """Length [s]."""
        return float(self.times[-1])

    @property
    def position_deviation(self) -> float:
        """Greatest distance [m] from what was asked."""
        return max((miss.position for miss in self.misses), default=0.0)

    @property
    def angle_deviation(self) -> float:
        """Greatest angle [rad] from what was asked."""
        return max((miss.angle for miss in self.misses), default=0.0)

    @property
    def deviation(self) -> str:
        """The greatest deviations in words: how far, of what, when."""
        if not self.misses:
            return "nothing was asked"
        worst = {
            max(self.misses, key=lambda miss: miss.position),
            max(self.misses, key=lambda miss: miss.angle),
        }
        return "; ".join(map(str, sorted(worst, key=lambda miss: miss.time)))

    def to_bytes(self, *, is_small: bool = False) -> bytes:
        """The content of a file that ``from_bytes`` reads.

        Args:
            is_small: compress, with gains to three digits and only where two feet stand or
                fewer, 0 elsewhere: a sixth of the size.
        """
        header = {
            "format": FORMAT,
            "iterations": self.iterations,
            "cost": self.cost,
            "lag": self.lag,
            "misses": [[getattr(miss, part.name) for part in fields(Miss)] for miss in self.misses],
        }
        stream = io.BytesIO()
        arrays = {name: getattr(self, name) for name in _ARRAYS}
        save = np.savez_compressed if is_small else np.savez
        if is_small:
            is_needed = self.stance.sum(axis=1) <= BALANCING_FEET
            arrays["gains"] = (self.gains * is_needed[:, None, None]).astype(np.float16)
        save(stream, header=np.array(json.dumps(header)), **arrays)
        return stream.getvalue()

    @staticmethod
    def from_bytes(content: bytes) -> DynamicTrajectory:
        """The trajectory that ``to_bytes`` wrote.

        Raises:
            MotionError: if the content is damaged or of another version.
        """
        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                header = json.loads(str(file["header"]))
                arrays = {name: file[name] for name in _ARRAYS}
            arrays |= {n: a.astype(float) for n, a in arrays.items() if a.dtype == np.float16}
            version = header["format"]
            misses = tuple(Miss(*row) for row in header["misses"])
            iterations = int(header["iterations"])
            cost, lag = float(header["cost"]), float(header["lag"])
        except (*UNREADABLE, KeyError, TypeError) as error:
            raise MotionError(
                f"this is no dynamic trajectory, or a damaged one: {error}"
            ) from error
        if version != FORMAT:
            raise MotionError(f"a trajectory of format {version}; this version reads {FORMAT}")
        _check_shapes(arrays)
        return DynamicTrajectory(**arrays, iterations=iterations, cost=cost, misses=misses, lag=lag)


def _check_shapes(arrays: dict[str, np.ndarray]) -> None:
    knots = len(arrays["times"])
    for name, shape in _ARRAYS.items():
        rows = knots if name in ("times", "q", "v", "p_feet") else knots - 1
        wanted = (rows, *shape[1:])
        array = arrays[name]
        if array.shape != wanted or not np.isfinite(array).all():
            raise MotionError(
                f"a dynamic trajectory's {name} must be finite and {wanted}, it is {array.shape}"
            )


COM, ATTITUDE, JOINTS, FEET = slice(0, 3), slice(3, 6), slice(6, 18), slice(18, 30)
"""Columns of ``pieces``: CoM [m], roll, pitch, yaw [rad], joints [rad], feet's centres [m]."""
_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


def pieces(trajectory: DynamicTrajectory, model: RobotModel) -> PPoly:
    """Cubics from knot to knot of CoM, attitude, joints and feet: (30,), in the plan's frame.

    Positions and rates are continuous, accelerations change at knots only. Roll, pitch and yaw
    pass through all angles; they are not to be used within a few degrees of a vertical trunk.
    """
    cubics = CubicHermiteSpline(trajectory.times, *sampled(trajectory, model))
    return PPoly(cubics.c, cubics.x)


def sampled(
    trajectory: DynamicTrajectory, model: RobotModel
) -> tuple[Float[np.ndarray, "n1 30"], Float[np.ndarray, "n1 30"]]:
    """Values and rates of what ``pieces`` gives, at the knots; whole turns add up."""
    pin_model, data = model.pin_model, model.pin_model.createData()
    q, v = centred(trajectory, model), trajectory.v
    values, rates = np.empty((len(q), 30)), np.empty((len(q), 30))
    for row in range(len(q)):
        pin.centerOfMass(pin_model, data, q[row], v[row])
        values[row, COM], rates[row, COM] = data.com[0], data.vcom[0]
        R = pin.Quaternion(q[row, 3:7]).toRotationMatrix()
        values[row, ATTITUDE] = rpy = pin.rpy.matrixToRpy(R)
        rates[row, ATTITUDE] = pin.rpy.computeRpyJacobianInverse(rpy) @ v[row, 3:6]
    values[:, ATTITUDE] = np.unwrap(values[:, ATTITUDE], axis=0)
    values[:, JOINTS], rates[:, JOINTS] = q[:, 7:], v[:, 6:]
    places, velocities = feet_at(q, v, model)
    values[:, FEET], rates[:, FEET] = places.reshape(-1, 12), velocities.reshape(-1, 12)
    return values, rates


def feet_at(
    q: Float[np.ndarray, "n 19"], v: Float[np.ndarray, "n 18"], model: RobotModel
) -> tuple[Float[np.ndarray, "n 4 3"], Float[np.ndarray, "n 4 3"]]:
    """Places [m] and velocities [m/s] of the feet's centres, in the frame in which ``q`` is."""
    pin_model, data = model.pin_model, model.pin_model.createData()
    frames = [pin_model.getFrameId(name) for name in FOOT_NAMES]
    places, velocities = np.empty((len(q), 4, 3)), np.empty((len(q), 4, 3))
    for row in range(len(q)):
        pin.forwardKinematics(pin_model, data, q[row], v[row])
        pin.updateFramePlacements(pin_model, data)
        for leg, frame in enumerate(frames):
            velocity = pin.getFrameVelocity(pin_model, data, frame, _ALIGNED)
            places[row, leg], velocities[row, leg] = data.oMf[frame].translation, velocity.linear
    return places, velocities


def centred(trajectory: DynamicTrajectory, model: RobotModel) -> Float[np.ndarray, "n1 19"]:
    """Configurations to which the knots' velocities belong: half a step back from the solver's."""
    q = trajectory.q.copy()
    for row, dt in enumerate(np.diff(trajectory.times).tolist(), start=1):
        q[row] = pin.integrate(model.pin_model, q[row], -0.5 * dt * trajectory.v[row])
    return q
