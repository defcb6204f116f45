"""Laws of the command: exit status and words, on captures and on the project's own bus."""

import os
from pathlib import Path

import pytest

from slipbench import dbc
from slipbench.protocol.codec.codec import Sender
from slipbench.protocol.codec.messages import ActuatorCommand, Authority
from tests.bench.check.harness import own, world
from tests.bench.test_commands import run
from tests.bench.test_restbus_command import vehicle

BINDING = Path(dbc.MOTORBIKE_ROLES)


@pytest.fixture(scope="module")
def capture(tmp_path_factory) -> Path:
    """A candump log of a healthy bus."""
    with world(own()) as made:
        frames = made.frames(1.0)
    path = tmp_path_factory.mktemp("check") / "bike.log"
    path.write_text(
        "".join(f"({f.timestamp:.6f}) can0 {f.arbitration_id:03X}#{f.data.hex()}\n" for f in frames)
    )
    return path


def test_a_healthy_capture_is_status_0(monkeypatch, capsys, capture) -> None:
    status, out, err = run(monkeypatch, capsys, "check", BINDING, "--log", capture)
    assert status == 0, err + out
    assert "nothing is missing for a trial" in out


def test_a_capture_without_one_device_is_status_3(monkeypatch, capsys, capture, tmp_path) -> None:
    lines = [line for line in capture.read_text().splitlines(True) if " 060#" not in line]
    (tmp_path / "cut.log").write_text("".join(lines))
    status, out, _ = run(monkeypatch, capsys, "check", BINDING, "--log", tmp_path / "cut.log")
    assert status == 3
    assert "not live: optical_speed" in out


@pytest.mark.parametrize(("mark", "expected"), [(" T", 0), ("", 3)])
def test_requests_are_those_of_another_node_unless_the_logger_sent_them(
    monkeypatch, capsys, capture, tmp_path, mark: str, expected: int
) -> None:
    lines = capture.read_text().splitlines(True)
    sender, start = Sender(own().codec()), float(lines[0][1:].partition(")")[0])
    for number in range(40):
        command = ActuatorCommand(Authority.NONE, 0.0, 0.0, number * 1e-3)
        identifier, data = sender.encode(command)
        lines.append(f"({start + number * 1e-3:.6f}) can0 {identifier:03X}#{data.hex()}{mark}\n")
    (tmp_path / "own.log").write_text("".join(sorted(lines)))
    status, out, _ = run(monkeypatch, capsys, "check", BINDING, "--log", tmp_path / "own.log")
    assert status == expected
    assert ("another node sends ActuatorCommand" in out) == (expected == 3)


def test_another_bus_is_status_2(monkeypatch, capsys, tmp_path) -> None:
    (tmp_path / "other.log").write_text("(1.0) can0 7A5#00\n(1.1) can0 7A5#01\n")
    status, out, _ = run(monkeypatch, capsys, "check", BINDING, "--log", tmp_path / "other.log")
    assert status == 2
    assert "nothing was received" in out
    assert "0x7a5" in out


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ((), "one source of frames"),
        (("--silence", "--log", "x.log"), "one source of frames"),
        (("--interface", "slipbench", "--log", "x.log"), "one source of frames"),
    ],
)
def test_one_source_of_frames(monkeypatch, capsys, arguments, word) -> None:
    status, out, err = run(monkeypatch, capsys, "check", BINDING, *arguments)
    assert (status, out) == (2, "")
    assert word in err


def test_a_live_bus_is_checked_and_silence_with_a_running_engine_is_refused(
    monkeypatch, capsys
) -> None:
    channel = f"check-{os.getpid()}"
    bus = ("--interface", "slipbench", "--channel", channel)
    with vehicle(channel):
        status, out, err = run(monkeypatch, capsys, "check", BINDING, *bus, "--duration", "2")
        assert status in (0, 3), err  # a loaded machine may be late
        assert "engine_speed" in out
        assert "frames in" in out
        monkeypatch.setattr("typer.confirm", lambda *_, **__: True)
        status, out, err = run(monkeypatch, capsys, "check", BINDING, *bus, "--silence")
        assert status == 2
        assert "engine runs" in err
