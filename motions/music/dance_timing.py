"""How well a dance was on the beat: what MuJoCo says that trunk and feet did, and when."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.legs import Leg
from go2_wbc.plant.mujoco.ground_truth import TOUCH, TruthRecording
from go2_wbc.robot.rotations import yaw_rotation
from motions.language.keys import BODY_CHANNELS
from motions.music.choreography import Dance
from motions.music.dance_moves import Accent

ON_THE_BEAT = 0.04
"""Distance [s] from a beat within which an accent is on it: one picture of a film (25 a second)."""
NEAR = 0.45
"""Share of a pulse, before and after it, in which its accent is looked for."""


@dataclass(frozen=True, slots=True)
class DancedAccents:
    """When the accents of a dance happened.

    Attributes:
        wanted: instants [s] in the song on which they should.
        happened: instants [s] at which they did; nan for one that did not.
    """

    wanted: Float[np.ndarray, " n"]
    happened: Float[np.ndarray, " n"]

    def errors(self, beats: Float[np.ndarray, " k"]) -> Float[np.ndarray, " n"]:
        """How late [s] each accent was after the nearest of ``beats``; nan if it did not happen."""
        nearest = np.abs(self.happened[:, None] - beats).argmin(axis=1)
        return self.happened - beats[nearest]

    def share_on(self, beats: Float[np.ndarray, " k"]) -> float:
        """Share of the accents within 40 ms of one of ``beats``."""
        return float((np.abs(self.errors(beats)) <= ON_THE_BEAT).mean())


def danced(recorded: TruthRecording, dance: Dance) -> DancedAccents:
    """When the accents of ``dance`` happened.

    A channel of the trunk counts where it is greatest, or least, within half a pulse; a foot where
    the ground first bears it after it was in the air.

    Args:
        recorded: the run, from the instant on at which the song began.
    """
    time = recorded.time - recorded.time[0]
    tracks = _tracks(recorded)
    reach = NEAR * float(np.median(np.diff(dance.pulses)))
    wanted = np.array([dance.time(accent) for accent in dance.accents])
    happened = []
    for accent, instant in zip(dance.accents, wanted, strict=True):
        rows = slice(*np.searchsorted(time, [instant - reach, instant + reach]).tolist())
        happened.append(_happened(accent, time[rows], tracks[rows], recorded.foot_forces[rows]))
    return DancedAccents(wanted, np.array(happened))


def _tracks(recorded: TruthRecording) -> Float[np.ndarray, "n 6"]:
    """The trunk's channels, seen from where it was at the start."""
    turn = yaw_rotation(float(recorded.rpy[0, 2])).T
    return np.hstack([(recorded.q[:, :3] - recorded.q[0, :3]) @ turn.T, recorded.rpy])


def _happened(
    accent: Accent,
    time: Float[np.ndarray, " m"],
    tracks: Float[np.ndarray, "m 6"],
    forces: Float[np.ndarray, "m 4"],
) -> float:
    if len(time) == 0:
        return np.nan
    if accent.part not in BODY_CHANNELS:
        bears = forces[:, Leg[accent.part]] > TOUCH
        landings = 1 + np.flatnonzero(bears[1:] & ~bears[:-1])
        return float(time[landings[0]]) if len(landings) else np.nan
    row = int((accent.sign * tracks[:, BODY_CHANNELS.index(accent.part)]).argmax())
    is_inside = 0 < row < len(time) - 1
    return float(time[row]) if is_inside else np.nan
