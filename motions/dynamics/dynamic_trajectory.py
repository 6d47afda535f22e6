"""What a solver of dynamic motions finds: states, torques, forces and feedback at its knots."""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from dataclasses import dataclass, fields
from tokenize import TokenError

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.errors import MotionError

FORMAT = 1
"""Version of the files; others are refused."""
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
    """How far one thing is from where it was asked to be.

    Attributes:
        subject: "trunk" or the name of a foot.
        phase: label of the phase at whose end it was asked.
        time: [s] from the start.
        position: distance [m].
        angle: angle [rad], of the trunk, whole turns that were lost included; 0 of a foot.
    """

    subject: str
    phase: str
    time: float
    position: float
    angle: float

    def __str__(self) -> str:
        angle = "" if self.subject != "trunk" else f", {np.degrees(self.angle):.1f} deg"
        where = f" ({self.phase})" if self.phase else ""
        return f"{self.subject} at {self.time:.2f} s{where}: {1e3 * self.position:.0f} mm{angle}"


@dataclass(frozen=True, slots=True)
class DynamicTrajectory:
    """A motion of the whole robot that obeys its dynamics, in the frame of its problem.

    The frame has z up, x ahead, and its origin on the ground in the middle of the feet at the
    start. Row ``k`` of what has n rows holds from ``times[k]`` to ``times[k + 1]``.

    Attributes:
        times: (n+1,) knots [s], from 0.
        q: (n+1, 19) base position [m], quaternion x y z w, joint angles [rad].
        v: (n+1, 18) base linear [m/s] and angular velocity [rad/s] in the base frame, joints.
        tau: (n, 12) joint torques [N m].
        forces: (n, 4, 3) forces of the ground on the feet [N], in the problem's frame.
        stance: (n, 4) feet that stand.
        gains: (n, 12, 36) feedback of a state error (as Pinocchio's ``difference`` of planned and
            measured q, then of v) into torques: tau - gains @ error.
        p_feet: (n+1, 4, 3) centres of the feet [m].
        iterations: of the solver, over all its starts.
        cost: at the end.
        misses: what was asked at the phases' ends, and how far the plan is from it.
        lag: time [s] by which the plan is late against a motion that was written as a whole.
    """

    times: Float[np.ndarray, " n1"]
    q: Float[np.ndarray, "n1 19"]
    v: Float[np.ndarray, "n1 18"]
    tau: Float[np.ndarray, "n 12"]
    forces: Float[np.ndarray, "n 4 3"]
    stance: Bool[np.ndarray, "n 4"]
    gains: Float[np.ndarray, "n 12 36"]
    p_feet: Float[np.ndarray, "n1 4 3"]
    iterations: int
    cost: float
    misses: tuple[Miss, ...]
    lag: float = 0.0

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
