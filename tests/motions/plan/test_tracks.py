"""Tracks of the legs: where a foot is between two keys, and by how much it misses its place."""

import numpy as np
import pytest

from go2_wbc.legs import Leg
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from motions import Timeline
from motions.language.footing import Footing
from motions.plan.tracks import SAMPLE_PERIOD, Instants, LegTracks, anchored_times
from motions.postures import standing_feet

STAND_POSE = find_profile().stand_pose

FAR = 0.6  # m; ahead of where the foot stands, out of its leg's reach


@pytest.mark.parametrize("duration", [1e-3, 0.01, 0.3, 1.234, 1.2351, 600.004])
def test_motions_are_sampled_from_their_starts_to_their_ends(duration: float) -> None:
    times = anchored_times(duration)
    assert (times[0], times[-1]) == (0.0, duration)
    assert (np.diff(times) > 0.0).all()
    assert np.diff(times).max() <= 1.5 * SAMPLE_PERIOD
    if duration > SAMPLE_PERIOD:  # a longer one has the same instants but for the end
        longer = anchored_times(duration + 5 * SAMPLE_PERIOD)
        assert np.allclose(longer[: len(times) - 1], times[:-1], atol=1e-9)


def test_a_leg_on_its_way_from_a_place_out_of_reach_misses_it_until_it_has_arrived() -> None:
    line = Timeline(balance=False).foot("FR", x=FAR, z=0.1, over=1.0)
    line = line.leg("FR", hip=0.0, thigh=0.8, calf=-1.6, over=1.0)
    times = np.array([1.0, 1.5, 1.999, 2.0])
    body = np.tile(STAND_POSE, (len(times), 1))
    model = RobotModel()
    tracks = LegTracks(line, Footing(line, standing_feet(model)), model, STAND_POSE)
    miss = tracks.paths(Instants.of(times, body, tracks.footing.at(times))).miss[:, Leg.FR]
    assert miss[0] > 0.1
    assert miss.tolist() == [miss[0], miss[0], miss[0], 0.0]
