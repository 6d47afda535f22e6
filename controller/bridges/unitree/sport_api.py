"""Unitree's sport service in names and numbers (unitree_sdk2, ``go2/sport`` and ``rpc``).

Unitree has renumbered its procedures more than once. These are the ids of robots from V1.1.6 on,
from ``unitree_sdk2py/go2/sport/sport_api.py`` of unitree_sdk2_python, which also keeps some older
ones: 1018, 1026, 1033. ``BodyHeight`` (1013) is of the clients before those.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise
from typing import Any, Final

from go2_wbc.errors import CommandError

SPORT_SERVICE: Final = "sport"
SWITCHER_SERVICE: Final = "motion_switcher"
API_VERSION: Final = "1.0.0.1"
LEASE_TERM: Final = 1.0  #: Time [s] for which a lease holds without renewal


class Api(IntEnum):
    """Procedures that are known here, and those of every service.

    Which of them a robot does depends on the library's motions and on the gaits that there are.
    """

    VERSION = 1
    LEASE_APPLY = 101
    LEASE_RENEWAL = 102
    DAMP = 1001
    BALANCE_STAND = 1002
    STOP_MOVE = 1003
    STAND_UP = 1004
    STAND_DOWN = 1005
    RECOVERY_STAND = 1006
    EULER = 1007
    MOVE = 1008
    SIT = 1009
    RISE_SIT = 1010
    BODY_HEIGHT = 1013
    SPEED_LEVEL = 1015
    HELLO = 1016
    STRETCH = 1017
    TRAJECTORY_FOLLOW = 1018
    CONTENT = 1020
    DANCE1 = 1022
    DANCE2 = 1023
    GET_SPEED_LEVEL = 1026
    POSE = 1028
    SCRAPE = 1029
    FRONT_JUMP = 1031
    FRONT_POUNCE = 1032
    WIGGLE_HIPS = 1033
    HEART = 1036
    STATIC_WALK = 1061
    TROT_RUN = 1062
    FREE_BOUND = 2046
    CROSS_STEP = 2051
    AUTO_RECOVERY_SET = 2054
    AUTO_RECOVERY_GET = 2055


class SwitcherApi(IntEnum):
    """Procedures of the service that hands the robot to low-level control."""

    CHECK_MODE = 1001
    SELECT_MODE = 1002
    RELEASE_MODE = 1003


class Code(IntEnum):
    """What a response carries."""

    OK = 0
    API_TIMEOUT = 3104
    INTERNAL = 3202
    NOT_SUPPORTED = 3203
    BAD_PARAMETER = 3204
    LEASE_DENIED = 3205
    LEASE_NOT_EXIST = 3206
    LEASE_EXIST = 3207
    ACTION_TIMEOUT = 4201
    NOT_READY = 4205
    POSE_REFUSED = 4206


class SportMode(IntEnum):
    """``mode`` of ``rt/sportmodestate``."""

    IDLE = 0
    BALANCE_STAND = 1
    POSE = 2
    LOCOMOTION = 3
    LIE_DOWN = 5
    JOINT_LOCK = 6
    DAMPING = 7
    RECOVERY_STAND = 8
    SIT = 10


@dataclass(frozen=True, slots=True)
class SportStatus:
    """What the sport service says of itself in ``rt/sportmodestate``."""

    mode: SportMode = SportMode.DAMPING  #: see ``SportMode``
    is_acting: bool = False  #: whether an action is running
    is_trotting: bool = False  #: whether the robot is in walking mode
    error_code: int = 0  #: of the last action that failed, 0 since one was done


MOVE_LEAST, MOVE_GREATEST = (-2.5, -1.0, -4.0), (3.8, 1.0, 4.0)
"""Of ``Move``: forward, left [m/s], turning left [rad/s]."""
HEIGHT_LEAST, HEIGHT_GREATEST = -0.18, 0.03  #: Of ``BodyHeight``: from the usual height [m]
EULER_LIMITS: Final = (0.75, 0.75, 0.6)  #: Of ``Euler``: roll, pitch, yaw [rad], either way
SPEED_LEVELS: Final[Mapping[int, float]] = {-1: 0.4, 0: 0.7, 1: 1.0}
"""Share of the walking envelope for ``Move``, by ``SpeedLevel``; ours, not the firmware's."""
FAR: Final = 1e6  #: No number of a parameter is as large: a mistake, infinity or not a number
PATH_POINTS: Final = 30
"""Points of a path: unitree_sdk2_python sends as many (``SPORT_PATH_POINT_SIZE``)."""
PATH_FIELDS: Final = ("t_from_start", "x", "y", "yaw", "vx", "vy", "vyaw")
"""What a point of a path says, in its JSON's words (``SportClient.TrajectoryFollow``)."""


def vector(parameter: str) -> tuple[float, float, float]:
    """``x``, ``y`` and ``z`` of a parameter; CommandError unless they are finite numbers."""
    x, y, z = _numbers(_fields(parameter), "xyz")
    return x, y, z


def path_points(parameter: str) -> list[list[float]]:
    """The points of a path, a row of ``PATH_FIELDS`` each; CommandError if they make none."""
    points = _parsed(parameter)
    if not isinstance(points, list) or not 1 <= len(points) <= PATH_POINTS:
        raise CommandError(f"a path must be a list of 1 to {PATH_POINTS} points")
    if not all(isinstance(point, dict) for point in points):
        raise CommandError(f"a point of a path must have {', '.join(PATH_FIELDS)}")
    rows = [_numbers(point, PATH_FIELDS) for point in points]
    times = [row[0] for row in rows]
    if not all(a < b for a, b in pairwise([-math.ulp(0.0), *times])):
        raise CommandError(f"t_from_start must begin at 0 or later and rise, got {times}")
    return rows


def flag(parameter: str) -> bool:
    """``data`` of a parameter as a truth value; CommandError if it is none."""
    value = _fields(parameter).get("data")
    if not isinstance(value, int):
        raise CommandError(f"data must be true or false, got {value!r}")
    return bool(value)


def level(parameter: str) -> int:
    """``data`` of a parameter as a speed level; CommandError if it is none."""
    value = _fields(parameter).get("data")
    if type(value) is not int or value not in SPEED_LEVELS:
        raise CommandError(f"data must be one of {sorted(SPEED_LEVELS)}, got {value!r}")
    return value


def height(parameter: str) -> float:
    """``data`` of a parameter as a height; CommandError if it is none, or out of range."""
    (value,) = _numbers(_fields(parameter), ("data",))
    if not HEIGHT_LEAST <= value <= HEIGHT_GREATEST:
        raise CommandError(f"data must be {HEIGHT_LEAST} to {HEIGHT_GREATEST} m, got {value}")
    return value


def answer(value: bool | int) -> str:
    """What a response says of one value."""
    return json.dumps({"data": value})


def _numbers(fields: Mapping[str, Any], names: Iterable[str]) -> list[float]:
    values: dict[str, Any] = {name: fields.get(name) for name in names}
    if not all(type(value) in (int, float) and abs(value) < FAR for value in values.values()):
        raise CommandError(f"{', '.join(values)} must be finite numbers, got {values}")
    return [float(value) for value in values.values()]


def _fields(parameter: str) -> Mapping[str, Any]:
    fields = _parsed(parameter or "{}")
    if not isinstance(fields, dict):
        raise CommandError(f"the parameter must be a JSON object, got {fields!r}")
    return fields


def _parsed(parameter: str) -> object:
    try:
        return json.loads(parameter)
    except (ValueError, RecursionError) as error:
        raise CommandError(f"the parameter is not JSON: {error}") from error
