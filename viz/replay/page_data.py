"""What a page holds besides its code: the scene, once, and what happens in it."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from go2_wbc.legs import LEGS
from go2_wbc.robot.model import FOOT_RADIUS
from viz.content import ReplayContent, Verdict
from viz.palette import LEG_COLORS
from viz.render.posed_robot import PosedRobot
from viz.render.robot_meshes import load_robot_visuals
from viz.replay.meshcat_scene import robot_scene
from viz.replay.packing import Pack
from viz.replay.replay_data import ReplayFrames, reduced, replay_frames

_FORCE_PERCENTILE = 99.5  # a touchdown spike beyond it may be cut off in the contact strip
_LEAST_FORCE_SCALE = 50.0  # [N] a full row of the contact strip is at least this much


def scene_text() -> str:
    """The robot and the markers, packed: the same for every page."""
    pack = Pack()
    scene = robot_scene(load_robot_visuals(), pack)
    legs = {"legs": [leg.name for leg in LEGS], "leg_colors": LEG_COLORS}
    return pack.packed({**scene, **legs, "foot_radius": FOOT_RADIUS})


def content_text(content: ReplayContent, title: str, version: str = "") -> str:
    """What happens, packed; ``version`` tells one text of a live page from the next."""
    robot, pack = PosedRobot(load_robot_visuals()), Pack()
    frames = replay_frames(content.recording, robot)
    highest = float(np.percentile(frames.foot_forces, _FORCE_PERCENTILE))
    header: dict[str, object] = {
        "title": title,
        "version": version,
        "is_plan": content.is_plan,
        **_add_frames(pack, "", frames),
        "labels": [[s.start, s.end, s.label] for s in content.recording.spans()],
        "force_scale": max(highest, _LEAST_FORCE_SCALE),
        "beats": list(content.beats),
        "end_pose": content.end_pose,
        "has_sound": bool(content.sound),
        "sliders": [asdict(slider) for slider in content.sliders],
        "verdict": None,
        "ghost": None,
        "written": None,
    }
    if content.sound:
        pack.add("sound", np.frombuffer(content.sound, np.uint8))
    if content.verdict is not None:
        header["verdict"] = _add_verdict(pack, content.verdict)
    for name, other in (("ghost", content.ghost), ("written", content.written)):
        if other is not None:
            header[name] = _add_frames(pack, f"{name}.", replay_frames(other, robot))
    return pack.packed(header)


def _add_frames(pack: Pack, prefix: str, frames: ReplayFrames) -> dict[str, object]:
    pack.add_quantised(f"{prefix}q", frames.q)
    pack.add_quantised(f"{prefix}feet", frames.p_world_feet)
    pack.add_quantised(f"{prefix}com", frames.p_world_com)
    pack.add_quantised(f"{prefix}target", frames.p_world_camera_target)
    pack.add_quantised(f"{prefix}forces", frames.foot_forces)
    pack.add(f"{prefix}stance", frames.stance.astype(np.uint8))
    pack.add(f"{prefix}margin", frames.support_margin.astype(np.float32))
    pack.add(f"{prefix}torque", frames.torque_ratio.astype(np.float32))
    return {"rate": frames.rate, "frames": len(frames.q)}


def _add_verdict(pack: Pack, verdict: Verdict) -> dict[str, object]:
    curves = []
    for k, curve in enumerate(map(reduced, verdict.ranked())):
        pack.add(f"curve{k}.time", curve.time.astype(np.float32))
        pack.add(f"curve{k}.margin", curve.margin.astype(np.float32))
        pack.add(f"curve{k}.worst", curve.worst.astype(np.uint8))
        words = {"name": curve.name, "unit": curve.unit, "subjects": curve.subjects}
        curves.append({**words, "tight": float(curve.tight)})
    annotations = [asdict(annotation) for annotation in verdict.annotations]
    certified = verdict.certified
    return {
        "ok": verdict.ok,
        "text": verdict.text,
        "annotations": annotations,
        "curves": curves,
        "chance": verdict.chance,
        "world": verdict.world,
        "certified": None if certified is None else asdict(certified),
    }
