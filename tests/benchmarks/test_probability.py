"""The stated chance: which motion is played in which world, the fit, what is stored and shown."""

import csv
import io
import json
import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from benchmarks.command import Output
from benchmarks.probability import (
    COLUMNS,
    csv_of,
    judge,
    passed_that_fell,
    render,
    run,
    save_reliability,
    store,
)
from benchmarks.probability_fit import Sample, _loss, calibration, fit_model
from benchmarks.probability_runs import PAYLOAD, WORLDS, exam, mixed, runs, world_of
from benchmarks.validation_set.drawing import TEST, TRAIN
from controller.sweeps.sweep_file import Row
from go2_wbc.errors import CommandError
from motions.feasibility.report import ProbabilityModel, Rise

MODEL = ProbabilityModel({"slip": Rise(0.01, 0.0, 0.4)}, rest=3.0, leak=0.05)


def _row(seed: int, *, half: str = TEST, slip: float, done: bool, fell: bool = False) -> Row:
    return {
        "seed": seed,
        "motion": f"nod {seed // 5}",
        "family": "nod",
        "half": half,
        "stratum": "easy",
        "friction": 0.5,
        "payload": 1.23456,
        "refused": slip < 0.0,
        "done": done,
        "fell": fell,
        "harm": "" if done else "slip 12 mm",
        "margins": json.dumps({"slip": slip}),
    }


ROWS = [_row(seed, slip=0.002 * (seed - 10), done=seed > 9) for seed in range(20)]


def test_what_is_stored_is_the_model_and_what_it_was_fitted_to(tmp_path: Path) -> None:
    file, train = tmp_path / "probability.json", [_row(7, half=TRAIN, slip=0.0, done=True)]
    store(MODEL, [*ROWS, *train], "c0de", file)
    kept = json.loads(file.read_text(encoding="utf-8"))
    assert ProbabilityModel.of(kept) == MODEL
    assert (kept["about"]["motions"], kept["about"]["runs"], kept["about"]["code"]) == (
        1,
        1,
        "c0de",
    )


def test_every_run_is_a_line_with_its_chance_and_a_passed_one_that_fell_is_named() -> None:
    lines = list(csv.DictReader(io.StringIO(csv_of(MODEL, ROWS).decode())))
    assert len(lines) == len(ROWS)
    assert tuple(lines[0]) == (*COLUMNS, "chance")
    assert (lines[3]["refused"], lines[3]["done"], lines[3]["payload"]) == ("1", "0", "1.235")
    assert float(lines[15]["chance"]) == pytest.approx(MODEL.probability({"slip": 0.01}), abs=5e-4)
    rows = [*ROWS, _row(20, slip=0.01, done=False, fell=True), _row(21, slip=-1.0, done=False)]
    assert [row["seed"] for row in passed_that_fell(rows)] == [20]
    text = render(judge(MODEL, rows), rows, {})
    assert "motions that passed in their world and fell there: 1 of 11" in text
    assert "seed 20: nod 4, friction 0.50, 1.2 kg" in text


def test_the_diagram_has_a_point_for_every_bin_with_runs(tmp_path: Path) -> None:
    judged = judge(MODEL, ROWS)
    assert sum(count for *_, count in judged.bins) == len(ROWS)
    text = save_reliability(judged, tmp_path / "reliability.svg").read_text()
    assert "20 runs of the test half" in text
    assert "chance stated" in text
    assert all(f">{count}<" in text for *_, count in judged.bins)


def test_motions_of_which_none_judges_are_refused_before_one_is_played() -> None:
    first = next(number for number, one in enumerate(exam()) if one.family.half == TEST)
    with pytest.raises(CommandError, match=f"--motions must be {first + 1} or more"):
        run(motions=first, output=Output())


TRUTH = ProbabilityModel(
    {"slip": Rise(0.03, 0.5, 0.3), "torque": Rise(3.0, -0.4, 0.2)}, rest=3.0, leak=0.05
)


def _samples(seed: int, n: int) -> list[Sample]:
    """Motions with margins at random, done as often as ``TRUTH`` says."""
    rng = np.random.default_rng(seed)
    samples = []
    for number in range(n):
        margins = {"slip": rng.uniform(-0.1, 0.2), "torque": rng.uniform(-8.0, 12.0)}
        if number % 3 == 0:
            margins["support"] = rng.uniform(0.05, 0.1)  # never matters
        is_done = bool(rng.random() < TRUTH.probability(margins))
        samples.append(Sample(f"m{number // 5}", margins, is_done))
    return samples


def test_the_gradient_of_the_loss_is_that_of_finite_differences() -> None:
    rng = np.random.default_rng(1)
    x, done = rng.normal(size=(50, 3)), rng.random(50) < 0.5
    x[rng.random((50, 3)) < 0.2] = np.nan
    parameters, step = rng.normal(size=8), 1e-6
    _, gradient = _loss(parameters, x, done)
    for i in range(len(parameters)):
        moved = [parameters + sign * step * np.eye(8)[i] for sign in (1.0, -1.0)]
        up, down = (_loss(at, x, done)[0] for at in moved)
        assert gradient[i] == pytest.approx((up - down) / (2 * step), rel=1e-5, abs=1e-6)


def test_the_fit_finds_what_made_the_data_and_is_calibrated_on_others() -> None:
    model = fit_model(_samples(2, 4000))
    for name, rise in TRUTH.rises.items():
        found, even = model.rises[name], rise.unit * math.sinh(rise.centre)
        assert found.unit * math.sinh(found.centre) == pytest.approx(even, abs=0.3 * rise.unit)
        for margin in np.linspace(-2.0, 3.0, 11) * rise.unit:
            assert found.chance(margin) == pytest.approx(rise.chance(margin), abs=0.1)
    assert model.leak == pytest.approx(TRUTH.leak, abs=0.02)
    others = _samples(3, 2000)
    chances = np.array([model.probability(sample.margins) for sample in others])
    done = np.array([sample.is_done for sample in others])
    judged = calibration(chances, done, [sample.motion for sample in others])
    assert judged.error <= 0.03
    assert judged.brier <= 0.5 * judged.brier_of_base_rate
    assert judged.error_interval[0] <= judged.error_interval[1] <= 0.08


def test_chances_that_are_too_sure_are_told() -> None:
    rng = np.random.default_rng(4)
    chances = rng.random(1000)
    done = rng.random(1000) < chances
    names = [str(number) for number in range(1000)]
    honest = calibration(chances, done, names)
    boastful = calibration(np.where(chances > 0.5, 0.99, 0.01), done, names)
    assert honest.error < 0.06
    assert boastful.error > 0.15
    assert sum(count for *_, count in honest.bins) == 1000


def test_every_motion_has_the_worlds_of_its_half() -> None:
    asked, worlds = exam(), Counter(runs())
    assert {asked[number].family.half: count for number, count in worlds.items()} == WORLDS
    assert WORLDS[TEST] >= 5
    assert [worlds[number] for number in range(len(asked))] == [
        WORLDS[one.family.half] for one in asked
    ]
    assert runs(3) == runs()[: len(runs(3))]
    assert max(runs(3)) == 2


@pytest.mark.parametrize("count", [40, 100, 300])
def test_every_beginning_of_the_exam_is_mixed_evenly(count: int) -> None:
    asked = exam()
    assert len({one.name for one in asked}) == len(asked)
    shares = Counter((one.family.half, one.stratum) for one in asked)
    first = Counter((one.family.half, one.stratum) for one in asked[:count])
    for kind, total in shares.items():
        assert first[kind] == pytest.approx(total * count / len(asked), abs=2.0)


def test_the_order_of_the_exam_is_mixed_and_loses_no_motion() -> None:
    of_one = [q for q in exam() if (q.family.half, q.stratum) == (TRAIN, "easy")]
    quasi_static = [q.family.name for q in of_one if not q.family.is_dynamic]
    families = set(quasi_static)
    assert set(quasi_static[: len(families)]) == families
    asked = exam()
    assert sorted(q.name for q in mixed(asked[:50])) == sorted(q.name for q in asked[:50])


def test_worlds_are_within_the_stated_ranges_and_all_different() -> None:
    worlds = [world_of(seed) for seed in range(200)]
    assert all(0.3 <= world.friction <= 1.0 for world in worlds)
    assert all(0.0 <= world.payload <= PAYLOAD[1] for world in worlds)
    assert len(set(worlds)) == len(worlds)
