"""`slipbench vehicle` with real devices, on the project's own bus in real time."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import can
import pytest

from slipbench import dbc
from slipbench.bench.bus.faults import FaultPlan, Lost, Where
from slipbench.bench.bus.plan_text import plan_text
from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.messages import Authority, ThrottleStatus
from slipbench.protocol.database.database import load_database
from tests.bench.test_commands import run

PATIENCE = 60.0  # s
CODEC = Codec(load_database(dbc.MOTORBIKE))


@pytest.fixture
def channel(request) -> str:
    return f"restbus-{os.getpid()}-{abs(hash(request.node.name)) % 1000}"


@contextmanager
def vehicle(channel: str, *options: str) -> Iterator["subprocess.Popen[str]"]:
    """A vehicle in a process of its own, which has said that it simulates."""
    bus = ("--interface", "slipbench", "--channel", channel)
    process = subprocess.Popen(
        [sys.executable, "-u", "-m", "slipbench", "vehicle", "throttle_sweep", *options, *bus],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    with process:
        try:
            assert process.stdout
            assert process.stdout.readline().startswith("simulating ")
            yield process
        finally:
            process.send_signal(signal.SIGINT)


@contextmanager
def throttle_body(channel: str) -> Iterator[threading.Event]:
    """A device that sends ThrottleStatus every millisecond until the event is set."""
    over = threading.Event()

    def send() -> None:
        sender, time = Sender(CODEC), 0.0
        with can.Bus(interface="slipbench", channel=channel) as bus:
            while not over.wait(0.001):
                time += 0.001
                status = ThrottleStatus(Authority.NONE, 0.1, 1.0, False, time)
                identifier, data = sender.encode(status)
                bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield over
    finally:
        over.set()
        thread.join()


def test_it_waits_for_a_real_device_and_ends_when_that_falls_silent(channel) -> None:
    with vehicle(channel, "--without", "throttle") as process:
        assert process.stdout
        assert process.stdout.readline() == "waiting for the real throttle\n"
        with throttle_body(channel) as over:
            assert process.stdout.readline() == "all real devices send\n"
            over.set()
            said = process.stdout.read()
            assert process.wait(PATIENCE) == 2
    # silent, or sending too rarely before: the test's device shares a loaded machine
    for word in ("throttle: the real device", "expected:", "found:", "remedy:"):
        assert word in said
    assert "Traceback" not in said


def test_a_fault_plan_acts_on_the_simulated_nodes(channel, tmp_path) -> None:
    plan = FaultPlan((Lost(1.0, Where(senders=frozenset({"optical"}))),))
    path = tmp_path / "plan.json"
    path.write_text(plan_text(plan), encoding="utf-8")
    with (
        can.Bus(interface="slipbench", channel=channel) as listener,
        vehicle(channel, "--faults", str(path)),
    ):
        heard = [listener.recv(PATIENCE) for _ in range(1000)]
    names = {CODEC.name(frame.arbitration_id) for frame in heard if frame is not None}
    assert {"EcuStatus", "RearTeeth", "RiderControls"} <= names
    assert "OpticalSpeed" not in names


def test_two_simulations_on_one_bus_are_refused_before_the_second_sends(
    channel, monkeypatch, capsys
) -> None:
    with vehicle(channel, "--only", "optical") as first:
        options = ("--interface", "slipbench", "--channel", channel, "--duration", "5")
        status, out, err = run(monkeypatch, capsys, "vehicle", "throttle_sweep", *options)
        assert (status, out) == (2, "")
        assert "optical: another device on the bus sends" in err
        assert first.poll() is None  # it ends at the first frame of a second sender


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--without", "trottle"), "did you mean throttle?"),
        (("--without", "ecu", "--only", "rider"), "--only and --without"),
        (("--faults", "nowhere.json"), "nowhere.json"),
    ],
)
def test_a_wrong_option_is_refused_before_the_bus_is_opened(
    monkeypatch, capsys, options, word
) -> None:
    status, out, err = run(
        monkeypatch, capsys, "vehicle", "throttle_sweep", "--interface", "none", *options
    )
    assert (status, out) == (2, "")
    assert word in err
    assert "Traceback" not in err
