"""What users see: the commands print the address, the stream is there, and it ends with the command."""

import re
import socket
import subprocess
import sys

import pytest

pytest.importorskip("foxglove", reason="pip install 'slipbench[foxglove]'")
pytest.importorskip("websockets", reason="pip install websockets")

from websockets.exceptions import ConnectionClosed

from slipbench.bench.foxglove.streams import LAGS
from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.run import run_trial
from tests.bench.foxglove.client import ENDED, PLAY, client
from tests.bench.foxglove.conftest import decoded
from tests.bench.session.plans import plan_file
from tests.bench.view.conftest import serving
from tests.bench.view.recordings import short_trial

STREAM = re.compile(r"foxglove: open (ws://\S+)")


def test_view_replays_for_both_the_page_and_the_stream(run, tmp_path):
    options = ("--view-address", "127.0.0.1:0", "--foxglove-port", "0")
    with serving(tmp_path, "view", str(run), *options, address=STREAM) as command:
        with client(command.url) as viewer:
            viewer.subscribe("/can0/EngineStatus")
            viewer.control(PLAY, speed=20.0)
            viewer.until(lambda: viewer.states and viewer.states[-1][0] == ENDED).receive(0.3)
            assert viewer.values("/can0/EngineStatus") == decoded(run)["/can0/EngineStatus"]
        command.interrupt()
        assert command.process.returncode == 0
        assert "view: http://127.0.0.1:" in command.output
        assert "Traceback" not in command.output


def streamed_trial(folder):
    """Arguments of a short trial with a stream."""
    trial = short_trial(folder, duration="1 s")
    return ("trial", str(trial), "--out", "run", "--foxglove-port", "0")


def subscribe_to_all(viewer):
    viewer.until(lambda: any("EcuStatus" in topic for topic in viewer.channels)).receive(0.05)
    viewer.subscribe()


def test_a_client_that_is_there_when_a_trial_begins_receives_its_whole_recording(tmp_path):
    with serving(tmp_path, *streamed_trial(tmp_path), address=STREAM) as command:
        with client(command.url) as viewer:
            subscribe_to_all(viewer)
            with pytest.raises(ConnectionClosed):
                viewer.until(lambda: False)
        assert command.wait() == 0, command.output
    received = {topic: viewer.values(topic) for topic in viewer.messages}
    signals = {topic: each for topic, each in received.items() if "/slipbench/" not in topic}
    assert signals == decoded(tmp_path / "run")
    assert set(viewer.statuses) <= {LAGS}
    assert viewer.order == sorted(viewer.order)
    assert viewer.values("/slipbench/trial")[-1][1]["phase"] == "done"
    assert viewer.values("/slipbench/lateness")[-1][1]["ticks"] > 1000


def test_a_client_that_stalls_changes_neither_the_recording_nor_the_end(tmp_path):
    """It subscribes and never reads. On the simulated clock two recordings are the same to the byte."""
    with (
        serving(tmp_path, *streamed_trial(tmp_path), address=STREAM) as command,
        client(command.url) as viewer,
    ):
        subscribe_to_all(viewer)
        assert command.wait() == 0, command.output
    alone = tmp_path / "alone"
    run_trial(prepare(tmp_path / "short.toml"), alone, None)
    frames = (tmp_path / "run" / "frames.log").read_bytes()
    assert frames == (alone / "frames.log").read_bytes()


def test_a_session_streams_one_run_after_another(tmp_path):
    """Two runs on the simulated clock, whose times overlap: clients start anew with the second."""
    plan_file(tmp_path, {"repeats": 2})
    session = ("session", "plan.toml", "--out", "two", "--simulate", "--foxglove-port", "0")
    with serving(tmp_path, *session, address=STREAM) as command:
        with client(command.url) as viewer:
            subscribe_to_all(viewer)
            with pytest.raises(ConnectionClosed):
                viewer.until(lambda: False)
        command.wait()
    runs = sorted((tmp_path / "two" / "runs").iterdir())
    assert len(runs) == 2, command.output
    both = [decoded(run)["/can0/EngineStatus"] for run in runs]
    assert viewer.values("/can0/EngineStatus") == [*both[0], *both[1]]
    assert viewer.sessions == 2


def test_a_port_in_use_ends_a_trial_before_it_begins(tmp_path):
    trial = short_trial(tmp_path, duration="1 s")
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        port = str(listening.getsockname()[1])
        done = subprocess.run(
            [sys.executable, "-m", "slipbench", "trial", str(trial), "--foxglove-port", port],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
    assert done.returncode == 2
    assert "--foxglove-port" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "runs").exists()
