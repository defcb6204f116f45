"""A fleet is read with its faults named, judged side by side, and told in one table."""

import json
from pathlib import Path

import pytest
from distributed import LocalCluster

from slipbench.identification.cluster import Workers
from slipbench.identification.fleet.fleet import TABLE, VERDICT, explain_fleet, table
from slipbench.identification.fleet.fleet_file import read_fleet
from slipbench.protocol.errors import InputError

GOOD = """
[[analyses]]
name = "one"
vehicle = "one.toml"
training = ["runs/a"]

[[analyses]]
name = "two"
vehicle = "two.toml"
training = ["runs/b", "runs/c"]
held_out = ["runs/d"]
"""
DONE = {
    "mismatch": {"found": True, "p_value": 0.0},
    "sentence": "It lacks a backlash.",
    "effects": [{"name": "channel_lag", "subject": "engine_speed"}],
    "unknown": {"found": False, "shape": ""},
}


def written(folder: Path, text: str = GOOD) -> Path:
    path = folder / "season.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_paths_are_relative_to_the_file(tmp_path: Path) -> None:
    two = read_fleet(written(tmp_path))[1]
    assert two.training == (str(tmp_path / "runs/b"), str(tmp_path / "runs/c"))


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (GOOD.replace('"two"', '"one"'), "several analyses are called one"),
        (GOOD.replace("held_out", "heldout"), "did you mean 'held_out'"),
        (GOOD.replace('["runs/a"]', "[]"), "training"),
        (GOOD.replace('"two"', '"bike 2"'), "letters, digits and . _ - only"),
    ],
)
def test_faults_of_the_file_are_named(tmp_path: Path, text: str, fault: str) -> None:
    with pytest.raises(InputError, match=fault):
        read_fleet(written(tmp_path, text))


def test_what_is_done_stays_and_what_cannot_be_judged_says_why(tmp_path: Path) -> None:
    entries = read_fleet(written(tmp_path))
    (tmp_path / "out" / "one").mkdir(parents=True)
    (tmp_path / "out" / "one" / VERDICT).write_text(json.dumps(DONE), encoding="utf-8")
    with LocalCluster(n_workers=1, processes=False, dashboard_address="127.0.0.1:0") as cluster:
        place = Workers(scheduler=cluster.scheduler_address)
        one, two = explain_fleet(entries, tmp_path / "out", place)
    assert one["effects"] == ["channel_lag.engine_speed"]
    assert "two.toml" in two["trouble"]
    assert "not analysed" in (tmp_path / "out" / TABLE).read_text(encoding="utf-8")


def test_a_mismatch_without_a_name_is_told_as_such() -> None:
    row = {"name": "x", "mismatch": True, "sentence": "", "effects": [], "unknown": True}
    assert "unknown effect" in table([row])


def test_a_trouble_of_several_lines_is_one_cell() -> None:
    text = table([{"name": "x", "trouble": str(InputError("a | b", found="c", remedy="d"))}])
    assert text.splitlines()[2] == r"| x | not analysed | | a \| b; found: c; remedy: d |"


def test_an_analysis_that_failed_is_told_as_trouble(tmp_path: Path) -> None:
    """Its verdict holds what was found before, and the failure; the others go on."""
    for name, tree in (("one", DONE), ("two", {**DONE, "failure": "calibration: ValueError"})):
        (tmp_path / name).mkdir()
        (tmp_path / name / VERDICT).write_text(json.dumps(tree), encoding="utf-8")
    one, two = explain_fleet(read_fleet(written(tmp_path)), tmp_path, Workers(1))
    assert "trouble" not in one
    assert two == {"name": "two", "trouble": "the analysis failed in calibration: ValueError"}
