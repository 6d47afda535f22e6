"""Reads an exported page back: the packed data, the scene, and its own forward kinematics."""

import base64
import gzip
import json
import re
from typing import Any

import numpy as np


def packed_parts(page: str) -> dict[str, bytes]:
    """The unpacked contents of the page's data blocks, by id."""
    blocks = re.findall(r'<script type="text/plain" id="([\w-]+)">([^<]*)</script>', page)
    return {name: gzip.decompress(base64.b64decode(text)) for name, text in blocks}


def read_data(page: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Header and arrays of scene and replay together, quantised arrays in their unit."""
    parts = packed_parts(page)
    scene, replay = read_pack(parts["replay-scene"]), read_pack(parts["replay-data"])
    return {**scene[0], **replay[0]}, {**scene[1], **replay[1]}


def read_pack(content: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Header and arrays of one unpacked block."""
    length = int.from_bytes(content[:4], "little")
    header = json.loads(content[4 : 4 + length])
    start = -(-(4 + length) // 8) * 8
    arrays = {}
    for name, entry in header["arrays"].items():
        count = int(np.prod(entry["shape"]))
        kind = np.dtype(entry["type"].removesuffix("Array").lower())
        raw = np.frombuffer(content, kind, count, start + entry["offset"])
        array = raw.reshape(entry["shape"])
        if "low" in entry:
            array = np.array(entry["low"]) + np.array(entry["scale"]) * array
        arrays[name] = array
    return header, arrays


def read_message(message: bytes, known: bytes = b"") -> tuple[dict[str, Any], bytes]:
    """What a page is told, and the block that it makes of the one that it has."""
    length = int.from_bytes(message[:4], "little")
    told, sent = json.loads(message[4 : 4 + length]), message[4 + length :]
    whole = b""
    for start, first, count in told["copies"]:
        gap, sent = sent[: start - len(whole)], sent[start - len(whole) :]
        whole += gap + known[first : first + count]
    assert len(whole + sent) == told["size"]
    return told, whole + sent


def transforms(header: dict[str, Any]) -> dict[str, np.ndarray]:
    """Fixed transform of each node that a recorded command sets, by path."""
    return {
        command["path"].removeprefix("/meshcat/"): np.reshape(command["matrix"], (4, 4)).T
        for command in header["commands"]
        if command["type"] == "set_transform"
    }


def placement(header: dict[str, Any], path: str, q: np.ndarray) -> np.ndarray:
    """World transform of a node in configuration q, as the page's scene tree makes it."""
    fixed = transforms(header)
    turning = {
        joint["path"]: (joint["axis"], angle)
        for joint, angle in zip(header["joints"], q[7:], strict=True)
    }
    result, node = np.eye(4), ""
    for name in path.split("/"):
        node = f"{node}/{name}".lstrip("/")
        if node == header["base"]:
            result = result @ _pose(q)
        elif node in turning:
            result = result @ _turn(*turning[node])
        elif node in fixed:
            result = result @ fixed[node]
    return result


def _pose(q: np.ndarray) -> np.ndarray:
    x, y, z, w = q[3:7]
    angle = 2 * np.arctan2(np.linalg.norm([x, y, z]), w)
    axis = np.array([x, y, z]) / max(np.linalg.norm([x, y, z]), 1e-12)
    result = _turn(axis, angle)
    result[:3, 3] = q[:3]
    return result


def _turn(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues' formula."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    result = np.eye(4)
    result[:3, :3] += np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    return result
