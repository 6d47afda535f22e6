"""What cannot be done as it is written."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Problem:
    """What cannot be done as it is written.

    Attributes:
        check: what the feasibility check calls it.
        subject: the leg, or the trunk.
        time: when [s] it is worst.
        miss: distance [m] by which the leg is too short; nan if that is not what is wrong.
        reason: why no pose is balanced.
    """

    check: str
    subject: str
    time: float
    miss: float = np.nan
    reason: str = ""
