"""Laws of an interrupted session: it goes on where it was, nothing lost or recorded twice."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from slipbench.bench.session.session import next_step, open_session, run_session
from slipbench.bench.session.session_folder import QUICK_LOOK, complete, locked
from slipbench.bench.trials.connection import Connection
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.run_folder import read
from slipbench.session_commands import look
from tests.bench.session.killed_session import PHASES
from tests.bench.session.plans import plan_file, trial_file
from tests.paths import DEMONSTRATION, ROOT

ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join((str(ROOT / "src"), str(ROOT)))}
RECORDED = ("before the quick look", "quick look", "its file")


def resume(plan: Path, folder: Path) -> list[str]:
    """Lines of the session that goes on."""
    said: list[str] = []
    with locked(folder):
        assert run_session(open_session(plan, folder), Connection(), look, said.append)
    return said


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory) -> Path:
    """Folder of a session that nothing interrupted."""
    folder = tmp_path_factory.mktemp("whole")
    resume(plan_file(folder), folder / "out")
    return folder / "out"


@pytest.mark.parametrize("phase", PHASES)
def test_a_killed_session_goes_on_where_it_was(phase, tmp_path, uninterrupted):
    plan, out = plan_file(tmp_path), tmp_path / "out"
    killed = subprocess.run(
        [sys.executable, "-m", "tests.bench.session.killed_session", plan, out, phase],
        env=ENVIRONMENT,
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert killed.returncode == -signal.SIGKILL, killed.stderr
    frames = out / "runs" / "sweep-1" / "frames.log"
    before = frames.read_bytes()
    inode = frames.stat().st_ino
    said = resume(plan, out)
    folders = sorted(path.name for path in (out / "runs").iterdir())
    if phase in RECORDED:
        assert folders == ["sweep-1"]
        assert frames.stat().st_ino == inode, "the run was recorded twice"
    else:
        assert folders == ["sweep-1", "sweep-1-incomplete-1"]
        kept = out / "runs" / "sweep-1-incomplete-1"
        assert (kept / "frames.log").read_bytes() == before, "the interrupted recording was lost"
        assert not complete(kept)
        assert "kept as sweep-1-incomplete-1" in said[0]
        assert read(kept).frame_count > 0
    whole = uninterrupted / "runs" / "sweep-1"
    for name in ("frames.log", QUICK_LOOK):
        assert (out / "runs" / "sweep-1" / name).read_bytes() == (whole / name).read_bytes()


def test_an_interrupt_at_any_time_says_where_the_same_command_goes_on(tmp_path):
    """After the trial, too, when the trial itself no longer catches it."""

    def interrupted(*_):
        raise KeyboardInterrupt

    plan, said = plan_file(tmp_path), []
    with locked(tmp_path / "out"), pytest.raises(KeyboardInterrupt):
        run_session(open_session(plan, tmp_path / "out"), Connection(), interrupted, said.append)
    assert said[-1] == "stopped; the same command goes on with sweep-1"
    assert any("sweep-1: good" in line for line in resume(plan, tmp_path / "out"))


def test_a_session_that_is_complete_records_nothing_more(uninterrupted, tmp_path):
    plan = plan_file(uninterrupted.parent)
    with locked(uninterrupted):
        assert next_step(open_session(plan, uninterrupted)) is None
    assert resume(plan, uninterrupted) == []


def test_a_changed_trial_is_refused_once_it_was_recorded(uninterrupted, tmp_path):
    plan = plan_file(tmp_path, {"gear": 3})
    with locked(uninterrupted), pytest.raises(InputError, match="differs from the recorded"):
        open_session(plan, uninterrupted)
    more = plan_file(tmp_path, {"repeats": 2}, {"name": "other", "gear": 3})
    with locked(uninterrupted):
        assert next_step(open_session(more, uninterrupted)).run.name == "other-1"


def test_two_sessions_do_not_share_a_folder(tmp_path):
    with locked(tmp_path), pytest.raises(InputError, match="another session"), locked(tmp_path):
        pass


def test_a_recording_that_lost_its_end_is_incomplete(uninterrupted, tmp_path):
    """What a power cut does: the outcome reached the disk, the last frames did not."""
    run = shutil.copytree(uninterrupted / "runs" / "sweep-1", tmp_path / "sweep-1")
    (run / QUICK_LOOK).unlink()  # it is written when the other files have reached the disk
    assert complete(run)
    log = run / "frames.log"
    text = log.read_bytes()
    for lost in (text[: len(text) * 9 // 10], text[: len(text) * 9 // 10] + bytes(5000), b""):
        log.write_bytes(lost)
        assert not complete(run)
    log.write_bytes(text[:-10])  # a torn last line
    assert complete(run)
    trial = (run / "trial.toml").read_bytes()
    for lost in (b"", bytes(len(trial))):
        (run / "trial.toml").write_bytes(lost)
        assert not complete(run)


def test_a_lost_terminal_ends_no_trial(tmp_path):
    plan, out = plan_file(tmp_path), tmp_path / "out"
    command = [sys.executable, "-m", "slipbench", "session", plan, "--out", out, "--simulate"]
    process = subprocess.Popen(command, env=ENVIRONMENT, stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.readline()
    process.stdout.close()
    process.wait()
    with locked(out):
        assert next_step(open_session(plan, out)) is None
    assert [path.name for path in (out / "runs").iterdir()] == ["sweep-1"]


def test_a_session_that_was_moved_goes_on(uninterrupted, tmp_path):
    out = shutil.copytree(uninterrupted, tmp_path / "deeper" / "moved")
    with locked(out):
        assert next_step(open_session(plan_file(tmp_path), out)) is None


def test_another_vehicle_is_refused_once_runs_are_recorded(tmp_path):
    vehicle = shutil.copy(DEMONSTRATION, tmp_path / "vehicle.toml")
    base = trial_file(tmp_path)
    text = (tmp_path / base).read_text().replace(str(DEMONSTRATION), "vehicle.toml")
    (tmp_path / base).write_text(text)
    plan, out = plan_file(tmp_path, {"file": base}), tmp_path / "out"
    resume(plan, out)
    changed = vehicle.read_text().replace("radius = { value = 0.32", "radius = { value = 0.33")
    assert changed != vehicle.read_text()
    vehicle.write_text(changed)
    with locked(out), pytest.raises(InputError, match="the vehicle of trial 'sweep' differs"):
        open_session(plan, out)


def test_a_session_in_real_time_that_is_killed_goes_on(tmp_path):
    """All processes of the trial end, and the next session records the run anew."""
    plan, out = plan_file(tmp_path), tmp_path / "out"
    command = [sys.executable, "-m", "slipbench", "session", plan, "--out", out, "--real-time"]
    process = subprocess.Popen(command, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    for line in process.stdout:
        if "exciting" in line:
            process.kill()
            break
    else:
        pytest.fail("the trial never came to its excitation")
    process.stdout.read()  # ends when the last process that holds the pipe has ended
    assert process.wait() == -signal.SIGKILL
    resume(plan, out)
    assert sorted(path.name for path in (out / "runs").iterdir()) == [
        "sweep-1",
        "sweep-1-incomplete-1",
    ]
