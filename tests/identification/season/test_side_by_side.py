"""Laws of two runs side by side: the difference has a sign and an error rate, and nothing is hidden."""

import numpy as np
import pytest

from slipbench.identification.season.entry import Entry, around
from slipbench.identification.season.folders import Folder
from slipbench.identification.season.index import refreshed
from slipbench.identification.season.season import Season
from slipbench.identification.season.side_by_side import differences, pair, table
from slipbench.protocol.errors import InputError
from tests.bench.test_commands import run
from tests.identification.season.seasons import make_run

SEED = 7


def season_of(*values, deviations):
    """Runs r0, r1, ... with parameters p0, p1, ..."""
    return Season(
        [
            Entry(
                Folder(f"r{i}", "run"),
                parameters=tuple(
                    one
                    for k, (value, deviation) in enumerate(zip(row, deviations, strict=True))
                    for one in around(f"p{k}", "Hz", value, deviation)
                ),
            )
            for i, row in enumerate(values)
        ]
    )


def found(season, first="r0", second="r1"):
    return differences(season, *pair(season, (first, second)))


def test_equal_runs_differ_in_something_in_at_most_5_percent_of_pairs():
    print("seed", SEED)
    generator, hits, pairs = np.random.default_rng(SEED), 0, 300
    deviations = np.array([0.1, 1.0, 5.0, 0.01, 2.0])
    rows = generator.normal(0, deviations, (2 * pairs, 5))
    season = season_of(*rows.tolist(), deviations=deviations.tolist())
    table_rows = {row["name"]: row for row in season.rows()}
    for i in range(pairs):
        tests = differences(season, table_rows[f"r{2 * i}"], table_rows[f"r{2 * i + 1}"])
        hits += any(one.p_value < 0.05 for one in tests)
    assert hits <= 0.05 * pairs + 3 * np.sqrt(0.05 * 0.95 * pairs)
    assert hits > 0


def test_the_difference_is_second_minus_first_with_both_intervals():
    season = season_of([10.0, 1.0], [13.0, 1.0], deviations=[0.3, 0.4])
    there, back = found(season), found(season, "r1", "r0")
    assert [one.value for one in there] == [3.0, 0.0]
    assert [one.value for one in back] == [-3.0, 0.0]
    assert there[0].high - there[0].low == pytest.approx(2 * 1.96 * 0.3 * np.sqrt(2), rel=1e-3)
    assert [one.p_value for one in there] == [one.p_value for one in back]
    assert [one.words[:7] for one in there] == ["differs", "equal w"]


def test_without_an_interval_there_is_no_test():
    season = season_of([1.0], [2.0], deviations=[None])
    assert [(one.value, one.p_value, one.words) for one in found(season)] == [
        (1.0, None, "no interval")
    ]


@pytest.fixture
def folder(tmp_path):
    make_run(tmp_path / "monday/a-1", 1, {"tyre": "new", "track": "Mugello"}, 8.0)
    make_run(tmp_path / "tuesday/a-1", 2, {"tyre": "old", "track": "Mugello"}, 9.5)
    make_run(tmp_path / "tuesday/a-2", 2)
    return tmp_path


def test_the_table_has_what_differs_and_every_parameter(folder):
    season = Season(refreshed(folder))
    head, cells = table(season, *pair(season, ("monday/a-1", "tuesday/a-1")))
    rows = {row[0]: row[1:] for row in cells}
    assert head == ["", "monday/a-1", "tuesday/a-1", "difference", ""]
    assert rows["tyre"][:2] == ["new", "old"]
    assert "track" not in rows
    assert rows["natural_frequency, Hz"][2] == "1.50 (1.22 to 1.78)"
    assert rows["natural_frequency, Hz"][3] == "differs (p < 0.001)"
    _, cells = table(season, *pair(season, ("monday/a-1", "a-2")))
    assert {row[0]: row[4] for row in cells}["natural_frequency, Hz"] == "in one run only"


def test_names(folder, monkeypatch, capsys):
    season = Season(refreshed(folder))
    with pytest.raises(InputError, match="several runs"):
        pair(season, ("a-1", "a-2"))
    with pytest.raises(InputError, match="did you mean 'a-2'"):
        pair(season, ("a-3", "monday/a-1"))
    status, out, _ = run(monkeypatch, capsys, "runs", folder, "--compare", "monday/a-1", "a-2")
    assert status == 0
    assert out.splitlines()[0].split() == ["a-1", "a-2", "difference"]
