"""A session designs the trial for what its analysis left open; its run settles the question."""

from slipbench.identification.experiments import search
from slipbench.protocol.configuration import load_toml
from tests.bench.session.analyses import explained_by_files
from tests.bench.session.test_designed_runs import Day

QUICK = search.Effort(refined=1, rounds=0, offered=1, drawn=1)


def test_the_designed_trial_keeps_the_limits_and_settles_the_question(
    monkeypatch, capsys, tmp_path
):
    monkeypatch.setattr(search, "THOROUGH", QUICK)
    explained_by_files(monkeypatch)
    day = Day(monkeypatch, capsys, tmp_path)
    status, said, err = day.give("--accept")
    assert status == 0, (said, err)
    assert day.runs == ["designed_1-1", "sweep-1", "sweep-2"]
    assert "backlash stands, the others are rejected" in said
    recorded, planned = (
        load_toml(day.out / "runs" / run / "trial.toml")["limits"]
        for run in ("designed_1-1", "sweep-1")
    )
    kept = {key: value for key, value in recorded.items() if key != "distance"}
    assert kept.items() <= planned.items()
