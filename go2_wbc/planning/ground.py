"""The ground below a walking robot: the plane on which its feet have met it, and what it permits.

The plane z = h + s (p - p_com), in the world, with its height h below the CoM and its slope s, is
carried along with the CoM. Where feet are met, h takes in a share of how far they are off it, and s
a share of the slope of the plane that fits, by least squares, where each foot was met last. How far
they are off it is also what tells rough ground, on which feet are raised higher, and the robot goes
more slowly, in quicker strides, until it has come ``MEMORY`` without any.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.compilation import subroutine
from go2_wbc.planning.slip import LEAST_FRICTION
from go2_wbc.records import Array3, Record
from go2_wbc.robot.state import Snapshot
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, ranged, retires

GROUND_SHARE = 0.5
"""Share of a landing foot's height that goes into the estimate of the ground's height. A pitch that
is believed 0.5 deg wrong is a slope that is not there, along which the plane is carried off between
landings: at 1 m/s it was up to 7 mm too high with 0.3, 3 mm with 0.5."""
LEAST_DETERMINANT = 1e-4
"""Of the feet's second moments [m^4], 0.01 when they stand squarely; below it they are in line."""
MOST_SLOPE = 0.6  #: Greatest slope that is believed; no foot holds on a steeper one
LEVEL_SLOPE = 0.05
"""Slope up to which the ground counts as level for the friction; from twice that on in full."""
SLOPE_SHARE = 0.3  #: Share of the slope that was found at a landing that is taken in
ROUGH_SLOPE_SHARE = 0.5  #: The same on rough ground
FOLLOW = 0.7  #: Share of the slope by which the trunk is tilted
SMOOTH, MOST_RAISE = 0.015, 0.05
"""Distance [m] of a landing from the plane up to which the ground is smooth. As much as it is
rougher than that is added to the apex of a swing, the latter [m] at most."""
ROUGH, HIGH = 0.03, 0.09  #: Roughness [m] from which on ground is rough, and its steps are high
MEMORY = 1.7  #: For how far [m] either is remembered
ROUGH_PACE = 0.85
"""Speed [m/s] up to which that holds; as much faster, as much rougher: a robot at 3 m/s whose foot
brushes the ground once in a swing goes on."""
STEEP, STEEP_FORGETS = 0.15, 7.0
"""Slope from which on that is forgotten sooner, and how many times as soon where it is twice as
steep: on stairs every other foot tells it anew, but on a ramp it is only its beginning."""
FIRST_WAY = 0.5
"""For how far [m] the first step is taken for a high one, after one up the next is expected, and
behind a ramp a slope is taken for its."""
FIRST_RAISED, FIRST_LIFT, FIRST_LEAN = 0.08, 0.04, 0.12
"""Least height [m] by which a swing is higher on rough ground that is level: a foot that meets the
first step does not tell how high it is, and the next one must not meet it as well. Height [m] by
which the trunk is carried higher while a first step is expected, and slope by which its leading end
is raised then. With the trunk as on smooth ground, its nose met the face of the second of those
stairs before it had risen, and the robot was thrown back. Carried on to where the ground falls
away, lift and lean would keep the feet from reaching it."""
LIFT_RATE, LEAN_RATE, LEAN_SPEED = 0.3, 1.0, 0.1
"""Greatest rate [m/s] at which the trunk is lifted for it, and [1/s] at which its leading end is,
and speed [m/s] from which on the latter is in full."""
HASTE_FRICTION = 0.45
"""Friction from which on the ground bears the greatest acceleration; on less it falls with the
square: what slid once shows less than there is, and goes on at once on ground that has it."""
PROMPT, LATE, LATE_HASTE = 0.003, 0.008, 0.4
"""Lateness of the commands [s] up to which the robot speeds up by all that the ground bears, and
from which on it does by the last share of it."""
LATE_SPEED, LATE_ASIDE = 1.25, 0.6
"""Greatest speeds [m/s] ahead and aside then. Faster ahead, feet stand for so short a time that one
that lifts off, or comes down, by 9 ms too late or too early makes the hops between them grow until
the robot falls. Faster aside, the foot that comes down strikes the one beside it."""
QUICK, FAST, FAST_HASTE = 2.0, 2.6, 0.2
"""The same by the speed [m/s]: motors that turn fast have less torque, and the trunk sinks where it
is asked for more."""
ROUGH_HASTE = 1.0 / 7.0  #: Share of these that is left on rough ground
TOO_FAST, ROUGH_BRAKE = 1.25, 0.4
"""How many times as fast as rough ground permits the robot brakes, and with what share at most. By
``ROUGH_HASTE`` of it, on a friction of 0.3, it still went at 0.85 m/s two steps below the edge that
it had walked over at 1 m/s: on its own sensors 1 of 12 robots came down stairs of 11 cm, now 9."""
CALMING = 0.8  #: Share of the roughness that is left after a landing
STUMBLE = 0.06  #: Roughness [m] that a foot tells which is stopped in the middle of its swing
DELAY = 0.4
"""Share of a swing, on the roughest ground, in which the foot only rises: feet close to a step
rubbed along its face. It and the six before are from a search in simulation."""
EARLIER, CLIMBED, FORGETS = 0.15, 0.17, 0.1
"""Share of a swing that is left, on stairs, when the foot has arrived above its place: one that
still went ahead slid down along the face of the next step. Feet are there if they have come higher
than one step [m]; the lowest place counts as this much [m] higher with each m that the robot goes.
"""
LEASH = 0.04
"""Greatest distance [m], on rough ground, of the height asked of the CoM from that it has. A foot
that meets a step makes the wanted height jump: 9 cm at once threw the robot into the air, from
where it fell."""
EASE = 4.0
"""By 1 plus this the weight of the trunk's attitude is divided there. On friction that is believed
to be low, the moment of a swing takes twice the robot's weight on the feet; with its weight ten
times that of the place the attitude got it, and the robot took off."""
_TINY = 1e-9  #: Speed [m/s] that stands in for none where one divides by it


@dataclass(frozen=True, slots=True)
@retires(
    high=HIGH,
    way=MEMORY,
    first_raised=FIRST_RAISED,
    first_lift=FIRST_LIFT,
    first_lean=FIRST_LEAN,
    leash=LEASH,
    ease=EASE,
)
@ranged(NOT_NEGATIVE, speed=POSITIVE)
class RoughConfig:
    """How the robot walks where its feet have found the ground rough."""

    speed: float = 0.5  #: greatest speed [m/s]
    high_speed: float = 0.43
    """Greatest speed [m/s] among high steps; the first step, of which that is not known yet, is
    taken for one."""
    raised: float = 0.02  #: least height [m] by which a swing is higher on a slope
    swing: float = 0.04  #: time [s] by which it is longer
    stance: float = 0.16  #: longest time [s] that a foot stands, if that is not shorter already


class Ground(Record):
    """What is known of the ground."""

    height: float  #: below the CoM [m]
    slope: Float[np.ndarray, "2"]  #: ahead and to the left, in the world's axes
    p_seen: Float[np.ndarray, "2"]  #: where the CoM is [m]
    p_met: Float[np.ndarray, "4 3"]  #: where each foot met it last, by its centre [m]
    roughness: float  #: distance [m] from the plane at which feet were met lately
    low: float  #: height [m] of the lowest place where a foot was met on it, as far as remembered
    rough_way: float  #: for how far [m] it is taken for rough yet
    high_way: float  #: for how far [m] steps are taken for high yet
    steeper: float  #: share of the slope by which the trunk follows it more
    rise_way: float  #: for how far [m] steps up are expected yet
    ramp_way: float  #: for how far [m] a slope is taken for that of a ramp yet, not of stairs
    lift: float  #: height [m] by which the trunk is carried higher for these
    lean: Float[np.ndarray, "2"]  #: slope that the trunk follows besides, to raise its leading end


def ground_below(now: Snapshot, foot_radius: float) -> Ground:
    """The plane through the feet as they stand."""
    ground = Ground(p_seen=now.p_world_com[:2], p_met=now.p_world_feet)
    ground.slope[:] = fitted_slope(ground)
    middle = ground.p_met.mean(axis=0)
    rise = ground.slope @ (ground.p_seen - middle[:2])
    ground.height = float(middle[2] + rise) - foot_radius
    return ground


@subroutine
def ground_at(g: Ground, x: float, y: float) -> float:
    """Height of the plane [m]."""
    return g.height + g.slope[0] * (x - g.p_seen[0]) + g.slope[1] * (y - g.p_seen[1])


@subroutine
def is_rough(g: Ground) -> bool:
    """Whether the feet have found it rough, lately."""
    return g.rough_way > 0.0


@subroutine
def highest(g: Ground) -> float:
    """Height [m] of the highest of the places where the feet were met last, by its centre."""
    return max(g.p_met[0, 2], g.p_met[1, 2], g.p_met[2, 2], g.p_met[3, 2])


@subroutine
def landing_height(g: Ground, z: float) -> float:
    """Height [m] at which a foot shall land whose place on the plane is as high as ``z``.

    On rough ground it is led no higher than the highest of those that were met: at the top of
    stairs the plane goes on to rise, feet that were led there swung on 10 cm above the landing, and
    legs without ground below them pushed, or caught the trunk after a fall. A step that is higher
    meets the foot on its way down.
    """
    if not is_rough(g):
        return z
    return min(z, highest(g))


@subroutine
def greatest_speed(g: Ground, c: RoughConfig) -> float:
    """What rough ground permits [m/s]."""
    if not is_rough(g):
        return np.inf
    return c.high_speed if g.high_way > 0.0 else c.speed


@subroutine
def late_share(ahead: float, aside: float) -> float:
    """Velocity [m/s] as a share of the greatest where commands act late."""
    return np.hypot(ahead / LATE_SPEED, aside / LATE_ASIDE)


@subroutine
def slow_down(g: Ground, c: RoughConfig, delay: float, velocity: Array3) -> None:
    """Scale what is commanded down to that, or to what commands permit that act so late [s]."""
    share = greatest_speed(g, c) / max(np.hypot(velocity[0], velocity[1]), _TINY)
    if delay >= LATE:
        share = min(share, 1.0 / max(late_share(velocity[0], velocity[1]), _TINY))
    velocity *= min(share, 1.0)


@subroutine
def on_leash(g: Ground, height: float, now: Snapshot) -> float:
    """Height [m] asked of the CoM, where on smooth ground it were ``height``."""
    if not is_rough(g):
        return height
    z = now.p_world_com[2]
    return min(max(height, z - LEASH), z + LEASH)


@subroutine
def raised(g: Ground) -> float:
    """Height [m] by which a swing is higher as feet have been met off the plane."""
    return min(max(g.roughness - SMOOTH, 0.0), MOST_RAISE)


@subroutine
def levelness(g: Ground) -> float:
    """1 on the level, 0 on stairs as far as they are known."""
    return max(1.0 - np.hypot(g.slope[0], g.slope[1]) / STEEP, 0.0)


@subroutine
def apex_raise(g: Ground, c: RoughConfig) -> float:
    """Height [m] by which a swing is higher than on smooth ground."""
    if not is_rough(g):
        return raised(g)
    return max(raised(g), c.raised + levelness(g) * (FIRST_RAISED - c.raised))


@subroutine
def delay(g: Ground) -> float:
    """Share of a swing in which the foot only rises: none on smooth ground."""
    return DELAY * raised(g) / MOST_RAISE


@subroutine
def earliness(g: Ground, ahead: tuple[float, float]) -> float:
    """Share of a swing that is left as the foot is above its place; up stairs, ``ahead`` [m/s]."""
    speed = max(np.hypot(ahead[0], ahead[1]), LEAN_SPEED)
    rise = (g.slope[0] * ahead[0] + g.slope[1] * ahead[1]) / speed
    is_stairs = is_rough(g) and highest(g) - g.low > CLIMBED
    return EARLIER * min(max(rise / STEEP - 1.0, 0.0), 1.0) if is_stairs else 0.0


@subroutine
def tilt(g: Ground) -> tuple[float, float]:
    """Slope that the trunk follows."""
    follow = FOLLOW + g.steeper
    return follow * g.slope[0] + g.lean[0], follow * g.slope[1] + g.lean[1]


@subroutine
def level_friction(g: Ground, friction: float, least: float) -> float:
    """Coefficient of the upright cone that lies within that about the ground's normal.

    A foot on a slope of 15 deg and a coefficient of 0.65 slides when it is pushed ahead with 0.6 of
    what it carries, although that is less: tan(atan(0.65) - 15 deg) is 0.33. Never below ``least``.
    What feet find of a slope on level ground takes nothing. Rough ground that rises is taken for
    stairs, whose steps are level; behind the crest of a ramp, which is rough, hind feet on it slid.
    """
    steep = np.hypot(g.slope[0], g.slope[1])
    steep *= min(max(steep / LEVEL_SLOPE - 1.0, 0.0), 1.0)
    if g.roughness > SMOOTH and g.ramp_way <= 0.0:
        return friction
    return max((friction - steep) / (1.0 + friction * steep), least)


@subroutine
def haste(g: Ground, c: RoughConfig, friction: float, delay: float, velocity: Array3) -> float:
    """Share of the greatest acceleration that the robot is given.

    By the ``friction`` and slope of the ground, by how late the commands act [s], and by the
    ``velocity`` that it is told, in the heading frame [m/s].
    """
    share = min(level_friction(g, friction, LEAST_FRICTION) / HASTE_FRICTION, 1.0) ** 2
    late = min(max((delay - PROMPT) / (LATE - PROMPT), 0.0), 1.0)
    share = min(share, 1.0 - (1.0 - LATE_HASTE) * late)
    fast = min(max((np.hypot(velocity[0], velocity[1]) - QUICK) / (FAST - QUICK), 0.0), 1.0)
    share = min(share, 1.0 - (1.0 - FAST_HASTE) * fast)
    if np.hypot(velocity[0], velocity[1]) > TOO_FAST * greatest_speed(g, c):
        return min(ROUGH_BRAKE, share)
    return ROUGH_HASTE * share if is_rough(g) else share


@subroutine
def is_met_rough(g: Ground, now: Snapshot) -> bool:
    """Whether feet have just found it rough, at the speed at which the robot goes."""
    speed = np.hypot(now.v_world_com[0], now.v_world_com[1])
    return g.roughness > ROUGH * max(speed / ROUGH_PACE, 1.0)


@subroutine
def carry_ground(g: Ground, now: Snapshot, dt: float) -> None:
    """Follow the CoM, after ``dt`` seconds."""
    speed = np.hypot(now.v_world_com[0], now.v_world_com[1])
    is_met = is_met_rough(g, now)
    way = MEMORY if g.roughness > HIGH else FIRST_WAY if is_met and not is_rough(g) else 0.0
    steep = min(max(np.hypot(g.slope[0], g.slope[1]) / STEEP - 1.0, 0.0), 1.0)
    come = speed * dt * (1.0 + (STEEP_FORGETS - 1.0) * steep)
    is_ramp = steep > 0.0 and not is_rough(g)
    g.ramp_way = FIRST_WAY if is_ramp else max(g.ramp_way - speed * dt, 0.0)
    g.high_way = max(g.high_way - come, way)
    g.rough_way = max(g.rough_way - come, MEMORY if is_met else 0.0)
    least = min(g.p_met[0, 2], g.p_met[1, 2], g.p_met[2, 2], g.p_met[3, 2])
    g.low = min(g.low + FORGETS * speed * dt, least) if is_rough(g) else least
    x, y = now.p_world_com[0], now.p_world_com[1]
    g.height = ground_at(g, x, y)
    g.p_seen[0], g.p_seen[1] = x, y


@subroutine
def expect_steps(g: Ground, now: Snapshot, ahead: tuple[float, float], dt: float) -> None:
    """Carry the trunk for a step up that may follow, on its way ``ahead`` [m/s]."""
    speed = np.hypot(ahead[0], ahead[1])
    g.rise_way -= min(np.hypot(now.v_world_com[0], now.v_world_com[1]) * dt, g.rise_way)
    share = levelness(g) if is_rough(g) and g.rise_way > 0.0 else 0.0
    most = LIFT_RATE * dt
    g.lift += min(max(share * FIRST_LIFT - g.lift, -most), most)
    most = LEAN_RATE * dt
    for i in range(2):
        lean = share * FIRST_LEAN * ahead[i] / max(speed, LEAN_SPEED)
        g.lean[i] += min(max(lean - g.lean[i], -most), most)


@subroutine
def fitted_slope(g: Ground) -> tuple[float, float]:
    """Of the plane through where the feet were met, by least squares; as it was if in a line."""
    middle = np.zeros(3)
    for leg in range(4):
        for i in range(3):
            middle[i] += g.p_met[leg, i] / 4
    xx = xy = yy = xz = yz = 0.0
    for leg in range(4):
        p = g.p_met[leg]
        x, y, z = p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]
        xx += x * x
        xy += x * y
        yy += y * y
        xz += x * z
        yz += y * z
    determinant = xx * yy - xy * xy
    if determinant < LEAST_DETERMINANT:
        return g.slope[0], g.slope[1]
    a, b = (yy * xz - xy * yz) / determinant, (xx * yz - xy * xz) / determinant
    return min(max(a, -MOST_SLOPE), MOST_SLOPE), min(max(b, -MOST_SLOPE), MOST_SLOPE)


@subroutine
def learn_ground(
    g: Ground,
    now: Snapshot,
    foot_radius: float,
    met: Bool[np.ndarray, "4"],
    delay: float,
    tells: bool,
) -> None:
    """Take in where feet, of which some are ``met`` at this tick, have met the ground.

    ``tells`` is whether their distance from the plane tells of roughness. Where commands act late
    [s], ``now`` is when the next one does, and a foot that has come down has gone on into the
    ground: it counts as much less far off the plane as it may have moved.
    """
    count, mean, most = 0, 0.0, 0.0
    for leg in range(4):
        if met[leg]:
            p = now.p_world_feet[leg]
            gone = max(delay - PROMPT, 0.0) * abs(now.v_world_contacts[leg, 2])
            off = p[2] - foot_radius - ground_at(g, p[0], p[1])
            gone = min(max(off, -gone), gone)
            off -= gone
            count += 1
            mean += off
            most = max(most, abs(off))
            if tells and abs(off) > ROUGH:
                g.rise_way = FIRST_WAY if off > 0.0 else 0.0
            for i in range(3):
                g.p_met[leg, i] = p[i]
            g.p_met[leg, 2] -= gone
    if count == 0:
        return
    g.roughness = max(CALMING * g.roughness, most if tells else 0.0)
    g.height += GROUND_SHARE * mean / count
    a, b = fitted_slope(g)
    share = ROUGH_SLOPE_SHARE if is_rough(g) else SLOPE_SHARE
    g.slope[0] += share * (a - g.slope[0])
    g.slope[1] += share * (b - g.slope[1])


@subroutine
def note_stumble(g: Ground) -> None:
    """Take in that a foot was stopped in its swing."""
    g.roughness, g.rise_way = max(g.roughness, STUMBLE), FIRST_WAY
