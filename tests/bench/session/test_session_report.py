"""Laws of a session's report: it is made from the folder, counts usable runs only, says what is next."""

import json
from dataclasses import replace

from slipbench.identification.session.day import Day, Run, explanation, results
from slipbench.identification.session.page import page
from slipbench.session_commands import NOT_ALL_USABLE
from tests.bench.session.plans import EXCITATION, plan_file, trial_file
from tests.bench.test_commands import run as slipbench

BAND = {**EXCITATION, "start": "0.5 Hz", "stop": "12 Hz", "duration": "8 s"}
SPARK = {**BAND, "actuator": "spark", "amplitude": "4 deg"}


def report_of(out):
    return json.loads((out / "session.json").read_text()), (out / "report.html").read_text()


def test_the_report_pools_repeats_compares_throttle_with_spark_and_says_what_is_next(
    monkeypatch, capsys, tmp_path
):
    plan = plan_file(
        tmp_path,
        {"name": "throttle", "repeats": 2, "excitation": BAND},
        {"name": "spark", "excitation": SPARK},
        description="Monday at the track",
    )
    out = tmp_path / "out"
    arguments = ("session", plan, "--out", out, "--simulate")
    status, said, _ = slipbench(monkeypatch, capsys, *arguments)
    assert status == 0
    assert f"report: {out / 'report.html'}" in said
    figures, page = report_of(out)
    throttle, spark = figures["pooled"]
    assert throttle["runs"] == ["throttle-1", "throttle-2"]
    assert throttle["response"]["method"].startswith("mean of 2 runs")
    assert spark["runs"] == ["spark-1"]
    single = json.loads((out / "runs" / "throttle-1" / "quick_look.json").read_text())["response"]
    assert sum(throttle["response"]["deviation"]) < sum(single["deviation"])
    assert "the spark leads the throttle by" in figures["throttle_against_spark"]
    assert any("spark: ride it again" in step for step in figures["next_steps"])
    for words in ("Monday at the track", "3 of 3 planned runs are usable", "throttle-2", "<svg"):
        assert words in page
    before = page
    status, said, _ = slipbench(monkeypatch, capsys, *arguments)
    assert status == 0
    assert report_of(out)[1] == before, "the report does not follow from the folder alone"


def test_a_run_that_tripped_is_in_the_report_and_not_in_the_pool(monkeypatch, capsys, tmp_path):
    base = trial_file(tmp_path, rider={"holds_button_for": "2 s"})
    plan = plan_file(tmp_path, {"file": base}, attempts=1)
    out = tmp_path / "out"
    status, *_ = slipbench(
        monkeypatch, capsys, "session", plan, "--out", out, "--simulate", "--explain", "nominal"
    )
    assert status == NOT_ALL_USABLE
    figures, page = report_of(out)
    assert figures["headline"] == "0 of 1 planned runs are usable."
    assert figures["pooled"] == []
    assert "Not compared" in page
    assert "fewer than 2 runs are usable" in figures["explanation"]
    assert "sweep: repeat: it tripped" in figures["next_steps"][0]


def test_the_findings_of_explain_its_memo_and_its_next_trial_are_in_the_page():
    """The verdict is as verdict.json has it: docs of `slipbench explain`."""
    explained = {
        "mismatch": {"found": True, "p_value": 1e-6},
        "effects": [{"name": "gear_play"}],
        "next_trial": {"why": "a square wave would show gear play", "trial": {}},
    }
    look = {"verdict": "good", "counts": True, "reason": "fine"}
    day = Day("day", "", 1, (Run("sweep", "sweep-1", look),), (), explained, "", "memo/memo.html")
    found = results(day)
    text = page(day, found)
    assert explanation(day) == "Effects that the simulation lacks: gear play."
    assert '<a href="memo/memo.html">Memo</a>' in text
    assert "next trial: a square wave would show gear play (memo/next_trial.toml)" in text
    nothing = replace(day, explained={"mismatch": {"found": False}, "effects": []})
    assert "No significant mismatch" in explanation(nothing)
