"""What the server offers: topics, rates, services and actions, by name. No ROS is needed here."""

from __future__ import annotations

BEHAVIOR_SERVICE = "robot_behavior_command"
STATISTICS_SERVICE = "statistics"
MOTION_ACTION = "play_motion"
CMD_VEL = "cmd_vel"
BODY_POSE = "body_pose"
ODOM = "odom"
SERVER_NODE = "go2_wbc"
MOTION_NODE = "go2_wbc_motions"

COMMAND_PERIOD = 0.02
"""Time [s] between two sendings of a velocity command that lasts."""
CMD_VEL_SILENCE = 0.5
"""Robot time [s] without a command after which the robot stops."""
QUEUE = 10
"""Messages that are kept for a slow reader."""
COMMAND_QUEUE = 100
"""Commands that are kept for the loop: two seconds' worth, should the machine be that busy."""
STATE_RATE, TRANSFORM_RATE, FEEDBACK_RATE = 100.0, 50.0, 10.0
"""Messages per second of robot time: of what is measured, of /tf, of the action's feedback."""


def topic(namespace: str, name: str) -> str:
    """Full name of a topic, service or action of one robot."""
    return f"/{namespace}/{name}"
