"""Writes a scene to start from: the robot, a box on its back, a ramp, and keyframes."""

from __future__ import annotations

import re
from collections.abc import Mapping

import mujoco
import numpy as np
from jaxtyping import Float

from go2_wbc.plant.mujoco.model import JointDynamics, build_spec
from go2_wbc.plant.mujoco.setup import DEFAULT_FRICTION
from go2_wbc.robot.description import BASE_LINK, find_description

RAMP_PITCH = np.deg2rad(10.0)
RAMP_START, RAMP_HALF_SIZE = 0.6, (1.0, 0.6, 0.02)
"""m; from where on it rises ahead of the robot, and half its length, width and height."""
RAMP_MIDDLE = (RAMP_START + np.cos(RAMP_PITCH), 0.0, np.sin(RAMP_PITCH))  #: m; of its upper side
_BOX_MASS, _BOX_PLACE, _BOX_HALF_SIZE = 2.0, (0.0, 0.0, 0.10), (0.10, 0.06, 0.04)
_NOTES = {
    "<mujoco ": """A Go2 with a box on its back, before a ramp. Lengths in m, masses in kg, angles
     in rad. MujocoPlant("FILE") begins lying, MujocoPlant("FILE", keyframe="ramp") in a stance.""",
    '<geom name="ramp"': "The ramp: pos and quat (w x y z) of its middle, half its size.",
    '<body name="box"': "The box on the back: pos in the base's frame, half its size, mass.",
    "<keyframe>": """Where it may begin. qpos: place of the base, its quaternion w x y z,
       then hip, thigh, calf of FL, FR, RL, RR.""",
}
"""What is said above each part."""


def starter_scene(stances: Mapping[str, Float[np.ndarray, "19"]]) -> str:
    """MJCF with a keyframe for each of the configurations (quaternion x y z w).

    The meshes are those of the installed robot, by absolute paths.
    """
    spec = build_spec(find_description(), JointDynamics(), friction=DEFAULT_FRICTION)
    box = spec.body(BASE_LINK).add_body(name="box", pos=list(_BOX_PLACE))
    kind = mujoco.mjtGeom.mjGEOM_BOX
    box.add_geom(name="box", type=kind, size=list(_BOX_HALF_SIZE), mass=_BOX_MASS)
    normal = np.array([-np.sin(RAMP_PITCH), 0.0, np.cos(RAMP_PITCH)])
    spec.worldbody.add_geom(
        name="ramp",
        type=kind,
        pos=(RAMP_MIDDLE - RAMP_HALF_SIZE[2] * normal).tolist(),
        quat=[np.cos(0.5 * RAMP_PITCH), 0.0, -np.sin(0.5 * RAMP_PITCH), 0.0],
        size=list(RAMP_HALF_SIZE),
        friction=[DEFAULT_FRICTION, 0.005, 0.0001],
    )
    for name, q in stances.items():
        spec.add_key(name=name, qpos=[*q[:3], *q[[6, 3, 4, 5]], *q[7:]])
    spec.compile()
    text = spec.to_xml()
    for place, note in _NOTES.items():
        text = re.sub(f"^( *)(?={place})", rf"\1<!-- {note} -->\n\1", text, flags=re.MULTILINE)
    return text
