"""A recording as one picture: how the trunk moved, what the feet carried, what the motors gave."""

from __future__ import annotations

import matplotlib
import numpy as np
from jaxtyping import Bool, Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from go2_wbc.legs import LEGS
from go2_wbc.recording import Recording
from go2_wbc.robot.description import find_description
from go2_wbc.robot.rotations import rpy_from_quaternion
from viz.style import ACCENT, ALARM, INK, LEG_COLORS, MUTED, STYLE, TRACK

_SIZE = (10.0, 9.5)  # [inch]
_COLORS = (ACCENT, "#10b981", "#f59e0b")
_BAR = 0.035  # height of a foot's bar below the panel, as a share of the panel's


def recording_figure(recording: Recording) -> Figure:
    """Height, attitude and velocity of the trunk, forces of the feet, torques over limits.

    Of a leg the torque is that of the joint that is nearest its limit.
    """
    time, legs = recording.time - recording.time[0], [leg.name for leg in LEGS]
    attitude = np.degrees([rpy_from_quaternion(q)[:2] for q in recording.q[:, 3:7]])
    most = find_description(None, recording.robot).efforts
    torque = np.abs(recording.tau / most).reshape(-1, 4, 3).max(axis=2)
    rows = (
        ("height of the base [m]", recording.q[:, 2:3], ["z"], _COLORS),
        ("attitude [deg]", attitude, ["roll", "pitch"], _COLORS),
        ("velocity [m/s]", recording.v[:, :3], ["ahead", "left", "up"], _COLORS),
        ("foot forces [N]", recording.foot_forces, legs, LEG_COLORS),
        ("|torque| / limit", torque, legs, LEG_COLORS),
    )
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=_SIZE, layout="constrained")
        panels = figure.subplots(len(rows), sharex=True)
        for axes, (title, values, names, colors) in zip(panels, rows, strict=True):
            _draw(axes, time, values, dict(zip(names, colors, strict=False)))
            axes.set_title(title, loc="left", size=9.5, weight="bold", color=INK)
        height, *_, feet, torques = panels
        torques.axhline(1.0, color=ALARM, lw=0.9, ls=(0, (4, 3)))
        torques.set_xlabel("time [s]")
        _mark_stance(feet, time, recording.stance)
        for span in recording.spans():
            for axes in panels:
                axes.axvline(span.start, color=TRACK, lw=0.8, zorder=0)
            where = span.start, 0.04
            height.text(
                *where, f" {span.label}", color=MUTED, transform=height.get_xaxis_transform()
            )
    return figure


def _draw(
    axes: Axes,
    time: Float[np.ndarray, " n"],
    values: Float[np.ndarray, "n k"],
    names: dict[str, str],
) -> None:
    for column, (name, color) in zip(values.T, names.items(), strict=True):
        axes.plot(time, column, color=color, lw=1.1, label=name)
    if len(names) > 1:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(names), frameon=False)
    axes.margins(x=0.0)
    axes.spines[["top", "right"]].set_visible(False)


def _mark_stance(
    axes: Axes, time: Float[np.ndarray, " n"], stance: Bool[np.ndarray, "n 4"]
) -> None:
    """A bar below the panel for each foot, while it is planned to stand."""
    across = axes.get_xaxis_transform()
    for leg, color in zip(LEGS, LEG_COLORS, strict=True):
        top = -(leg + 0.5) * _BAR
        axes.fill_between(
            time,
            top - 0.7 * _BAR,
            top,
            stance[:, leg],
            color=color,
            lw=0,
            transform=across,
            clip_on=False,
        )
