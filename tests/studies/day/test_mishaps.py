"""A run in which something goes wrong is an attempt of its session, and the session repeats it."""

from slipbench.bench.session.session import open_session
from slipbench.bench.session.session_folder import locked
from slipbench.studies.day.mishaps import SILENT_FROM, record, silent_sensors, soft_tyre
from tests.bench.session.plans import EXCITATION, plan_file
from tests.bench.test_commands import run as slipbench

LONG = {**EXCITATION, "stop": "10 Hz", "duration": "8 s"}


def test_a_tripped_run_and_a_disturbed_one_are_repeated(monkeypatch, capsys, tmp_path):
    plan = plan_file(tmp_path, {"excitation": LONG, "repeats": 3})
    assert SILENT_FROM > 4.0, "the bench has armed by then"
    record(plan, tmp_path / "day", (silent_sensors("sweep-2"), soft_tyre("sweep-3")))
    arguments = ("session", plan, "--out", tmp_path / "day", "--simulate")
    status, said, _ = slipbench(monkeypatch, capsys, *arguments)
    assert status == 0, said
    assert "sweep-2: repeat: it tripped" in said
    assert "sweep-3: repeat: it differs by" in said
    with locked(tmp_path / "day"):
        session = open_session(plan, tmp_path / "day")
        verdicts = [[each.verdict for each in session.attempts(run)] for run in session.runs]
    assert verdicts == [["good"], ["repeat", "good"], ["repeat", "good"]]
