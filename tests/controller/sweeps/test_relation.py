"""Outcomes over what was swept: counted again by hand, in bins and in grids."""

import numpy as np
import pytest

from controller.sweeps.relation import relations
from controller.sweeps.summary import mean_interval, rate_interval
from controller.sweeps.sweep_file import columns_of
from go2_wbc.errors import CommandError, ConfigError
from viz.render.plots import relation_figure

RNG = np.random.default_rng(4)
FRICTION = RNG.uniform(0.4, 1.0, 96)
SPEED = RNG.choice([0.2, 0.4, 0.6], 96)
DONE = FRICTION + 0.2 * RNG.random(96) > 0.7
ROWS = [
    {"seed": k, "done": bool(done), "friction": f, "speed": v, "closest_share": 1.0 - f, "fall": ""}
    for k, (done, f, v) in enumerate(
        zip(DONE.tolist(), FRICTION.tolist(), SPEED.tolist(), strict=True)
    )
]
COLUMNS = columns_of(ROWS[0])


def test_a_rate_over_what_the_seeds_drew_is_that_of_its_bins() -> None:
    done, margin = relations(ROWS, COLUMNS)
    assert (done.outcome, done.over, done.is_rate) == ("done", ("friction",), True)
    order = np.argsort(FRICTION)
    for part, stats, place in zip(np.split(order, 8), done.stats, done.places, strict=True):
        count = int(DONE[part].sum())
        assert stats == pytest.approx([count / 12, *rate_interval(count, 12), 12])
        assert place == pytest.approx(FRICTION[part].mean())
        assert margin.stats[done.places == place][0][0] == pytest.approx(FRICTION[part].mean())
    assert margin.dots[:, 0] == pytest.approx(margin.dots[:, 1])


def test_over_a_few_values_each_is_a_bin_and_over_two_parameters_it_is_a_grid() -> None:
    _, margin = relations(ROWS, COLUMNS, ["speed"])
    assert margin.labels == (("0.2", "0.4", "0.6"),)
    mine = FRICTION[SPEED == 0.4]
    assert margin.stats[1] == pytest.approx([mine.mean(), *mean_interval(mine), len(mine)])
    done, _ = relations(ROWS, COLUMNS, ["speed", "friction"])
    assert done.stats.shape == (3, 3, 4)
    assert done.stats[..., 3].sum() == 96
    row = done.stats[1]
    assert (row[:, 0] * row[:, 3]).sum() == pytest.approx(DONE[SPEED == 0.4].sum())


def test_what_cannot_be_drawn_over_is_said() -> None:
    with pytest.raises(
        CommandError, match="unknown column of numbers 'fall'; valid: closest_share, friction"
    ):
        relations(ROWS, COLUMNS, ["fall"])
    with pytest.raises(CommandError, match="one or two parameters, got 3"):
        relations(ROWS, COLUMNS, ["friction", "speed", "closest_share"])
    with pytest.raises(ConfigError, match="nothing to plot"):
        relation_figure([], title="")


@pytest.mark.parametrize("over", [["speed"], ["speed", "friction"]])
def test_an_outcome_that_is_never_known_leaves_an_empty_panel(over: list[str]) -> None:
    rows = [{**row, "closest_share": float("nan")} for row in ROWS]
    figure = relation_figure(relations(rows, COLUMNS, over), title="none $ known")
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        "done: rate, 95 %",
        "margin, share left: mean, 95 %",
    ]
    figure.draw_without_rendering()
