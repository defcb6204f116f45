"""Restbus simulation: nodes left to real devices are not sent, and what these send is followed."""

from dataclasses import replace
from pathlib import Path

import pytest

from slipbench import dbc
from slipbench.bench.vehicle.nodes import ALL_NODES, MESSAGES_OF, NODE_OF, simulated_nodes
from slipbench.protocol.codec.codec import MESSAGES, Codec, Sender
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    EcuStatus,
    RiderControls,
    ThrottleStatus,
)
from slipbench.protocol.codec.placement import OWN
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from tests.bench.lockstep import LockStep
from tests.bench.trials.test_whole_trial import prepared

DATABASE = load_database(dbc.MOTORBIKE)
SENDERS = {
    "ecu": "ECU",
    "throttle": "Throttle",
    "rear_encoder": "RearEncoder",
    "front_encoder": "FrontEncoder",
    "optical": "Optical",
    "rider": "RiderControls",
}


class Restbus(LockStep):
    """The motorcycle without some nodes, and a test that sends for them."""

    def __init__(self, without: str = "") -> None:
        nodes = simulated_nodes(without=without)
        super().__init__(replace(prepared().scenario, nodes=nodes))
        self.sender = Sender(self.codec)
        self.now = 0.0

    def say(self, message, times: int = 1, pause: int = 0) -> None:
        """Send the message in every millisecond, or with a pause in ms; its time stamp advances."""
        for _ in range(times):
            self.now += 1e-3
            if hasattr(message, "time"):
                message = replace(message, time=self.now)
            self.send(*self.sender.encode(message))
            self.wait(1 + pause)

    def repeat(self, identifier: int, data: bytes, milliseconds: int) -> None:
        for _ in range(milliseconds):
            self.send(identifier, data)
            self.live()

    def wait(self, milliseconds: int) -> None:
        for _ in range(milliseconds):
            self.live()

    def said(self, kind: type) -> list:
        return [message for _, message in self.heard() if isinstance(message, kind)]

    @property
    def outputs(self):
        return self.motorcycle._simulation, self.motorcycle._state

    @property
    def plate(self) -> float:
        simulation, state = self.outputs
        return simulation.value(state, "throttle")


def position(value: float) -> ThrottleStatus:
    return ThrottleStatus(Authority.NONE, value, 1.0, False, 0.0)


@pytest.mark.parametrize("message", DATABASE.messages, ids=lambda message: message.name)
def test_the_messages_of_a_node_are_those_of_its_sender_in_the_database(message) -> None:
    [sender] = message.senders
    node = NODE_OF.get(message.name)
    assert sender == (SENDERS[node] if node else "Gateway")
    assert message.name in MESSAGES


def test_nodes_are_chosen_by_name_and_by_group() -> None:
    assert simulated_nodes() == ALL_NODES
    assert simulated_nodes(without="ecu,throttle") == ALL_NODES - {"ecu", "throttle"}
    assert simulated_nodes(only="encoders, optical") == {"rear_encoder", "front_encoder", "optical"}
    assert simulated_nodes(without="encoders") == ALL_NODES - {"rear_encoder", "front_encoder"}


@pytest.mark.parametrize(
    ("only", "without", "words"),
    [
        ("throtle", "", ["--only", "'throtle'", "did you mean throttle?"]),
        ("", "gps", ["--without", "'gps'", "ecu, throttle"]),
        ("", "ecu,,rider", ["--without", "''"]),
        ("ecu", "rider", ["--only and --without"]),
        ("", ",".join(MESSAGES_OF), ["no node is left"]),
    ],
)
def test_an_impossible_choice_is_refused_with_its_remedy(only, without, words) -> None:
    with pytest.raises(InputError) as refusal:
        simulated_nodes(only, without)
    for word in words:
        assert word in str(refusal.value)


@pytest.mark.parametrize("node", MESSAGES_OF)
def test_a_node_that_is_left_out_sends_nothing_and_the_others_send_the_same(node: str) -> None:
    with Restbus() as whole, Restbus(node) as without:
        for _ in range(600):
            whole.live()
            without.live()
        names = {
            whole.codec.identifier(name) for name in MESSAGES_OF[node] if whole.codec.has(name)
        }
        frames = [frame for frame in _frames(whole) if frame[0] not in names]
        assert _frames(without) == frames
        assert len(frames) > 1000


def _frames(restbus: Restbus) -> list[tuple[int, bytes]]:
    frames = []
    while (frame := restbus._ours.recv(0)) is not None:
        frames.append((frame.arbitration_id, bytes(frame.data)))
    return sorted(frames)


def test_the_plate_follows_the_position_that_the_real_throttle_body_measures() -> None:
    with Restbus("throttle") as bus:
        before = bus.plate
        for _ in range(5):
            bus.live()  # nothing from the real device yet: the model holds the operating point
        assert bus.plate == pytest.approx(before, abs=1e-3)
        for opening in (0.10, 0.25, 0.05):
            bus.say(position(opening), 3)
            assert bus.plate == pytest.approx(opening, abs=1e-12)  # whatever the ECU commands


def test_an_engine_with_a_real_throttle_body_that_opens_accelerates() -> None:
    with Restbus("throttle") as bus:
        start = bus.plate
        bus.say(position(start), 50)
        simulation, state = bus.outputs
        speed = simulation.value(state, "engine_speed")
        bus.say(position(min(start + 0.2, 1.0)), 300)
        simulation, state = bus.outputs
        assert simulation.value(state, "engine_speed") > 1.02 * speed


def test_the_servo_follows_the_real_ecu_and_its_spark_acts_on_the_engine() -> None:
    with Restbus("ecu") as bus:
        bus.say(EcuStatus(Authority.BOTH, 0.31, 0.2, 0.0), 300)
        assert bus.plate == pytest.approx(0.31, abs=2e-3)
        assert bus.motorcycle._inputs.spark[0] == pytest.approx(0.2, abs=1e-3)
        assert bus.said(ThrottleStatus)[-1].authority == Authority.BOTH


def test_after_20_ms_without_the_real_ecu_the_grip_counts_and_nothing_is_granted() -> None:
    with Restbus("ecu") as bus:
        grip = bus.motorcycle._rider.grip
        bus.say(EcuStatus(Authority.BOTH, 0.31, 0.2, 0.0), 30)
        bus.wait(24)
        assert bus.motorcycle._inputs.throttle_command[0] == grip
        assert bus.motorcycle._inputs.spark[0] == 0.0
        assert bus.said(ThrottleStatus)[-1].authority == Authority.NONE


def test_the_commands_of_the_bench_do_not_reach_the_engine_past_a_real_ecu() -> None:
    with Restbus("ecu") as bus:
        grip = bus.motorcycle._rider.grip
        bus.say(ActuatorCommand(Authority.BOTH, 0.5, 0.1, 0.0), 10)
        assert bus.motorcycle._inputs.throttle_command[0] == grip
        assert bus.motorcycle._inputs.spark[0] == 0.0


def test_the_real_riders_grip_and_clutch_count() -> None:
    with Restbus("rider") as bus:
        bus.say(RiderControls(False, 0.4, 0.0, 0.0, 0.25), 5)
        assert bus.motorcycle._inputs.throttle_command[0] == pytest.approx(0.4, abs=1e-3)
        assert bus.motorcycle._inputs.clutch[0] == pytest.approx(0.75, abs=1e-2)
        assert bus.said(EcuStatus)[-1].throttle_command == pytest.approx(0.4, abs=1e-3)


def test_it_says_which_nodes_have_not_sent_yet() -> None:
    with Restbus("throttle,rider") as bus:
        bus.live()
        assert bus.motorcycle.waited_for == ("throttle", "rider")
        bus.say(position(0.1), 2)
        assert bus.motorcycle.waited_for == ("rider",)


@pytest.mark.parametrize("node", ["throttle", "rider"])
def test_a_device_that_has_never_sent_is_waited_for(node: str) -> None:
    with Restbus(node) as bus:
        bus.wait(700)
        assert bus.motorcycle.waited_for == (node,)


def test_a_real_device_that_falls_silent_ends_the_simulation() -> None:
    with Restbus("throttle") as bus:
        bus.say(position(0.1), 20)
        bus.wait(90)
        with pytest.raises(InputError, match="silent") as fault:
            bus.wait(30)
        for word in ("throttle", "ThrottleStatus every 1 ms", "no valid frame for 101 ms"):
            assert word in str(fault.value)


@pytest.mark.parametrize("kind", ["counter stands still", "CRC is wrong"])
def test_frames_that_are_not_valid_are_silence_and_are_named(kind: str) -> None:
    with Restbus("throttle") as bus:
        bus.say(position(0.1), 20)
        identifier, data = bus.sender.encode(position(0.3))
        if kind == "CRC is wrong":
            data = bytes([data[0] ^ 1, *data[1:]])
        with pytest.raises(InputError, match="silent") as fault:
            bus.repeat(identifier, data, 300)
        assert ("repeated" if kind == "counter stands still" else "wrong CRC") in str(fault.value)


def test_a_real_device_that_sends_too_rarely_ends_the_simulation() -> None:
    with Restbus("throttle") as bus, pytest.raises(InputError, match="rarely") as fault:
        bus.say(position(0.1), 200, pause=4)
    assert "every 5" in str(fault.value)
    assert "ThrottleStatus every 1 ms" in str(fault.value)


def test_a_simulation_that_was_stopped_does_not_take_its_own_pause_for_silence() -> None:
    """Frames of the pause wait in the socket; the simulation catches up in one tick."""
    with Restbus("throttle") as bus:
        bus.say(position(0.1), 20)
        for _ in range(150):
            bus.send(*bus.sender.encode(position(0.1)))
            bus._wire.advance_to(bus._wire.now_ns + 1_000_000)
        bus._number += 150
        bus.live()
        bus.say(position(0.1), 5)


@pytest.mark.parametrize("name", sorted(NODE_OF.keys() & OWN.keys()))
def test_another_sender_for_a_simulated_node_ends_the_simulation(name: str) -> None:
    with Restbus() as bus, Restbus() as second:
        for _ in range(600):
            second.live()
        identifier = second.codec.identifier(name)
        data = next(data for number, data in _frames(second) if number == identifier)
        bus.live()
        bus.send(identifier, data)
        with pytest.raises(InputError, match="another device") as fault:
            bus.live()
        for word in (NODE_OF[name], name, "--without"):
            assert word in str(fault.value)


def test_a_conflict_that_is_there_at_the_start_is_found_before_the_first_frame() -> None:
    with Restbus() as bus:
        bus.send(*bus.sender.encode(position(0.1)))
        bus._wire.advance_to(bus._wire.now_ns + 1_000_000)
        with pytest.raises(InputError, match="another device"):
            bus.motorcycle.listen()
        assert _frames(bus) == []


def test_the_codec_of_another_bench_is_no_second_sender() -> None:
    """The gateway's own messages belong to no node."""
    codec = Codec(DATABASE)
    assert {name for name in MESSAGES if name not in NODE_OF} == {"ActuatorCommand", "TrialStatus"}
    assert codec.name(codec.identifier("TrialStatus")) == "TrialStatus"
    assert Path(dbc.MOTORBIKE).exists()
