"""A recording as an MCAP file, in the messages that Foxglove draws (their JSON schemas).

``/tf`` has the links, ``/joint_states`` angles, speeds and torques, ``/base`` pose and velocity,
``/feet`` forces and planned contacts, ``/com`` the centre of mass, ``/label`` what was done.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from mcap.writer import Writer

from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.recording import Recording
from viz.render.robot_meshes import visuals_of
from viz.replay.page_data import BASE, WORLD, label_starts, links_of

DIGITS = 6  #: After the point of every number: um, urad
_INFO = 2  #: Level of a ``foxglove.Log``


def mcap_of(recording: Recording) -> bytes:
    """The file's content; times are those of the plant."""
    stream = io.BytesIO()
    writer, channels = Writer(stream), dict[str, int]()
    writer.start(library="go2-wbc")

    def add(topic: str, kind: str, time: int, message: Mapping[str, Any]) -> None:
        if topic not in channels:
            schema = json.dumps(_schema(message)).encode()
            number = writer.register_schema(name=kind, encoding="jsonschema", data=schema)
            channels[topic] = writer.register_channel(topic, "json", number)
        writer.add_message(channels[topic], time, json.dumps(message).encode(), time)

    times, starts = np.rint(1e9 * recording.time).astype(int).tolist(), label_starts(recording)
    links = links_of(visuals_of(recording).model, recording.q)
    for row, time in enumerate(times):
        stamp: Mapping[str, Any] = {"sec": time // 10**9, "nsec": time % 10**9}
        transforms = [
            {
                "timestamp": stamp,
                "parent_frame_id": link.parent,
                "child_frame_id": link.name,
                "translation": _xyz(link.p[row]),
                "rotation": _xyz(link.quaternion[row]),
            }
            for link in links
        ]
        add("/tf", "foxglove.FrameTransforms", time, {"transforms": transforms})
        for topic, (kind, message) in _messages(recording, row).items():
            add(topic, kind, time, {"timestamp": stamp, **message})
        if row in starts:
            told = {"message": recording.labels[row], "name": "label", "file": "", "line": 0}
            add("/label", "foxglove.Log", time, {"timestamp": stamp, "level": _INFO, **told})
    writer.finish()
    return stream.getvalue()


def _messages(recording: Recording, row: int) -> dict[str, tuple[str, Mapping[str, Any]]]:
    """Kind and content of what is told of a sample, by topic."""
    q, v = recording.q[row], recording.v[row]
    motion = np.round([q[7:], v[6:], recording.tau[row]], DIGITS).T.tolist()
    margin = round(float(recording.support_margin[row]), DIGITS)
    feet = zip(recording.foot_forces[row].tolist(), recording.stance[row].tolist(), strict=True)
    base = {
        "frame_id": WORLD,
        "body_frame_id": BASE,
        "pose": {"position": _xyz(q[:3]), "orientation": _xyz(q[3:7])},
        "linear_velocity": _xyz(v[:3]),
        "angular_velocity": _xyz(v[3:6]),
    }
    joints = [
        {"name": name, "position": position, "velocity": velocity, "effort": effort}
        for name, (position, velocity, effort) in zip(JOINT_NAMES, motion, strict=True)
    ]
    loads: dict[str, Any] = {
        leg.name: {"force": round(force, DIGITS), "stance": stance}
        for leg, (force, stance) in zip(LEGS, feet, strict=True)
    }
    place = {
        "position": _xyz(recording.p_world_com[row]),
        "support_margin": None if np.isnan(margin) else margin,
    }
    return {
        "/base": ("foxglove.Odometry", base),
        "/joint_states": ("foxglove.JointStates", {"joints": joints}),
        "/feet": ("go2_wbc.Feet", loads),
        "/com": ("go2_wbc.CentreOfMass", place),
    }


def _xyz(values: Float[np.ndarray, " k"]) -> dict[str, Any]:
    """A vector, or a quaternion x y z w."""
    return dict(zip("xyzw", np.round(values, DIGITS).tolist(), strict=False))


def _schema(value: object) -> dict[str, object]:
    """JSON Schema of what is like ``value``; None is a number that may be missing."""
    if isinstance(value, Mapping):
        return {"type": "object", "properties": {key: _schema(one) for key, one in value.items()}}
    if isinstance(value, str):
        return {"type": "string"}
    if isinstance(value, Sequence):
        return {"type": "array", "items": _schema(value[0])}
    kinds = {bool: "boolean", int: "integer", float: "number", type(None): ["number", "null"]}
    return {"type": kinds[type(value)]}
