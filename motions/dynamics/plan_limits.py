"""Numbers of the dynamic planner: what a plan must keep, and how much it costs to be off."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, SHARE, ranged

SOFT = 0.1
"""Share of the costs with which a start begins; see ``Weights.softened``."""


@dataclass(frozen=True, slots=True)
@ranged(
    SHARE,
    friction=POSITIVE,
    force_max=POSITIVE,
    joint_margin=NOT_NEGATIVE,
    knee_height=NOT_NEGATIVE,
    clearance=NOT_NEGATIVE,
)
class PlanLimits:
    """What every plan keeps.

    Attributes:
        torque_share: share of the motors' torque; the rest is the controller's, for feedback.
        end_share: the same at the speed that a joint has at the end of a step, through which its
            torque holds. It is reached for an instant only, so less is left; the friction of the
            joints takes 8 % there. Bounded by the speed in the middle alone, motors at take-off
            gave all they have for up to 10 ms of each of the last steps.
        friction: coefficient of the cone, whose facets are inside it; less than the controller's
            0.6.
        force_max: normal force [N] of a foot. It costs no height and tames a push-off that would
            otherwise end in one knot of 900 N (own experiments).
        speed_share: share of the joints' speed limit.
        joint_margin: distance [rad] from the joints' position limits.
        knee_height: least height [m] of the knees' axes.
        clearance: height [m] that a foot in the air keeps, once it is under way.
    """

    torque_share: float = 0.85
    end_share: float = 0.95
    friction: float = 0.5
    force_max: float = 160.0
    speed_share: float = 0.85
    joint_margin: float = 0.03
    knee_height: float = 0.09
    clearance: float = 0.02


@dataclass(frozen=True, slots=True)
class Weights:
    """Costs per squared unit and second, or at a knot where that is said (own experiments).

    Attributes:
        torque: [1/(N m)^2], of the difference from standing.
        friction: of forces outside the cone or above ``force_max`` [1/N^2].
        joint_range, joint_speed: beyond the limits [1/rad^2], [s^2/rad^2].
        ground: of a foot or knee below its height [1/m^2].
        clearance: of a foot below its clearance [1/m^2].
        foot_place, foot_speed: of a foot at touchdown or in its place, at one knot.
        trunk: of the trunk at the end of a phase [1/m^2, 1/rad^2], at one knot.
        end: of the last state, at one knot.
        posture: of joints against the path of the first guess [1/rad^2].
        speed: of all velocities.
        track: of the trunk against the path of the first guess [1/m^2, 1/rad^2]: nothing, unless
            that path is what is asked.
    """

    torque: float = 1e-3
    friction: float = 1.0
    joint_range: float = 2e3
    joint_speed: float = 50.0
    ground: float = 1e4
    clearance: float = 2e4
    foot_place: float = 2e4
    foot_speed: float = 50.0
    trunk: float = 2e3
    end: float = 1e3
    posture: float = 0.1
    speed: float = 0.01
    track: float = 0.0

    def softened(self) -> Weights:
        """The same with everything but effort at a tenth, for a rough guess.

        From one, the full costs are so steep that solving takes five times the iterations, if it
        converges at all (own experiments).
        """
        eased = {
            part.name: SOFT * getattr(self, part.name)
            for part in fields(self)
            if part.name not in ("torque", "posture", "speed", "track")
        }
        return replace(self, **eased)
