"""An exception inside the loop never ends a trial without release, outcome and whole record."""

import re
import tomllib
from contextlib import ExitStack
from dataclasses import replace
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from slipbench import dbc
from slipbench.bench.bus.simulated_bus import SimulatedNode
from slipbench.bench.gateway import gateway as module
from slipbench.bench.gateway.controller_state import ControllerState
from slipbench.bench.gateway.fail_safe import RELEASED, FailSafe, described
from slipbench.bench.gateway.gateway import Gateway
from slipbench.bench.gateway.gateway_bus import GatewayBus
from slipbench.bench.gateway.receiver import Receiver
from slipbench.bench.gateway.sender_monitor import SenderMonitor
from slipbench.bench.gateway.stamps import as_stamped
from slipbench.bench.gateway.tx_echo import TxEcho
from slipbench.bench.loop.ring import Ring
from slipbench.bench.safety.vehicle_monitor import VehicleMonitor
from slipbench.bench.trials.run import run_trial
from slipbench.bench.vehicle.virtual_motorcycle import VirtualMotorcycle
from slipbench.protocol.codec.assembly import Assembly
from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    Phase,
    TrialStatus,
    TripReason,
)
from slipbench.protocol.codec.placement import OWN
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Checksum, Protection
from slipbench.protocol.logs import read_log
from tests.bench.trials.test_whole_trial import prepared

DATABASE = load_database(dbc.MOTORBIKE)
CODEC = Codec(DATABASE)
SHORT = prepared(
    excitation__duration="200 ms",
    excitation__start="2 Hz",
    operating_point__steady_for="100 ms",
    settling="100 ms",
    hand_back="100 ms",
)
BUTTON = 203  # tick at which the rider presses the button, at the earliest
LAST = 600

# Everything that a tick calls outside itself.
SITES = [
    (Gateway, "_tick"),
    (Gateway, "_listen"),
    (Gateway, "_observe"),
    (Gateway, "_decide"),
    (Gateway, "_move_to"),
    (Gateway, "_send"),
    (Gateway, "_report"),
    (Gateway, "_put"),
    (VehicleMonitor, "state"),
    (VehicleMonitor, "observe"),
    (SenderMonitor, "heard"),
    (ControllerState, "off"),
    (TxEcho, "heard"),
    (TxEcho, "sent"),
    (Codec, "plan"),
    (Receiver, "receive"),
    (Assembly, "take"),
    (Sender, "frames"),
    (SimulatedNode, "send"),
    (SimulatedNode, "recv"),
    (Ring, "append"),
    (module, "advance"),
    (module, "requested_command"),
    (module, "permit"),
    (module, "waveform_value"),
]


class Bomb:
    """Stands before a call of the gateway; raises at and after a tick, so many times."""

    def __init__(self, tick: int, times: int) -> None:
        self.tick, self.left, self.now, self.inside = tick, times, -1, False
        self.exploded = 0

    def around(self, real, mine):
        def call(*arguments, **named):
            if mine(arguments) and self.inside and self.now >= self.tick and self.left:
                self.left -= 1
                self.exploded += 1
                raise ZeroDivisionError("made by the test")
            return real(*arguments, **named)

        return call

    def clock(self, real):
        def tick(gateway, number, due):
            self.now, self.inside = number, True
            try:
                return real(gateway, number, due)
            finally:
                self.inside = False

        return tick


def ride(tmp_path, site, tick, times):
    """A short trial with a bomb at a call; its folder, its outcome, all frames that were sent."""
    owner, name = site
    bomb, wire = Bomb(tick, times), []
    send = SimulatedNode.send

    def sent(node, message, timeout=None):
        send(node, message, timeout)
        wire.append((bomb.inside, message.arbitration_id, bytes(message.data)))

    with ExitStack() as patches:
        patches.enter_context(patch.object(SimulatedNode, "send", sent))
        real = getattr(owner, name)
        bombed = bomb.around(real, lambda _: True)
        patches.enter_context(patch.object(owner, name, bombed))
        patches.enter_context(patch.object(Gateway, "tick", bomb.clock(Gateway.tick)))
        outcome = run_trial(SHORT, tmp_path, None)
    return outcome, bomb, wire


@pytest.mark.parametrize("site", SITES, ids=lambda site: f"{site[0].__name__}.{site[1]}")
@settings(
    max_examples=2, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(tick=st.integers(0, LAST), times=st.sampled_from([1, 3, 10**9]))
def test_an_exception_at_any_call_of_any_tick_releases_and_leaves_outcome_and_record(
    tmp_path_factory, site, tick, times
):
    print(f"site {site[1]}, tick {tick}, {times} times")
    folder = tmp_path_factory.mktemp("bomb") / "run"
    outcome, bomb, wire = ride(folder, site, tick, times)
    described = tomllib.loads((folder / "run.toml").read_text(encoding="utf-8"))["outcome"]
    assert described["phase"] == outcome.state.phase.name.lower()
    assert outcome.state.phase in (Phase.DONE, Phase.TRIPPED)
    if bomb.exploded and outcome.state.phase == Phase.TRIPPED:
        assert outcome.state.trip.reason == TripReason.INTERNAL_ERROR
        assert "ZeroDivisionError: made by the test" in described["detail"]
    if bomb.exploded:
        assert any("ZeroDivisionError" in note for note in described["notes"])
    released(wire, dead=site[1] == "send" and times > 3)
    if not (site[1] in ("append", "recv") and times > 3):  # else no record is possible
        recorded(folder, wire)


def released(wire, dead) -> None:
    """The last command on the wire is a release; a dead bus carries none (devices take over)."""
    commands = [
        CODEC.decode(number, data)
        for _, number, data in wire
        if number == CODEC.identifier("ActuatorCommand")
    ]
    assert all(isinstance(command, ActuatorCommand) for command in commands)
    if commands and not dead:
        assert commands[-1].authority == Authority.NONE


def recorded(folder, wire) -> None:
    """Every frame on the wire is in frames.log, but those of the last millisecond."""
    log = read_log(folder / "frames.log")
    assert not log.warnings
    assert log.frames.identifier.size >= len(wire) - 20


def test_the_tick_that_fails_releases_at_once(tmp_path):
    """Authority is up; the exception comes in the next decision: that very tick sends a release."""
    outcome, bomb, wire = ride(tmp_path / "run", (module, "permit"), BUTTON + 50, 1)
    assert bomb.exploded == 1
    assert outcome.state.trip.reason == TripReason.INTERNAL_ERROR
    commands = [CODEC.decode(n, d) for _, n, d in wire if n == CODEC.identifier("ActuatorCommand")]
    held = [k for k, command in enumerate(commands) if command.authority != Authority.NONE]
    assert held, "the bench never had authority"
    gap = commands[held[-1] + 1].time - commands[held[-1]].time
    assert gap == pytest.approx(0.001, abs=1e-5)
    assert len(commands) - held[-1] > 150  # and goes on for 0.2 s


def test_a_virtual_motorcycle_that_fails_is_silent_and_the_trial_trips(tmp_path):
    real = VirtualMotorcycle.tick

    def tick(motorcycle, number, due):
        if number == 300:
            raise ValueError("made by the test")
        return real(motorcycle, number, due)

    with patch.object(VirtualMotorcycle, "tick", tick):
        outcome = run_trial(SHORT, tmp_path / "run", None)
    assert outcome.state.trip.reason == TripReason.STALE
    assert any("virtual motorcycle failed: ValueError" in note for note in outcome.notes)


class Mute(Codec):
    """A codec that encodes until it is broken."""

    broken = False

    def finish(self, *arguments):
        if self.broken:
            raise ZeroDivisionError("made by the test")
        return super().finish(*arguments)


@pytest.mark.parametrize("breaks", range(18))
def test_releases_follow_each_other_whether_or_not_they_can_still_be_encoded(breaks):
    """Counters go on without a gap; what can be encoded bears its time."""
    codec = Mute(DATABASE)
    fail_safe, sender = FailSafe(codec), Sender(codec)
    for number in range(36):
        codec.broken = number >= breaks
        ((identifier, data, *_),) = fail_safe.release(sender, 0.25 + number)
        time = 0.0 if codec.broken else 0.25 + number
        assert CODEC.encode(replace(RELEASED, time=time), counter=number % 15) == (identifier, data)


@pytest.mark.parametrize(
    "protection",
    [None, Protection(0, checksum=Checksum("crc", "sum")), Protection(0, counter="counter")],
)
def test_a_ready_release_is_the_encoded_one_whatever_protects_it(protection):
    """The bits of a throttle of 0 are not 0 here; counters go on as if it had been encoded."""
    message = DATABASE.message("ActuatorCommand")
    signals = tuple(
        replace(each, offset=-50.0, minimum=-50.0, wraps=False) if each.name == "throttle" else each
        for each in message.signals
    )
    new = replace(message, signals=signals, protection=protection)
    messages = tuple(new if each is message else each for each in DATABASE.messages)
    requests = {"ActuatorCommand": OWN["ActuatorCommand"]}
    codec = Mute(replace(DATABASE, messages=messages), requests)
    fail_safe, sender, usual = FailSafe(codec), Sender(codec), Sender(codec)
    expected = [usual.frames(RELEASED) for _ in range(20)]
    codec.broken = True
    assert [fail_safe.release(sender, 0.0) for _ in range(20)] == expected
    assert sender.counters == usual.counters
    assert int.from_bytes(expected[0][0].data[2:], "little")


def test_where_silence_releases_or_nothing_is_requested_no_release_is_sent():
    assert FailSafe(CODEC, silent=True).release(Sender(CODEC), 0.0) == []
    listening = Codec(DATABASE, {name: at for name, at in OWN.items() if name != "ActuatorCommand"})
    assert FailSafe(listening).release(Sender(listening), 0.0) == []


def test_a_status_that_cannot_be_encoded_is_none():
    codec = Mute(DATABASE)
    fail_safe, sender = FailSafe(codec), Sender(codec)
    status = TrialStatus(Phase.TRIPPED, Authority.NONE, TripReason.INTERNAL_ERROR, 7)
    ((identifier, data, *_),) = fail_safe.status(sender, status)
    assert (identifier, data) == CODEC.encode(status, counter=0)
    codec.broken = True
    assert fail_safe.status(sender, status) == []


def test_nothing_has_failed_in_a_new_gateway_and_its_interface_echoes():
    bus = GatewayBus(0, None, frozenset(), as_stamped)
    assert (FailSafe(CODEC).active, bus.records_sent) == (False, False)


def test_an_exception_is_described_with_the_innermost_places_first():
    def innermost():
        raise ZeroDivisionError("made by the test")

    def inner():
        innermost()

    def outer():
        inner()

    try:
        outer()
    except ZeroDivisionError as fault:
        told = described(fault)
    assert re.fullmatch(
        r"ZeroDivisionError: made by the test \(innermost:\d+ < inner:\d+ < outer:\d+\)", told
    )
    first = innermost.__code__.co_firstlineno
    assert f"innermost:{first + 1} " in told


def test_clocks_and_counts_wrap_also_where_no_attribute_says_so(tmp_path):
    """A database of another editor has no SignalWraps: clocks wrap by what they are."""
    text = dbc.MOTORBIKE.read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if "SignalWraps" not in line]
    (tmp_path / "other.dbc").write_text("\n".join(lines) + "\n", encoding="utf-8")
    other = Codec(load_database(tmp_path / "other.dbc"))
    late = ActuatorCommand(Authority.NONE, 0.0, 0.0, 1e5)
    assert other.encode(late) == CODEC.encode(late)
    assert replace(other.decode(*other.encode(late)), time=0.0) == replace(late, time=0.0)
