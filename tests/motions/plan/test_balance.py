"""Before a foot is raised, the trunk moves until the CoM is over the others."""

import pytest

from go2_wbc.geometry import support_margins
from go2_wbc.robot.model import RobotModel
from motions import Timeline, compile_timeline
from motions.plan.balance import MARGINS
from motions.plan.trajectory import trajectory_of

# m; the CoM's place by the inverse kinematics, which has the trunk's attitude as written, and by
# the trajectory's.
AGREEMENT = 0.002


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (0.04, 0.0), (-0.03, 0.03)])
def test_a_trunk_that_has_moved_away_is_balanced_from_where_it_is(x: float, y: float) -> None:
    model = RobotModel()
    line = Timeline().body(x=x, y=y, over=0.8).foot("FR", z=0.06, over=0.8)
    path = trajectory_of(compile_timeline(line.home(over=1.0), model), model)
    raised = ~path.stance.all(axis=1)
    standing = path.p_feet[0, path.stance[raised][0], :2]
    margins = support_margins(standing, path.p_com[raised, :2])
    assert raised.sum() > 50
    assert margins.min() > MARGINS[0] - AGREEMENT  # the best is possible here
