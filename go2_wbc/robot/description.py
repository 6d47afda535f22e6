"""Finds a robot's real URDF, SRDF and meshes, and checks that they describe such a robot.

Every model of the project (Pinocchio, MuJoCo, PlaCo, meshcat) is built from the files named here,
so that any two of them can be compared number by number.

What no URDF says of a robot stands in its profile, ``profiles/NAME.toml``, which names its files.
"""

from __future__ import annotations

import math
import sys
import tomllib
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from go2_wbc.brief import brief
from go2_wbc.errors import ConfigError, DescriptionError, unknown_name
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES
from go2_wbc.records import V3, Array3, Array6, Array12, ArrayNx3

GO2 = "go2"  #: Name of the robot where none is given
FOLDER = Path(__file__).with_name("profiles")
SPLAY = 0.3
"""Angle [rad] of hips that put the feet beside them, so that the folded legs carry nothing."""


@dataclass(frozen=True, slots=True)
class RobotProfile:
    """A robot, beside its URDF. Triples of joints are hip, thigh, calf."""

    name: str  #: what ``robot=`` takes
    title: str  #: what people call it
    description: str  #: its folder in the ``example-robot-data`` package
    foot_radius: float  #: radius [m] of the spherical feet
    hip_limit: float  #: angle [rad] beyond which no hip is turned, if the URDF's range is wider
    imu_place: V3  #: place [m] of the IMU in the base frame
    armature: V3  #: rotor inertia seen at the joints [kg m^2]
    damping: V3  #: viscous friction of simulated joints [N m s/rad]
    friction_loss: V3  #: their dry friction [N m]
    knee_share: float
    """Speed from which a driving motor's torque falls, as a share of the speed without load
    (``robot.motor``)."""
    envelope: tuple[float, float, float, float]
    """Speeds ahead, back, aside [m/s] and turning rate [rad/s] within which it trots in simulation
    where nothing is configured."""
    stand_height: float  #: height [m] of the CoM above the ground when standing
    sit: tuple[float, float]
    """Height [m] of the base and pitch [rad] of the dog-like sit: rump down, front legs up."""
    lie_height: float  #: height [m] of the base just above the ground, from which it goes limp
    tucked: V3  #: joint angles [rad] with the feet under the hips and the belly on the ground
    underside: tuple[V3, ...]
    """Points [m] of the trunk in the base frame that touch flat ground first, within 1 cm, at tilts
    up to 60 deg."""
    motions: Mapping[str, Mapping[str, float]] = field(default_factory=dict, hash=False)
    """Arguments that motions of the library are given unless told otherwise, by motion."""
    config: Mapping[str, Any] = field(default_factory=dict, hash=False)
    """Tables of the configuration (``go2_wbc.config``) that are other than the usual."""

    __repr__ = brief

    @property
    def stand_pose(self) -> Array6:
        """CoM position [m] in the motion's frame, then roll, pitch, yaw [rad], when standing."""
        return np.array([0.0, 0.0, self.stand_height, 0.0, 0.0, 0.0])

    @property
    def sit_pose(self) -> Array6:
        """Base position [m] and roll, pitch, yaw [rad] when sitting."""
        return np.array([0.0, 0.0, self.sit[0], 0.0, self.sit[1], 0.0])

    @property
    def lie_pose(self) -> Array6:
        """Base position [m] and roll, pitch, yaw [rad] just above lying."""
        return np.array([0.0, 0.0, self.lie_height, 0.0, 0.0, 0.0])

    @property
    def tucked_joints(self) -> Array12:
        """Joint angles [rad] with the legs folded below the trunk."""
        return np.tile(self.tucked, 4)

    @property
    def splayed_joints(self) -> Array12:
        """Joint angles [rad] with the folded legs beside the trunk."""
        return self.tucked_joints + np.tile([SPLAY, 0.0, 0.0, -SPLAY, 0.0, 0.0], 2)

    @property
    def underside_points(self) -> ArrayNx3:
        """``underside`` as an array."""
        return np.array(self.underside)


def profile_names() -> tuple[str, ...]:
    """The robots that ship."""
    return tuple(sorted(file.stem for file in FOLDER.glob("*.toml")))


@cache
def find_profile(name: str = GO2) -> RobotProfile:
    """The profile of a robot that ships.

    Raises:
        ConfigError: for an unknown one; lists the valid ones.
    """
    if name not in profile_names():
        raise ConfigError(unknown_name("robot", str(name), profile_names()))
    values = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    numbers: dict[str, Any] = {key: _tuples(value) for key, value in values.items()}
    return RobotProfile(name=name, **numbers)


def _tuples(value: object) -> object:
    return tuple(_tuples(part) for part in value) if isinstance(value, list) else value


BASE_LINK = "base"
INSTALL_LINE = "pip install example-robot-data"
_SHARE = Path("cmeel.prefix") / "share"
_ROBOTS = Path("example-robot-data") / "robots"
_PACKAGE_PREFIX = "package://"
_UNPAINTED = (171, 177, 197, 255)  # a part without a material gets the trunk's grey


@dataclass(frozen=True, slots=True)
class RobotDescription:
    """Where the robot's files are, and the few facts that every model of it needs."""

    profile: RobotProfile  #: what the URDF does not say of the robot
    urdf_path: Path  #: of the URDF
    srdf_path: Path | None  #: of the SRDF, or None if there is none
    package_dirs: tuple[Path, ...]
    """Folders against which ``package://`` mesh names resolve, first match wins."""
    disabled_pairs: tuple[tuple[str, str], ...]
    """Pairs of links that the SRDF excludes from collision."""
    efforts: tuple[float, ...]  #: limit of each joint [N m], in the order of ``JOINT_NAMES``
    speeds: tuple[float, ...]  #: limit of each joint [rad/s], in the same order
    mass: float  #: of all links [kg]
    origins: tuple[tuple[float, ...], ...]
    """Of each joint in the frame of the one above it [m], in the order of ``JOINT_NAMES``; those of
    hips in the frame of the base."""

    __repr__ = brief

    def distance(self, first: str, second: str) -> float:
        """Between two neighbouring joints of a leg, or two hips [m]."""
        one, other = (self.origins[JOINT_NAMES.index(name)] for name in (first, second))
        is_hip = second.endswith("hip_joint")
        return math.dist(one, other) if is_hip else math.hypot(*other)

    def mesh_path(self, filename: str) -> Path:
        """The file that a mesh name of the URDF means.

        Args:
            filename: a ``package://`` name, or a path absolute or relative to the URDF.

        Raises:
            DescriptionError: if no such file exists.
        """
        if filename.startswith(_PACKAGE_PREFIX):
            relative = filename.removeprefix(_PACKAGE_PREFIX)
            candidates = [folder / relative for folder in self.package_dirs]
        else:
            candidates = [self.urdf_path.parent / filename.removeprefix("file://")]
        for path in candidates:
            if path.is_file():
                return path
        tried = ", ".join(map(str, candidates))
        raise DescriptionError(f"{self.urdf_path}: mesh {filename!r} not found; tried {tried}")


def find_description(urdf: Path | str | None = None, robot: str = GO2) -> RobotDescription:
    """The description of a robot: the installed one, or a user's own URDF of it.

    A user's URDF uses the SRDF beside it (``<name>.srdf`` or ``../srdf/<name>.srdf``), else the
    installed SRDF, if any.

    Args:
        urdf: a user's URDF; ``None`` takes the one of the ``example-robot-data`` wheel.
        robot: name of its profile.

    Raises:
        ConfigError: for an unknown robot.
        DescriptionError: if files are missing, unreadable, or lack a joint or foot of the robot.
    """
    profile = find_profile(robot)
    share, installed = _find_share(profile), _ROBOTS / profile.description
    if urdf is None:
        if share is None:
            raise DescriptionError(
                f"no {profile.title} description in this environment; {INSTALL_LINE}"
            )
        urdf = share / installed / "urdf" / f"{robot}.urdf"
    urdf = Path(urdf).resolve()
    own = () if share is not None and urdf.is_relative_to(share) else tuple(urdf.parents)
    root = _parse(urdf, "URDF")
    _check_names(urdf, root, profile)
    _check_masses(urdf, root)
    efforts, speeds = _joint_limits(urdf, root)
    srdf = _find_srdf(urdf, None if share is None else share / installed / "srdf" / f"{robot}.srdf")
    return RobotDescription(
        profile=profile,
        urdf_path=urdf,
        srdf_path=srdf,
        package_dirs=own if share is None else (share, *own),
        disabled_pairs=() if srdf is None else parse_disabled_pairs(srdf),
        efforts=efforts,
        speeds=speeds,
        mass=sum(_number(m.get("value")) for m in root.iterfind("link/inertial/mass")),
        origins=_joint_origins(root),
    )


def parse_disabled_pairs(srdf: Path) -> tuple[tuple[str, str], ...]:
    """The pairs of links between which an SRDF disables collision.

    Raises:
        DescriptionError: if the file is missing or broken.
    """
    rows = _parse(srdf, "SRDF").iter("disable_collisions")
    return tuple((row.get("link1", ""), row.get("link2", "")) for row in rows)


def _find_share(profile: RobotProfile) -> Path | None:
    for entry in sys.path:
        share = Path(entry) / _SHARE
        if (share / _ROBOTS / profile.description / "urdf" / f"{profile.name}.urdf").is_file():
            return share.resolve()
    return None


def _find_srdf(urdf: Path, installed: Path | None) -> Path | None:
    name = f"{urdf.stem}.srdf"
    candidates = [urdf.parent / name, urdf.parent.parent / "srdf" / name]
    if installed is not None:
        candidates.append(installed)
    return next((path for path in candidates if path.is_file()), None)


def _parse(path: Path, kind: str) -> ET.Element:
    try:
        root = ET.parse(path).getroot()
    except OSError as error:
        reason = error.strerror or error
        raise DescriptionError(f"cannot read the {kind} {path}: {reason}") from error
    except ET.ParseError as error:
        raise DescriptionError(f"{path} is not a valid {kind}: {error}") from error
    if root.tag != "robot":
        raise DescriptionError(f"{path} is not a {kind}: its root is <{root.tag}>, not <robot>")
    return root


def _check_names(urdf: Path, root: ET.Element, profile: RobotProfile) -> None:
    joints = {joint.get("name") for joint in root.findall("joint")}
    links = {link.get("name") for link in root.findall("link")}
    lacking = [f"joint {name}" for name in JOINT_NAMES if name not in joints]
    lacking += [f"link {name}" for name in (BASE_LINK, *FOOT_NAMES) if name not in links]
    if lacking:
        listing = ", ".join(lacking)
        raise DescriptionError(f"{urdf} does not describe a {profile.title}; it lacks: {listing}")


def _joint_limits(urdf: Path, root: ET.Element) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Efforts and speeds of the twelve joints, which must turn between two angles."""
    joints = {joint.get("name"): joint for joint in root.findall("joint")}
    efforts, speeds = list[float](), list[float]()
    for name in JOINT_NAMES:
        kind, limit = joints[name].get("type"), joints[name].find("limit")
        if kind != "revolute":
            raise DescriptionError(f"{urdf}: joint {name} must be revolute, it is {kind}")
        texts = {} if limit is None else limit.attrib
        lower, upper = _number(texts.get("lower")), _number(texts.get("upper"))
        if not lower < upper:
            raise DescriptionError(f"{urdf}: joint {name} has no range: {lower:g} to {upper:g} rad")
        for what, values in (("effort", efforts), ("velocity", speeds)):
            values.append(_number(texts.get(what)))
            if not values[-1] > 0.0:
                message = f"{urdf}: joint {name} has no valid {what} limit ({texts.get(what)!r})"
                raise DescriptionError(message)
    return tuple(efforts), tuple(speeds)


def _joint_origins(root: ET.Element) -> tuple[tuple[float, ...], ...]:
    origins = {joint.get("name"): joint.find("origin") for joint in root.findall("joint")}
    texts = [None if (o := origins[name]) is None else o.get("xyz") for name in JOINT_NAMES]
    return tuple(tuple(map(_number, (text or "0 0 0").split())) for text in texts)


def _check_masses(urdf: Path, root: ET.Element) -> None:
    for link in root.findall("link"):
        mass = link.find("inertial/mass")
        if mass is not None and not _number(mass.get("value")) >= 0.0:
            raise DescriptionError(
                f"{urdf}: link {link.get('name')} has no valid mass ({mass.get('value')!r})"
            )


def _number(text: str | None) -> float:
    """The finite number that ``text`` means, or nan."""
    try:
        value = float(text or "nan")
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


@dataclass(frozen=True, slots=True)
class MeshPart:
    """All faces of a mesh file that have one colour."""

    points: ArrayNx3  #: (n, 3) vertices [m] in the frame of the file
    triangles: Int[np.ndarray, "m 3"]  #: (m, 3) rows of them
    rgba: tuple[float, ...]  #: red, green, blue, opacity in 0..1


def solid(kind: str, size: Array3, rgba: tuple[float, ...]) -> MeshPart | None:
    """A simple shape about its middle; None of a kind that is not known here.

    Args:
        kind: "box" with half edges as size [m], "sphere" with a radius, "cylinder" or "capsule"
            with a radius and half the length along z.
        size: of it.
        rgba: its colour.
    """
    from trimesh import creation

    match kind:
        case "box":
            mesh = creation.box([2.0 * edge for edge in size])
        case "sphere":
            mesh = creation.icosphere(2, size[0])
        case "cylinder":
            mesh = creation.cylinder(size[0], 2.0 * size[1])
        case "capsule":
            mesh = creation.capsule(2.0 * size[1], size[0])
        case _:
            return None
    return MeshPart(np.array(mesh.vertices), np.array(mesh.faces), rgba)


def is_urdf(path: Path | str) -> bool:
    """Whether a file is a URDF; MuJoCo's are XML, too."""
    try:
        return ET.parse(path).getroot().tag == "robot"
    except ET.ParseError:
        return False


def read_mesh(path: Path) -> tuple[MeshPart, ...]:
    """The parts of a mesh file, COLLADA or another, one for each colour.

    Raises:
        DescriptionError: if the file cannot be read or holds no triangles.
    """
    import trimesh  # takes long, and is needed only where somebody looks at the robot
    from trimesh.visual import TextureVisuals

    try:
        scene: Any = trimesh.load_scene(path)
    except (OSError, ValueError) as error:
        raise DescriptionError(f"cannot read the mesh {path}: {error}") from error
    parts = []
    for mesh in scene.dump():
        is_painted = isinstance(mesh.visual, TextureVisuals)
        color = mesh.visual.material.main_color if is_painted else _UNPAINTED
        rgba = tuple(float(value) / 255.0 for value in color)
        if len(mesh.faces):
            parts.append(MeshPart(np.array(mesh.vertices), np.array(mesh.faces), rgba))
    if not parts:
        raise DescriptionError(f"the mesh {path} holds no triangles")
    return tuple(parts)
