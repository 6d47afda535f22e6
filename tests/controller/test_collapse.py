"""Whatever the robot does: when its trunk comes to rest on the ground or aslant, it says so."""

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from controller import GO2Controller, Mode
from controller.behaviours.plans import ChangePosture
from go2_wbc.robot.safety import SafetyConfig
from motions.postures import lean
from tests.controller.plants import PERIOD, WatchedPlant

PUSH_TIME = 0.1  # s; a push is as short as a kick
AFTER = 2.0  # s of robot time that follow the push
TOUCH = 1.0  # N; the trunk weighs on the ground
STUMBLE = 0.05  # s; shorter touches are stumbles
NOTICED = 0.2  # s; in which a collapse must be noticed
HELD = 1.0  # s; the plan lifts the trunk by 6 cm in 0.7 s, then a fall is noticed at once
TIPPED = 1.2  # s; in which a robot that was tipped onto a limb must have noticed
MUCH = 30.0  # deg; more than that off its posture no robot was that withstood a push
# rad; roll and pitch of a robot that leans, as for a command from outside.
LEANING = (0.1, 0.15, 0.0)


class PushedPlant(WatchedPlant):
    """A robot that is pushed at a time, and the truth about its trunk after every tick."""

    def __init__(self) -> None:
        super().__init__()
        self.push_at = np.inf
        self.impulse = np.zeros(3)
        self.is_down: list[tuple[float, bool]] = []
        self.on_write = self._watch

    def _watch(self) -> None:
        if self.inner.time >= self.push_at - 1e-9:
            self.inner.push(self.impulse / PUSH_TIME, PUSH_TIME)
            self.push_at = np.inf
        self.is_down.append((self.inner.time, self.inner.base_contact_force > TOUCH))

    @property
    def came_to_rest(self) -> float:
        """When [s] the trunk touched the ground for longer than a stumble, by the simulator."""
        since = None
        for time, is_down in self.is_down:
            if not is_down:
                since = None
                continue
            since = time if since is None else since
            if time - since > STUMBLE:
                return since
        return np.inf


Do = Callable[[GO2Controller], object]


def _nothing(_go2: GO2Controller) -> None: ...


def _lean(go2: GO2Controller) -> None:
    posture = ChangePosture(lambda pose: lean(pose, np.array(LEANING)))
    go2._runner.run(posture, 2.0)


def _walk(go2: GO2Controller, gait: str = "trot", speed: float = 0.4, time: float = 1.0) -> None:
    go2.walk(gait)
    go2.move(linear_x=speed)
    go2.wait(time)


def _bound(go2: GO2Controller) -> None:
    _walk(go2, "bound", 0.6, 1.5)


def _wait(go2: GO2Controller) -> None:
    go2.wait(AFTER)


@dataclass(frozen=True)
class Push:
    """What the robot does, and the push [N s] that makes it collapse ``delay`` s into ``act``."""

    before: Do
    impulse: tuple[float, float, float]
    act: Do = _wait
    delay: float = 0.0


PUSHES = {
    "standing, up from the belly": Push(_nothing, (80.0, 0.0, 0.0)),
    "standing for a while": Push(GO2Controller.stand, (0.0, 60.0, 0.0)),
    "leaning": Push(_lean, (26.0, 0.0, 0.0)),
    "sitting, forward": Push(GO2Controller.sit, (42.0, 0.0, 0.0)),
    "sitting, aslant": Push(GO2Controller.sit, (21.0, 21.0, 0.0)),
    "ready to walk": Push(GO2Controller.walk, (50.0, 50.0, 0.0)),
    "walking, forward": Push(_walk, (90.0, 0.0, 0.0)),
    "walking, aslant": Push(_walk, (95.0, 95.0, 0.0)),
    "bounding, sat down": Push(_bound, (-70.0, 0.0, -80.0)),
    "bounding, aslant": Push(_bound, (70.0, 70.0, 0.0)),
    "turning": Push(GO2Controller.walk, (-110.0, 0.0, -60.0), lambda go2: go2.turn_left(1.5)),
    "push-ups": Push(_nothing, (26.0, 0.0, 0.0), lambda go2: go2.play("push_ups"), 3.0),
    "high five": Push(_nothing, (26.0, 0.0, 0.0), GO2Controller.high_five, 3.0),
}


@pytest.mark.parametrize("name", PUSHES)
def test_a_robot_whose_trunk_comes_to_rest_on_the_ground_says_so_at_once(name: str) -> None:
    # After rising from its belly it lay there again, and was said to stand; one that was pushed
    # while it sat or walked took up to a second to notice.
    push, plant = PUSHES[name], PushedPlant()
    plant.impulse = np.array(push.impulse)
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        push.before(go2)
        assert go2.mode.is_upright
        plant.is_down.clear()
        plant.push_at = go2.state.time + push.delay
        noticed: list[float] = []

        def watch() -> None:
            plant._watch()
            if go2.mode in (Mode.FALLEN, Mode.DAMPED):
                noticed.append(plant.inner.time)

        plant.on_write = watch
        push.act(go2)
        assert not go2.last_outcome
        assert go2.mode in (Mode.FALLEN, Mode.DAMPED)
    assert noticed[0] < plant.came_to_rest + NOTICED


@pytest.mark.parametrize("act", [lambda go2: go2.wait(1.0), lambda go2: go2.stand()])
def test_a_robot_that_is_turned_over_on_the_ground_says_so_at_once(act: Do) -> None:
    # On the ground nothing looked at the tilt: it was said to lie, or to rise for another second.
    plant, over = WatchedPlant(), []
    with GO2Controller(plant=plant) as go2:
        plant.inner.push(np.array([0.0, 0.0, 450.0]), PUSH_TIME, "FL_hip")

        def watch() -> None:
            if go2.state.tilt > SafetyConfig().astray_tilt_limit:
                over.append((go2.state.time, go2.mode))

        plant.on_write = watch
        act(go2)
        assert not go2.last_outcome
        assert go2.mode is Mode.FALLEN
        assert go2.last_outcome.reason.startswith("fell at t=")
        start = over[0][0]
        assert all(mode is Mode.FALLEN for time, mode in over if time > start + 2 * PERIOD)
        assert go2.recover()


@pytest.mark.parametrize("impulse", [22.0, -22.0, 23.0])
def test_a_sitting_robot_that_comes_to_rest_on_a_limb_says_so_at_once(impulse: float) -> None:
    # Tipped aside it rested on a knee, 42 deg from its posture, its trunk off the ground, and was
    # said to sit.
    plant = PushedPlant()
    plant.impulse = np.array([0.0, impulse, 0.0])
    with GO2Controller(plant=plant) as go2:
        assert go2.sit()
        plant.is_down.clear()
        plant.push_at = pushed = go2.state.time
        go2.wait(TIPPED)
        assert go2.mode is Mode.FALLEN
        match = re.fullmatch(
            r"fell at t=(.*) s: trunk tilted (.*) deg from where it should be",
            go2.last_outcome.reason,
        )
        assert match
        fell, tilt = (float(number) for number in match.groups())
        assert pushed < fell < pushed + TIPPED
        assert tilt > MUCH
        assert plant.came_to_rest > fell
        assert go2.recover()


@pytest.mark.parametrize("before", [_nothing, GO2Controller.sit, _walk])
def test_a_push_that_the_robot_withstands_is_no_fall(before: Do) -> None:
    plant = PushedPlant()
    plant.impulse = np.array([10.0, 10.0, 0.0])
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        before(go2)
        mode = go2.mode
        plant.push_at = go2.state.time
        go2.wait(1.0)
        assert go2.last_outcome.ok
        assert go2.mode is mode


def test_a_trot_that_stumbles_and_catches_itself_has_not_fallen() -> None:
    # Its trunk sinks by 12 cm; a limit that is too strict would make it go limp.
    plant = PushedPlant()
    plant.impulse = np.array([18.0, 18.9, 0.0])
    with GO2Controller(plant=plant) as go2:
        assert go2.walk()
        plant.push_at = go2.state.time
        go2.wait(2.0)
        assert go2.mode is Mode.WALKING
        assert go2.state.tilt < 0.1


@pytest.mark.parametrize("moment", [1.5, 1.7])
def test_a_robot_that_is_pressed_down_while_it_rises_says_so(moment: float) -> None:
    # Its belly may be on the ground then; it pressed on for seconds, and was said to move.
    plant = PushedPlant()
    held = plant.inner.time + moment
    plant.once_at(held, lambda: plant.inner.push(np.array([0.0, 0.0, -900.0]), 5.0))
    with GO2Controller(plant=plant) as go2:
        assert not go2.stand()
        assert go2.mode is Mode.FALLEN
        assert go2.last_outcome.reason.startswith("fell at t=")
        assert go2.state.time < held + HELD
