"""``python -m benchmarks policies``: the cloned trot beside the one that it was cloned from.

Each row of ``walks`` and ``pushes`` twice: by the ``policy`` that comes with the project, and by
the ``trot`` of the whole-body controller, under the same conditions as in ``locomotion`` and
``balance``: friction 0.6 to 1.0, masses within 10 %. Seeds of the training are other ones.

- wrong: sidecars in which one thing is wrong; named is who finds which, and puts it right. The
  wrong one's factor is drawn from 2 to 5, or their inverse; or signs, or the order of the joints;
- right: the policy laid out in another order, with other signs and scales; accused is a mistake.
"""

from dataclasses import replace
from functools import cache, partial

import numpy as np

from benchmarks.balance import STRIDE, TROT_PUSHES, share_of_phases, stays_up
from benchmarks.command import Benchmark
from benchmarks.locomotion import FIRST_SEED, START_TIME, WINDOW, Run, measured
from benchmarks.robots import UNTOLD, plant_of
from benchmarks.study import Study, TrialResult
from controller.policies import TROT, Policy, probe
from controller.policies.probing import Change, changes, scaled
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.plant import MujocoPlant

WALKS = ("policy", "trot")
SPEEDS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8)  # m/s
SPEED, SLIPPERY = 0.5, 0.3  # m/s, friction
ON_ICE = f"{SPEED:g} m/s on {SLIPPERY:g}, 20 s"
HAND_OVERS = 20
KINDS = ("order", "signs", "scale", "gain")
CLOSE = 1.5  #: Factor by which a number that is put right may still be off


@cache
def cloned() -> Policy:
    """The policy that comes with the project."""
    return Policy.load(TROT)


def set_off(robot: TrialRobot, walk: str, speed: float) -> None:
    """Stand up and walk ahead; the record begins with the command."""
    robot.require(robot.go2.walk(policy=cloned() if walk == "policy" else None))
    robot.go2.move(speed)
    robot.truth.clear()


def measure_walk(
    trial: Trial, found: TrialResult, walk: str, speed: float, friction: float | None = None
) -> None:
    """Follow the command; see ``locomotion`` for what is measured."""
    plant = plant_of(trial, FIRST_SEED, UNTOLD)
    if friction is not None:
        mass = float(np.random.default_rng(FIRST_SEED + trial.seed).uniform(*UNTOLD))
        plant = MujocoPlant(friction=friction, mass_scale=mass, sensors=trial.sensors)
    mass = plant.total_mass
    with TrialRobot(plant) as robot:
        set_off(robot, walk, speed)
        robot.wait(START_TIME + WINDOW)
        recorded = robot.truth.recording()
    window = recorded.since(recorded.time[0] + START_TIME)
    values = measured(Run("", "trot", VelocityCommand(speed), None), window, mass)
    found.values = {name: values[name] for name in ("mean", "mae", "cost", "saturated")}


def measure_pushes(trial: Trial, found: TrialResult, walk: str, push: str) -> None:
    """Push at every phase of the stride; the share of phases that are survived."""

    def goes_on(robot: TrialRobot, phase: int, force: np.ndarray) -> bool:
        set_off(robot, walk, SPEED)
        return stays_up(robot, phase, force)

    found.values[""] = share_of_phases(trial, FIRST_SEED, push, goes_on)


def measure_hand_over(trial: Trial, found: TrialResult) -> None:
    """Hand over to the policy and back, each time at another phase."""
    done = 0
    with TrialRobot(plant_of(trial, FIRST_SEED, UNTOLD)) as robot:
        set_off(robot, "trot", SPEED)
        robot.wait(1.0)
        try:
            for phase in range(HAND_OVERS):
                for policy in (cloned(), None):
                    robot.require(robot.go2.walk(policy=policy))
                    robot.wait(STRIDE + phase * STRIDE / HAND_OVERS)
                    done += 1
        except TrialFailed as failed:
            found.notes[""] = str(failed)
    found.values[""] = done / (2 * HAND_OVERS)


def wrong(seed: int) -> Change:
    """The sidecar of the policy with one thing in it changed."""
    rng, kind = np.random.default_rng(seed), KINDS[seed % len(KINDS)]
    side = cloned().sidecar
    factor = float(rng.uniform(2.0, 5.0) ** rng.choice([-1.0, 1.0]))
    if kind in ("order", "signs"):
        alike = [change for change in changes(side) if change.key == f"joints.{kind}"]
        return alike[rng.integers(len(alike))]
    keys = ["action.kp", "action.kd"]
    if kind == "scale":
        keys = ["action.scale", *(f"scale of {term.name}" for term in side.terms)]
    return scaled(side, str(rng.choice(keys)), factor)


def measure_wrong(trial: Trial, found: TrialResult) -> None:
    """Whether the probe names what is wrong, and says what it should be."""
    policy, change = cloned(), wrong(trial.seed)
    finding = probe(Policy("wrong", change.sidecar, policy.network))
    found.notes[""] = f"{change.key}: {change.told}; {finding}"
    put = finding.change
    found.values[""] = float(put is not None and is_put_right(change, put))


def is_put_right(made: Change, put: Change) -> bool:
    """Whether ``put`` is what was ``made`` wrong, and near to what it was."""
    right = cloned().sidecar
    if made.key != put.key:
        return False
    if made.factor:
        return 1.0 / CLOSE < made.factor * put.factor < CLOSE
    return bool(
        (put.sidecar.order == right.order).all() and (put.sidecar.signs == right.signs).all()
    )


def measure_right(trial: Trial, found: TrialResult) -> None:
    """Whether the probe sees nothing wrong where nothing is."""
    policy, rng = cloned(), np.random.default_rng(trial.seed)
    order, signs = rng.permutation(12), rng.choice([-1.0, 1.0], size=12)
    scales = rng.uniform(0.2, 5.0, size=len(policy.sidecar.terms))
    finding = probe(laid_out(policy, order, signs, scales, float(rng.uniform(0.2, 5.0))))
    found.notes[""] = str(finding)
    found.values[""] = float(bool(finding))


def laid_out(
    policy: Policy, order: np.ndarray, signs: np.ndarray, scales: np.ndarray, action: float
) -> Policy:
    """The same policy, which has no history, with other numbers for the same.

    It counts the joints in this ``order``, with these ``signs``; its terms are greater by
    ``scales``, its actions by ``action``.
    """
    side, back = policy.sidecar, np.argsort(order)
    ends = np.cumsum([len(term.scale) for term in side.terms])[:-1]

    def network(x: np.ndarray) -> np.ndarray:
        parts = [
            (signs * part)[back] / scale if len(part) == len(order) else part / scale
            for part, scale in zip(np.split(x, ends), scales, strict=True)
        ]
        return action * signs * np.asarray(policy.network(np.concatenate(parts)))[order]

    terms = tuple(
        replace(term, scale=term.scale * scale / (action if term.name == "last_action" else 1.0))
        for term, scale in zip(side.terms, scales, strict=True)
    )
    joints = {"order": order, "signs": signs, "default": signs * side.default[order]}
    gains = {"kp": side.kp[order], "kd": side.kd[order]}
    scale = side.action_scale[order] / action
    sidecar = replace(side, **joints, **gains, action_scale=scale, terms=terms)
    return Policy(f"{policy.name}, laid out", sidecar, network)


def _walk(walk: str, name: str, item: str, bar: str, **how: float) -> Study:
    rows = (
        ("mean", "mean velocity error", bar if walk == "policy" else "%"),
        ("mae", "mean absolute error", "m/s"),
        ("cost", "cost of transport", ""),
        ("saturated", "saturated ticks", "%"),
    )
    measure = partial(measure_walk, walk=walk, **how)
    return Study(f"{walk}-{name}", {f"{walk}: {item}": rows}, measure, group="walks")


def _pushes(walk: str, push: str) -> Study:
    rows = [("", f"{push} {TROT_PUSHES[push][1]:g} N s survived", ">=")]
    item = f"{walk} at {SPEED:g} m/s, push 0.1 s, 16 phases"
    measure = partial(measure_pushes, walk=walk, push=push)
    return Study(f"{walk}-{push}", {item: rows}, measure, group="pushes")


ON_TRUTH = (
    *(
        _walk(walk, f"{speed:g}", f"{speed:g} m/s, 20 s", "<= 10 %", speed=speed)
        for speed in SPEEDS
        for walk in WALKS
    ),
    *(_walk(walk, "slippery", ON_ICE, "%", speed=SPEED, friction=SLIPPERY) for walk in WALKS),
    *(_pushes(walk, push) for push in TROT_PUSHES for walk in WALKS),
    Study(
        "hand-over",
        {f"trot and policy, {SPEED:g} m/s": [("", "handed over without a fall", ">= 1")]},
        measure_hand_over,
    ),
)
PROBED = tuple(
    Study(name, {"probe": [("", what, ">= 1")]}, measure, None, None, factor, "probe", None)
    for name, what, measure, factor in (
        ("wrong", "what is wrong named, and put right", measure_wrong, 4),
        ("right", "right ones left alone", measure_right, 1),
    )
)
STUDIES = (*ON_TRUTH, *(study.sensed("sensors") for study in ON_TRUTH), *PROBED)

run = Benchmark(
    "policies",
    "The cloned trot beside the one of the whole-body controller, and the probe of sidecars.",
    STUDIES,
    takes="half an hour on two cores",
    examples=("--rows walks", "--rows probe --seeds 10"),
).run
