"""Laws of the table: a filter agrees with Python, analyses belong to their runs, faults are readable."""

import math

import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.identification.season.entry import Entry, around
from slipbench.identification.season.folders import Folder
from slipbench.identification.season.index import refreshed
from slipbench.identification.season.season import Season
from slipbench.protocol.errors import InputError
from tests.identification.season.seasons import explain, identify, make_run, write

TYRES = ("new", "old", "it's", 'a "b"')
RUNS = st.lists(
    st.fixed_dictionaries(
        {},
        optional={
            "tyre": st.sampled_from(TYRES),
            "mileage": st.integers(0, 1000),
            "gear": st.integers(1, 6),  # a tag that is called as a fact
            "resonance": st.floats(1, 20),  # a tag that is called as a parameter
        },
    ),
    max_size=12,
)


def entries(tags):
    return [
        Entry(
            Folder(f"r{i}", "run"), parameters=tuple(around("resonance", "Hz", 5.0 + i, 0.1))
        ).with_tags(one)
        for i, one in enumerate(tags)
    ]


@settings(max_examples=40, deadline=None)
@given(RUNS, st.sampled_from(TYRES), st.integers(0, 1000))
def test_a_filter_agrees_with_python(tags, tyre, mileage):
    season = Season(entries(tags))
    if not {"tyre", "mileage"} <= set(season.columns):
        return
    text = tyre.replace("'", "''")
    found = season.rows(f"tyre = '{text}' and mileage > {mileage} or resonance < 6")
    expected = {
        f"r{i}"
        for i, one in enumerate(tags)
        if (one.get("tyre") == tyre and one.get("mileage", -1) > mileage) or 5.0 + i < 6
    }
    assert {row["name"] for row in found} == expected


@settings(max_examples=40, deadline=None)
@given(RUNS)
def test_every_fact_tag_and_interval_has_its_column(tags):
    season = Season(entries(tags))
    found = {row["name"]: row for row in season.rows()}
    assert len(found) == len(tags)
    for i, one in enumerate(tags):
        row = found[f"r{i}"]
        for key, value in one.items():
            column = f"tag_{key}" if key in ("gear", "resonance") else key
            assert row[column] == value
        assert row["resonance"] == 5.0 + i
        assert row["resonance_low"] < row["resonance"] < row["resonance_high"]
        assert row["gear"] is None


def test_a_tag_that_is_number_and_text_is_named_and_a_text():
    season = Season(entries([{"mileage": 8}, {"mileage": "9 km"}]))
    assert season.mixed == ("mileage",)
    assert {row["mileage"] for row in season.rows()} == {"8", "9 km"}


def test_the_newest_run_is_first(tmp_path):
    for day, name in ((3, "a"), (9, "b"), (5, "c")):
        make_run(tmp_path / name, day)
    (make_run(tmp_path / "d") / "run.toml").unlink()
    assert [row["name"] for row in Season(refreshed(tmp_path)).rows()] == ["b", "c", "a", "d"]


@pytest.mark.parametrize(
    ("where", "words"),
    [
        ("tyer = 'new'", "did you mean 'tyre'"),
        ('tyre = "new"', "single quotes: 'new'"),
        ("tyre = ", "syntax error"),
        ("tyre > 3 and nothing(gear)", "nothing"),
        ("name", "Could not convert"),
        ("1 = 1; drop table season", "Parser"),
        ("name in (select content from read_text('/etc/hostname'))", "Permission|disabled"),
        ("gear = (select max(gear) from '/etc/hostname')", "cannot be evaluated"),
        ("mileage / 'a' > 1", "cannot be evaluated"),
        ("error('x')", "cannot be evaluated"),
        ("", "cannot be evaluated"),
    ],
)
def test_a_filter_that_cannot_be_evaluated_says_why(where, words):
    season = Season(entries([{"tyre": "new", "mileage": 1}]))
    with pytest.raises(InputError, match=words) as caught:
        season.rows(where)
    assert "--where" in str(caught.value)
    assert len(season.rows()) == 1


def test_an_identification_elsewhere_goes_to_its_run(tmp_path):
    for name in ("monday/runs/a-1", "tuesday/runs/a-1"):
        make_run(tmp_path / name, 1, {"tyre": "new"})
    identify(tmp_path / "monday/report", 7.5, "usable with reservations", recording="a-1")
    rows = {row["path"]: row for row in Season(refreshed(tmp_path)).rows()}
    assert set(rows) == {"monday/runs/a-1", "tuesday/runs/a-1"}
    found = rows["monday/runs/a-1"]
    assert (found["natural_frequency"], found["verdict"]) == (7.5, "usable with reservations")
    assert rows["tuesday/runs/a-1"]["natural_frequency"] is None


def test_an_identification_of_two_possible_runs_or_of_none_is_listed_with_that_fault(tmp_path):
    for name in ("monday/runs/a-1", "tuesday/runs/a-1"):
        make_run(tmp_path / name)
    identify(tmp_path / "reports/one", 7.5, recording="a-1")
    identify(tmp_path / "reports/two", 7.5, recording="b-1")
    faults = {
        row["path"]: row["fault"] for row in Season(refreshed(tmp_path)).rows("kind <> 'run'")
    }
    assert "several runs are called 'a-1'" in faults["reports/one"]
    assert "'b-1' is not in this folder" in faults["reports/two"]


def test_a_second_identification_of_a_run_is_an_entry_with_its_tags(tmp_path):
    run = make_run(tmp_path / "runs/a-1", 4, {"tyre": "new"}, 8.0)
    identify(run / "window", 9.0, recording="a-1")
    rows = {row["kind"]: row for row in Season(refreshed(tmp_path)).rows()}
    assert rows["run"]["natural_frequency"] == 8.0
    assert (rows["identify"]["natural_frequency"], rows["identify"]["tyre"]) == (9.0, "new")


def test_an_explanation_has_what_its_training_runs_have_in_common(tmp_path):
    for i in (1, 2, 3):
        tags = {"tyre": "new", "mileage": 100 * i, "rider": f"r{i}"}
        make_run(tmp_path / f"monday/runs/a-{i}", i, tags)
    explain(tmp_path / "memo", 1.5, training=("../monday/runs/a-1@0:60", "../monday/runs/a-2"))
    explain(tmp_path / "other", 1.5, training=("../monday/runs/a-9",))
    (lacks, row) = sorted(
        Season(refreshed(tmp_path)).rows("kind = 'explain'"), key=lambda r: not r["fault"]
    )
    assert "not in this folder: monday/runs/a-9" in lacks["fault"]
    assert (row["tyre"], row["mileage"], row["rider"]) == ("new", 150.0, None)
    assert row["date"].day == 1
    assert (row["backlash_slack"], row["backlash_slack_low"]) == (1.5, pytest.approx(1.2))
    assert row["verdict"] == "mismatch: backlash"


def test_the_explanation_of_a_session_has_the_tags_of_its_runs(tmp_path):
    write(tmp_path / "monday/plan.toml", "name = 'day'")
    make_run(tmp_path / "monday/runs/a-1", 1, {"mileage": 5})
    make_run(tmp_path / "tuesday/runs/a-1", 1, {"mileage": 7})
    explain(tmp_path / "monday/memo", 1.5)
    (row,) = Season(refreshed(tmp_path)).rows("kind = 'explain'")
    assert (row["session"], row["mileage"]) == ("monday", 5.0)


@pytest.mark.parametrize("interval", [None, [None, 3.0], [1.0], "x", [math.nan, 2.0]])
def test_an_effect_without_a_usable_interval_has_its_value(tmp_path, interval):
    import json

    explain(tmp_path / "memo", 1.5)
    path = tmp_path / "memo/verdict.json"
    tree = json.loads(path.read_text())
    tree["effects"][0]["parameters"][0]["interval"] = interval
    write(path, json.dumps(tree))
    (row,) = Season(refreshed(tmp_path)).rows()
    assert row["backlash_slack"] == 1.5
    assert row.get("backlash_slack_low") is None


def test_what_is_exported_is_the_table(tmp_path):
    from slipbench.identification.season.export import write_season

    make_run(tmp_path / "runs/a", 1, {"tyre": "new"}, 8.0)
    make_run(tmp_path / "runs/b", 2, {"tyre": "old"}, 9.0)
    season = Season(refreshed(tmp_path))
    assert write_season(season, tmp_path / "out.parquet", "tyre = 'old'") == 1
    assert pq.read_table(tmp_path / "out.parquet").to_pylist() == season.rows("tyre = 'old'")
    for wrong in ("out.parquet", "out.csv"):
        with pytest.raises(InputError):
            write_season(season, tmp_path / wrong)
