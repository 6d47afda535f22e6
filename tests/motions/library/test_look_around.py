"""Looking around goes where its description says."""

from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rpy_from_rotation
from motions import compile_timeline, load_motion


def test_it_looks_up_to_the_left_then_up_to_the_right_then_down() -> None:
    plan = compile_timeline(load_motion("look_around"), RobotModel())
    looks = [rpy_from_rotation(plan.at(t).body.R_world_base) for t in (1.15, 2.95, 4.4)]
    (_, up_left, left), (_, up_right, right), (_, down, ahead) = looks
    assert left > 0.2
    assert right < -0.2
    assert abs(ahead) < 1e-6
    assert max(up_left, up_right) < -0.15
    assert down > 0.2
