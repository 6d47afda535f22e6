"""Limits of the feasibility check (``motions.feasibility``), which a configuration may set."""

from __future__ import annotations

from dataclasses import dataclass

from go2_wbc.brief import brief
from go2_wbc.validation import POSITIVE, Retired, ranged, retires


@dataclass(frozen=True, slots=True)
@retires(
    drag_height=0.0005,
    joint_jump=12.0,
    body_jump=1.0,
    turn_jump=5.0,
    stance_position=0.02,
    stance_angle=0.05,
    end_speed=0.1,
    stretch=Retired(0.018, "FeasibilityLimits.stop counts"),
    stop_time=Retired(0.18, "FeasibilityLimits.stop counts"),
)
@ranged(POSITIVE)
class FeasibilityLimits:
    """Limits that a motion must keep. Own choice, set by comparing verdicts with simulated runs.

    Attributes:
        reach: distance [m] by which a foot's position may be out of the leg's reach, standing or
            raised: foot or trunk are displaced by as much. Of 21 motions drawn for it that missed
            up to 15 mm all were done; of standing feet, some slid from 17 mm on.
        torque_share: share of the torque limit that a plan may use; 10 % are for feedback. Of 12
            motions drawn for it that reached 0.85 to 0.90 and broke no other limit 9 were done, and
            none saturated a motor; of 12 from there to 1, half.
        solved_torque_share: the same in solved parts. They are solved for 0.85, so a part at this
            limit needs more: the robot stayed on its feet after these, but slid and turned.
        slip: greatest distance [m] that a stance foot may slide.
        foot_load: least normal force [N] of a stance foot: 2 % of the weight; leans with 4 N were
            done.
        support: least distance [m] of the CoM to the edges of the support polygon.
        zero_moment: the same for the zero-moment point.
        off_line: greatest distance [m] of the zero-moment point from the line between two feet, and
            of it and the CoM outside of three that stand for ``pair_time`` at most.
        pair_time: longest time [s] on two feet, or on three with the CoM outside their triangle; in
            it the error of a trunk off balance grows fourfold, exp(t / sqrt(0.29 m / g)).
        wrench: greatest part [N] of the force that no contact forces can give for longer; of the
            moment as much on an arm of 0.2 m.
        jolt: greatest force [N] that contact forces may fail to give for a moment, however little
            the trunk lags, where a foot slides by more than a sixth of ``slip``: a fifth of the
            weight. A fast nod that lacked 82 N, and three motions that lacked 41 to 127 N, passed
            without this limit and went wrong; the nod fell on friction 0.35. The first 30 ms are
            exempt: of 9 plans that begin at speed and lacked 100 to 500 N 8 were done.
        lag, lag_angle: how far [m, rad] the trunk may be off its plan because of forces that the
            ground cannot give. In MuJoCo it was off by 0.7 to 2.2 times as much.
        off, off_angle: how far [m, rad] the trunk may be off its plan in all, joint friction
            included: an author notices 0.030 and 0.14, and MuJoCo's trunk was off by 1.05 to 1.3
            times as much.
        tipping: how far [m] the trunk may fall over the edge of three feet: up to 5 mm motions were
            done, from 7 on the robot fell.
        stop: how far [m] joints at their stops may displace a raised foot, or the trunk over
            standing ones. In MuJoCo the trunk was off by 0.7 to 1.3 times as much: of 16 motions
            drawn for it that had 0.002 to 0.024 all were done, of eight above 0.035 one.
        pair_hip: least distance [rad] of a stance leg's hip to its stop while no more than two feet
            stand: the roll of a trunk that turns fast is late, by 0.05 to 0.1. Of trots drawn for
            it that kept up to 0.05 all six were done, and of eleven that were to go 0.04 to 0.4
            beyond the stop none.
        self_distance: least distance [m] between links that must not touch.
        clearance: least height [m] of trunk and hips: every point of their hulls. Of 17 motions
            with 11 to 20 mm, drawn for it, none touched; from 10.8 mm down the trunk was on the
            ground.
        thigh_clearance: the same of the thighs, which come near to the ground when it sits.
        calf_clearance: the same of the calves, which end 14 mm above the ground when they are
            vertical, with the foot below: over a foot that slid by 9 mm, where 5 were predicted,
            some with 2.4 mm touched.
        solved_calf_clearance: the same in solved parts, whose legs bend deeply at push-off and
            landing: with 1 mm none touched.
        swing_depth: how deep [m] the lowest point of a foot in the air may be planned below the
            ground: it stays above, so it is off by as much. Down to 12 mm feet were 14 to 27 mm off
            in MuJoCo, from 17 on more than the 30 that an author notices.
        drag: longest distance [m] that a foot that counts as raised may move along the ground. It
            bears next to nothing, and of 50 motions drawn for it that drag a foot by 0.02 to 0.33 m
            49 were done.
        rub: distance [m] from which on that is a warning: floors are rougher than MuJoCo's.
        landing: distance [m] by which a foot may land beside its foothold.
        flat_landing: horizontal distance [m] that a foot may still have to go when it is 4 mm above
            its foothold, if it is fast: one with 19 mm landed 18 mm beside it, one with 10 did not.
        landing_speed: greatest speed [m/s] of a foot at touchdown: taps with 1.4 were done.
    """

    reach: float = 0.015
    torque_share: float = 0.9
    solved_torque_share: float = 0.845
    slip: float = 0.01
    foot_load: float = 3.0
    support: float = 0.006
    zero_moment: float = 0.005
    off_line: float = 0.01
    pair_time: float = 0.25
    wrench: float = 5.0
    jolt: float = 30.0
    lag: float = 0.015
    lag_angle: float = 0.03
    off: float = 0.025
    off_angle: float = 0.112
    tipping: float = 0.006
    stop: float = 0.027
    pair_hip: float = 0.02
    self_distance: float = 0.005
    clearance: float = 0.014
    thigh_clearance: float = 0.008
    calf_clearance: float = 0.003
    solved_calf_clearance: float = 0.001
    swing_depth: float = 0.012
    drag: float = 0.35
    rub: float = 0.02
    landing: float = 0.01
    flat_landing: float = 0.016
    landing_speed: float = 1.4

    __repr__ = brief
