"""What users see: the commands print the address, the stream is there, and it ends with the command."""

import re

import pytest

pytest.importorskip("foxglove", reason="pip install 'slipbench[foxglove]'")
pytest.importorskip("websockets", reason="pip install websockets")

from tests.bench.foxglove.client import ENDED, PLAY, client
from tests.bench.foxglove.conftest import decoded
from tests.bench.view.conftest import serving

STREAM = re.compile(r"foxglove: open (ws://\S+)")


def stream_of(command):
    """Address of the stream, once the command has printed it."""
    while not (found := STREAM.search(command.output)):
        assert command.process.poll() is None, command.output
    return found[1]


def test_view_replays_for_both_the_page_and_the_stream(run, tmp_path):
    options = ("--view-address", "127.0.0.1:0", "--foxglove-port", "0")
    with serving(tmp_path, "view", str(run), *options) as command:
        with client(stream_of(command)) as viewer:
            viewer.subscribe("/can0/EngineStatus")
            viewer.control(PLAY, speed=20.0)
            viewer.until(lambda: viewer.states and viewer.states[-1][0] == ENDED).receive(0.3)
            assert viewer.values("/can0/EngineStatus") == decoded(run)["/can0/EngineStatus"]
        command.interrupt()
        assert command.process.returncode == 0
        assert "Traceback" not in command.output
