"""Where ``WbcSolution`` was; it is in ``controller``."""

from go2_wbc.lazy import moved_names

__getattr__ = moved_names(__name__, {"WbcSolution": "go2_wbc.wbc.controller"})
