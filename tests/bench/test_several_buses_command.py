"""`slipbench trial`, `vehicle` and `check` on two buses, on the project's own bus in real time."""

import os
from pathlib import Path

import can
import pytest

from slipbench.bench.bus.simulated_bus import SimulatedBus
from slipbench.bench.check.silence import SilenceProof
from slipbench.bench.vehicle.nodes import ALL_NODES
from slipbench.bench.vehicle.virtual_motorcycle import Scenario, VirtualMotorcycle
from slipbench.protocol.binding.binding import read_binding
from slipbench.protocol.codec.codec import Sender
from slipbench.protocol.codec.messages import RiderControls
from slipbench.protocol.logs import read_log
from tests.bench.check.harness import world
from tests.bench.test_commands import run, short
from tests.bench.test_restbus_command import vehicle
from tests.bench.trials.test_several_buses import whole
from tests.bench.trials.test_whole_trial import prepared
from tests.protocol.binding.foreign import foreign, foreign_binding

__all__ = ["short"]  # a fixture
BUSES = ("powertrain", "chassis")
SEED = 4


@pytest.fixture
def binding(tmp_path) -> Path:
    return foreign(SEED, BUSES).write(tmp_path / "bound")


@pytest.fixture
def channels(request) -> list[str]:
    """Of --channel."""
    name = f"two-{os.getpid()}-{abs(hash(request.node.name)) % 1000}"
    return [f"{bus}={name}-{bus}" for bus in BUSES]


def test_check_and_trial_on_two_live_buses(monkeypatch, capsys, binding, channels, short, tmp_path):
    first, second = channels
    options = ("--interface", "slipbench", "--channel", first, "--channel", second)
    trial = short()
    with vehicle(first, "--binding", str(binding), "--channel", second):
        status, out, err = run(monkeypatch, capsys, "check", binding, *options, "--duration", "2")
        assert status in (0, 3), err  # a loaded machine may be late
        assert "never received" not in out
        status, out, err = run(
            monkeypatch,
            capsys,
            "trial",
            trial,
            "--binding",
            binding,
            "--out",
            tmp_path / "run",
            *options,
        )
        assert status in (0, 3), err
    log = read_log(tmp_path / "run" / "frames.log").frames
    assert set(log.buses) == set(BUSES)
    known = foreign_binding(SEED, tmp_path / "again", BUSES).database
    on = {each.identifier: each.bus for each in known.messages}
    rows = zip(log.identifier.tolist(), log.bus.tolist(), strict=True)
    assert {(k, log.buses[bus]) for k, bus in rows} <= set(on.items())
    assert log.sent.any()
    assert 'channel = "two-' in (tmp_path / "run" / "run.toml").read_text()


def test_a_trial_in_real_time_has_a_virtual_bus_for_each_name(
    monkeypatch, capsys, binding, short, tmp_path
):
    status, _, err = run(
        monkeypatch,
        capsys,
        *("trial", short(), "--real-time", "--binding", binding, "--out", tmp_path / "run"),
    )
    assert status in (0, 3), err  # a loaded machine may be late
    assert set(read_log(tmp_path / "run" / "frames.log").frames.buses) == set(BUSES)


@pytest.mark.parametrize("command", ["trial", "vehicle", "check"])
def test_a_bus_without_a_channel_is_refused_before_any_frame(
    monkeypatch, capsys, binding, channels, command, short
):
    first = channels[0].partition("=")[2]
    options = ("--interface", "slipbench", "--channel", channels[0])
    arguments = (binding,) if command == "check" else (short(), "--binding", binding)
    with can.Bus(interface="slipbench", channel=first, bitrate=1_000_000) as listener:
        status, out, err = run(monkeypatch, capsys, command, *arguments, *options)
        assert listener.recv(0.2) is None
    assert (status, out) == (2, "")
    for word in ("no --channel names the bus 'chassis'", "expected:", "found:", "remedy:"):
        assert word in err


def test_a_capture_with_other_names_of_its_buses_is_checked(monkeypatch, capsys, tmp_path):
    ride = whole(*BUSES)
    log = tmp_path / "x.log"
    received = [
        line
        for line in (ride.folder / "frames.log").read_text().splitlines(True)
        if " T" not in line
    ]
    log.write_text("".join(received))
    bound = ride.prepared.binding.path
    status, out, err = run(monkeypatch, capsys, "check", bound, "--log", log)
    assert status == 0, err + out
    text = "".join(received).replace("powertrain", "can0").replace("chassis", "can1")
    log.write_text(text)
    status, out, err = run(monkeypatch, capsys, "check", bound, "--log", log)
    assert status == 2
    assert "the capture has no bus" in err
    assert "--channel chassis=can0" in err
    options = ("--channel", "powertrain=can0", "--channel", "chassis=can1")
    status, out, err = run(monkeypatch, capsys, "check", bound, "--log", log, *options)
    assert status == 0, err + out


def test_silence_is_proven_where_request_and_status_are_on_different_buses(tmp_path):
    """The engine speed of the simulation is taken away: the engine of the test is off."""
    made = foreign(SEED, BUSES)
    del made.binding["roles"]["engine_speed"]
    hidden = foreign_binding(SEED, tmp_path / "all", BUSES)
    with world(hidden) as motorcycle:
        bound = read_binding(made.write(tmp_path / "hidden"))
        result = SilenceProof(bound, motorcycle.all_ours, motorcycle.clock).run()
    assert result.is_proven, str(result)


def test_a_real_device_counts_on_the_bus_of_its_message_only(tmp_path):
    bound = foreign_binding(SEED, tmp_path, BUSES)
    codec = bound.codec()
    buses = [SimulatedBus(1_000_000) for _ in BUSES]
    nodes = [bus.node("motorcycle") for bus in buses]
    scenario = Scenario(prepared().scenario.vehicle, prepared().trial, nodes=ALL_NODES - {"rider"})
    motorcycle = VirtualMotorcycle(scenario, nodes, codec)
    senders = [bus.node("rider") for bus in buses]
    (frame,) = Sender(codec).frames(RiderControls(False, 0.1, 0.0, 0.0, 0.0))
    message = can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=False)
    for number, bus in enumerate((1 - frame.bus, frame.bus)):
        senders[bus].send(message)
        due = 1_000_000 * (number + 1)
        for each in buses:
            each.advance_to(due)
        motorcycle.tick(number, due)
        assert motorcycle.waited_for == (("rider",) if bus != frame.bus else ())
    for each in (*nodes, *senders):
        each.shutdown()
