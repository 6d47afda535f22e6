"""The report of the bridges' bench: no value, or one on the wrong side, is never ok."""

from __future__ import annotations

import math

import pytest

from controller.bench.bridges import ROS2_ROWS, BridgeReport, render

BARRED = [row for row in ROS2_ROWS if row.bar is not None]
GOOD = {row.name: row.bar or 0.0 for row in ROS2_ROWS}


def test_values_at_their_bars_are_ok() -> None:
    report = BridgeReport(GOOD)
    assert report.ok
    assert render(report).count("  ok") == len(ROS2_ROWS)
    assert report.as_dict()["passed"] is True


@pytest.mark.parametrize(
    "row", [row for row in ROS2_ROWS if row.bar is not None], ids=lambda row: row.name
)
@pytest.mark.parametrize("value", [None, math.nan, 1e3])
def test_a_value_that_is_missing_or_beyond_its_bar_fails(row: object, value: float | None) -> None:
    name = getattr(row, "name", "")
    values = {key: item for key, item in GOOD.items() if key != name}
    if value is not None:
        values[name] = value
    report = BridgeReport(values, ("sit: fell",))
    assert not report.ok
    assert render(report).count("  NO") == 1
    assert "sit: fell" in render(report)
    assert [row["passed"] for row in report.as_dict()["rows"]].count(False) == 1


def test_the_table_fits_a_terminal() -> None:
    assert max(map(len, render(BridgeReport({})).splitlines())) <= 80
