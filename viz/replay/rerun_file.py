"""A recording as a file of Rerun's viewer: the robot as a tree of links, and its signals.

``world/base/FL_hip/FL_thigh/FL_calf`` and so on are the links, with their meshes; ``signals`` has a
plot each, in SI units, of velocities, joints, torques, feet and the support; ``label`` what was
done. All over the plant's time.
"""

from __future__ import annotations

import numpy as np
import rerun as rr

from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.recording import Recording
from viz.render.mesh import Surface
from viz.render.robot_meshes import visuals_of
from viz.replay.page_data import WORLD, label_starts, links_of

APPLICATION, TIMELINE = "go2_wbc", "time"
_FEET = [leg.name for leg in LEGS]
_JOINTS = [name.removesuffix("_joint") for name in JOINT_NAMES]


def rrd_of(recording: Recording) -> bytes:
    """The file's content."""
    stream = rr.RecordingStream(APPLICATION)
    memory = stream.memory_recording()
    times = [rr.TimeColumn(TIMELINE, duration=recording.time)]
    visuals = visuals_of(recording)
    stream.log(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    paths = [WORLD]
    for link in links_of(visuals.model, recording.q):
        paths.append(f"{next(path for path in paths if path.endswith(link.parent))}/{link.name}")
        columns = rr.Transform3D.columns(translation=link.p, quaternion=link.quaternion)
        stream.send_columns(paths[-1], times, columns)
    for number, item in enumerate(visuals.geometry.geometryObjects):
        surface = Surface.joined(visuals.meshes[item.meshPath]).placed(item.placement)
        stream.log(f"{paths[item.parentJoint]}/mesh{number}", _mesh(surface), static=True)
    for name, (values, parts) in _signals(recording).items():
        path = f"signals/{name}"
        stream.log(path, rr.SeriesLines(names=parts), static=True)
        rows = np.asarray(values, float).reshape(len(recording.time), -1)
        stream.send_columns(path, times, rr.Scalars.columns(scalars=rows))
    starts = label_starts(recording)
    begins = [rr.TimeColumn(TIMELINE, duration=recording.time[starts])]
    words = rr.TextLog.columns(text=[recording.labels[row] for row in starts])
    stream.send_columns("label", begins, words)
    return memory.drain_as_bytes() or b""


def _signals(recording: Recording) -> dict[str, tuple[np.ndarray, list[str]]]:
    """What is plotted, and the names of its lines."""
    v, xyz = recording.v, ["x", "y", "z"]
    return {
        "velocity": (v[:, :3], xyz),
        "angular_velocity": (v[:, 3:6], xyz),
        "joint_positions": (recording.q[:, 7:], _JOINTS),
        "joint_velocities": (v[:, 6:], _JOINTS),
        "torques": (recording.tau, _JOINTS),
        "foot_forces": (recording.foot_forces, _FEET),
        "stance": (recording.stance, _FEET),
        "centre_of_mass": (recording.p_world_com, xyz),
        "support_margin": (recording.support_margin, ["margin"]),
    }


def _mesh(surface: Surface) -> rr.Mesh3D:
    """The surface with a vertex of its own for each corner, since colours belong to triangles."""
    corners = surface.triangles.ravel()
    return rr.Mesh3D(
        vertex_positions=surface.points[corners],
        triangle_indices=np.arange(len(corners)).reshape(-1, 3),
        vertex_normals=surface.normals[corners],
        vertex_colors=np.repeat(surface.colors, 3, axis=0),
    )
