"""What the server offers: topics, rates, services and actions, by name. No ROS is needed here."""

from __future__ import annotations

from dataclasses import dataclass

BEHAVIOR_SERVICE = "robot_behavior_command"
STATISTICS_SERVICE = "statistics"
MOTION_ACTION = "play_motion"
CMD_VEL = "cmd_vel"
ODOM = "odom"
SERVER_NODE = "go2_wbc"
MOTION_NODE = "go2_wbc_motions"

CMD_VEL_SILENCE = 0.5
"""Robot time [s] without a command after which the robot stops."""
QUEUE = 10
"""Messages that are kept for a slow reader."""
COMMAND_QUEUE = 100
"""Commands that are kept for the loop: two seconds' worth, should the machine be that busy."""


@dataclass(frozen=True, slots=True)
class Rates:
    """How often the server publishes, per second of robot time.

    Attributes:
        states: joint_states, odom and imu.
        contacts: foot_contact.
        transforms: /tf.
        clock: /clock, unless the server runs in real time.
        feedback: feedback of the action.
    """

    states: float = 100.0
    contacts: float = 100.0
    transforms: float = 50.0
    clock: float = 100.0
    feedback: float = 10.0


def topic(namespace: str, name: str) -> str:
    """Full name of a topic, service or action of one robot."""
    return f"/{namespace}/{name}"
