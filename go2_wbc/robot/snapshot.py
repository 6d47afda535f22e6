"""Where ``Snapshot`` was; it is in ``state``."""

from go2_wbc.lazy import moved_names

__getattr__ = moved_names(__name__, {"Snapshot": "go2_wbc.robot.state"})
