"""A recording can be cut, and tells what was done when."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.recording import LIMIT_ROWS, Recording

ONE_ARRAY = b"\x93NUMPY\x01\x00v\x00{'descr': '<f8', 'fortran_order': False, 'shape': (1,), }"
ONE_ARRAY = ONE_ARRAY.ljust(127) + b"\n" + bytes(8)  # as ``np.save`` writes it


@pytest.fixture
def recording() -> Recording:
    """Five samples that all differ, from t = 2 s."""
    rng = np.random.default_rng(5)
    return Recording(
        time=2.0 + 0.1 * np.arange(5),
        q=rng.normal(size=(5, 19)),
        v=rng.normal(size=(5, 18)),
        tau=rng.normal(size=(5, 12)),
        foot_forces=rng.normal(size=(5, 4)),
        stance=rng.integers(0, 2, size=(5, 4)).astype(bool),
        p_world_com=rng.normal(size=(5, 3)),
        support_margin=rng.normal(size=5),
        labels=("stand", "stand", "bow", "bow", "stand"),
        robot="a1",
        model_file="my_a1.xml",
        ground=rng.normal(size=(7, 3)),
        multipliers=rng.normal(size=(5, 48)),
        gave_way=rng.random(5) < 0.5,
    )


@pytest.mark.parametrize("rows", [slice(1, 4), np.array([1, 2, 3])], ids=["slice", "rows"])
def test_a_part_has_these_samples_of_every_field(
    recording: Recording, rows: slice | np.ndarray
) -> None:
    part = recording.part(rows)
    for field in fields(Recording):
        whole, kept = getattr(recording, field.name), getattr(part, field.name)
        assert type(kept) is type(whole)
        is_whole = isinstance(whole, str) or field.name == "ground"
        wanted = whole if is_whole else np.array(whole)[1:4]
        np.testing.assert_array_equal(np.array(kept), wanted)
    assert part.duration == pytest.approx(0.2)


def test_labels_become_spans_a_part_may_be_empty_and_all_is_a_table_for_pandas(
    recording: Recording,
) -> None:
    part = recording.part(slice(5, None))
    assert len(part.time) == 0
    assert part.labels == ()
    assert part.duration == 0.0
    spans = recording.spans()
    assert [span.label for span in spans] == ["stand", "bow", "stand"]
    assert [span.start for span in spans] == pytest.approx([0.0, 0.2, 0.4])
    assert [span.end for span in spans] == pytest.approx([0.2, 0.4, 0.4])
    table = pytest.importorskip("pandas") and recording.to_dataframe()
    assert list(table.columns[:3]) == ["time", "label", "q0"]
    assert table["stance3"].tolist() == recording.stance[:, 3].tolist()
    assert table.shape == (5, 2 + 19 + 18 + 12 + 4 + 4 + 3 + 1 + 48 + 1)
    torque = table["multiplier: FR_calf torque"]
    assert torque.tolist() == recording.multipliers[:, 25].tolist()


def test_a_recording_is_saved_and_loaded_whole(recording: Recording, tmp_path: Path) -> None:
    again = Recording.load(recording.save(tmp_path / "run.npz"))
    for field in fields(Recording):
        mine, its = getattr(recording, field.name), getattr(again, field.name)
        assert type(mine) is type(its)
        np.testing.assert_array_equal(np.array(mine), np.array(its))


@pytest.mark.parametrize("content", [None, b"", b"no archive", b"PK\x03\x04 cut", ONE_ARRAY])
def test_a_file_that_is_no_recording_is_told_so(content: bytes | None, tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError, match=r"run.npz is missing, damaged, or no recording"):
        Recording.load(path)


def test_what_binds_is_told_by_name_and_time(recording: Recording) -> None:
    y = np.zeros((5, 48))
    y[0] = np.nan  # no whole-body QP
    y[1:3, LIMIT_ROWS.index("FR friction -y")] = 0.1
    y[2, LIMIT_ROWS.index("RL normal force")] = -0.2
    y[4, LIMIT_ROWS.index("RL normal force")] = 0.2
    y[3, LIMIT_ROWS.index("FL_calf torque")] = -0.3
    y[3, LIMIT_ROWS.index("RR_thigh acceleration")] = 0.3
    y[3:, LIMIT_ROWS.index("FL contact")] = -0.1
    told = replace(recording, multipliers=y, gave_way=np.arange(5) == 4).binding()
    assert [(span.label, round(span.start, 3), round(span.end, 3)) for span in told] == [
        ("friction of FR", 0.1, 0.3),
        ("least normal force of RL", 0.2, 0.3),
        ("torque limit of FL_calf", 0.3, 0.4),
        ("end or speed of RR_thigh", 0.3, 0.4),
        ("contact of FL", 0.3, 0.4),
        ("greatest normal force of RL", 0.4, 0.4),
        ("limits contradict each other", 0.4, 0.4),
    ]


def test_one_that_was_not_explained_says_so_and_loads_as_before(
    recording: Recording, tmp_path: Path
) -> None:
    silent = replace(recording, multipliers=np.empty((0, 48)), gave_way=np.empty(0, bool))
    assert recording.is_explained
    assert not silent.is_explained
    assert silent.binding() == ()
    assert len(silent.part(slice(1, 3)).multipliers) == 0
    loaded = Recording.load(silent.save(tmp_path / "silent.npz"))
    assert not loaded.is_explained
