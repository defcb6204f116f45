"""The bus in real time, between processes: functional laws only, and times as the wire tells them.

Nothing here depends on how fast the machine is: the time stamps are the wire's own.
"""

import os
import select
import signal
import socket
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import can
import pytest

from slipbench.bench.bus.broker import address
from slipbench.bench.bus.faults import Disturbed, FaultPlan, Lost, Where
from slipbench.bench.bus.frame import BitRates, Frame
from slipbench.bench.bus.opening import QUEUE_LENGTH, BusAddress, open_bus
from slipbench.bench.bus.python_can import SlipbenchBus
from slipbench.bench.bus.records import HEAD, LARGEST, Hello, Kind, packed, unpacked
from tests.bench.bus.wires import PATIENCE, receive

BITRATE = 500_000
ECHO = """
import can, sys
with can.Bus(interface="slipbench", channel=sys.argv[1], bitrate=500_000) as bus:
    print("ready", flush=True)
    while (message := bus.recv(20)) is not None and message.arbitration_id:
        message.arbitration_id += 1
        bus.send(message)
"""


@pytest.fixture
def channel() -> str:
    return f"test {uuid.uuid4()}"


def joined(channel: str, **options: object) -> SlipbenchBus:
    return SlipbenchBus(channel, **{"bitrate": BITRATE, **options})  # type: ignore[arg-type]


@pytest.fixture
def two(channel: str) -> Iterator[tuple[SlipbenchBus, SlipbenchBus]]:
    with joined(channel, name="one") as one, joined(channel, name="two") as two:
        yield one, two


Two = tuple[SlipbenchBus, SlipbenchBus]


def frame(identifier: int = 0x100, data: bytes = b"", **kind: bool) -> can.Message:
    return can.Message(
        arbitration_id=identifier,
        data=data,
        is_extended_id=False,
        is_fd=kind.get("is_fd", False),
        is_error_frame=kind.get("is_error_frame", False),
    )


def until(bus: SlipbenchBus, state: can.BusState) -> list[can.Message]:
    """Messages that the bus received until it is in `state`."""
    deadline = time.monotonic() + PATIENCE
    while bus.state is not state:
        assert time.monotonic() < deadline, f"{bus.state}, not {state}"
        time.sleep(0.01)
    heard = []
    while (message := bus.recv(0)) is not None:
        heard.append(message)
    return heard


def test_the_interface_is_known_to_python_can_by_its_name(channel: str) -> None:
    with can.Bus(interface="slipbench", channel=channel) as bus:
        assert isinstance(bus, SlipbenchBus)


def test_another_process_receives_and_replies(channel: str) -> None:
    with joined(channel) as bus:
        echo = subprocess.Popen(
            [sys.executable, "-c", ECHO, channel],
            stdout=subprocess.PIPE,
            text=True,
            cwd=Path(__file__).parents[3],
        )
        assert echo.stdout is not None
        assert echo.stdout.readline() == "ready\n"
        for number in range(20):
            bus.send(frame(0x10, bytes([number])))
            [answer] = receive(bus, 1)
            assert (answer.arbitration_id, answer.data[0]) == (0x11, number)
        bus.send(frame(0))
        assert echo.wait(PATIENCE) == 0


def test_frames_follow_each_other_by_their_bits_over_the_bit_rate_and_never_closer(
    two: Two,
) -> None:
    one, other = two
    payloads = [bytes([number] * 8) for number in range(200)]
    for payload in payloads:
        one.send(frame(0x100, payload))
    heard = receive(other, 200)
    assert [bytes(message.data) for message in heard] == payloads
    waits = [
        (after.timestamp - before.timestamp)
        - BitRates(BITRATE).duration(Frame(0x100, bytes(after.data))) * 1e-9
        for before, after in pairwise(heard)
    ]
    rounding = 1e-6  # of a time stamp since the epoch as a float
    assert min(waits) > -rounding
    assert sorted(waits)[len(waits) // 2] < rounding  # more only where the sender was held up
    assert 0 < other.load() <= 1


def test_urgent_frames_are_sent_first_however_long_others_have_waited(channel: str) -> None:
    with (
        joined(channel) as listener,
        joined(channel) as patient,
        joined(channel, urgent_first=True) as urgent,
    ):
        for _ in range(10):  # until this process was not held up while the patient's queue emptied
            order = contended(listener, patient, urgent)
            if order[-1] == 0x700:
                break
    assert order.count(0x700) == 900
    assert order[-1] == 0x700
    assert order.index(0x120) < order.index(0x700) + 899


def contended(listener: SlipbenchBus, patient: SlipbenchBus, urgent: SlipbenchBus) -> list[int]:
    """Received identifiers when three urgent frames are sent after many that already wait."""
    for _ in range(900):
        patient.send(frame(0x700, bytes(8)))
    for number in (0x120, 0x110, 0x100):
        urgent.send(frame(number))
    return [message.arbitration_id for message in receive(listener, 903)]


def test_the_nodes_of_the_bench_queue_few_old_frames(channel: str) -> None:
    """Old frames of a single vehicle must not look like a second vehicle to a node that joins later."""
    with open_bus(BusAddress("slipbench", channel), receive_own_messages=False) as alone:
        assert isinstance(alone, SlipbenchBus)
        with pytest.raises(can.CanOperationError, match="Transmit buffer full"):
            overfill(alone)
        with open_bus(BusAddress("slipbench", channel), receive_own_messages=False) as late:
            assert len(receive(late, QUEUE_LENGTH)) == QUEUE_LENGTH
            assert late.recv(0.1) is None


def test_nodes_must_agree_on_the_bit_rate(two: Two) -> None:
    with pytest.raises(can.CanInitializationError, match="the bus runs at 500000"):
        joined(two[0]._channel, bitrate=250_000)


def overfill(bus: SlipbenchBus) -> None:
    for _ in range(1000):
        bus.send(frame(0x100, bytes(8)))


def test_a_full_queue_rejects_and_a_sender_with_a_timeout_succeeds(channel: str) -> None:
    with joined(channel, queue_length=5) as one, joined(channel) as other:
        with pytest.raises(can.CanOperationError, match="Transmit buffer full"):
            overfill(one)
        one.send(frame(0x101), timeout=PATIENCE)
        while (message := other.recv(PATIENCE)) is not None and message.arbitration_id != 0x101:
            pass
        assert message is not None


def test_what_no_controller_can_send_is_refused(two: Two) -> None:
    for wrong, words in (
        (frame(is_fd=True), "fd=True"),
        (frame(is_error_frame=True), "only a controller itself sends error frames"),
    ):
        with pytest.raises(can.CanOperationError, match=words):
            two[0].send(wrong)


def test_a_fault_plan_acts_on_the_running_bus(two: Two) -> None:
    one, other = two
    other.inject(FaultPlan((Lost(1.0, Where(receivers={"two"}, identifiers={0x100})),)))
    time.sleep(0.05)  # it travels to the broker on its own way
    one.send(frame(0x100))
    one.send(frame(0x101))
    assert [message.arbitration_id for message in receive(other, 1)] == [0x101]


def test_a_node_goes_bus_off_is_notified_and_recovers(two: Two) -> None:
    one, other = two
    other.inject(FaultPlan((Disturbed(1.0, Where(senders={"one"})),)))
    time.sleep(0.05)
    one.send(frame())
    told = until(one, can.BusState.ERROR)
    assert all(message.is_error_frame for message in told)
    assert [message.data[6] for message in told][:31] == [8 * n for n in range(1, 32)]
    assert told[-1].arbitration_id & 0x40  # CAN_ERR_BUSOFF
    with pytest.raises(can.CanOperationError, match="bus off"):
        one.send(frame())
    other.inject(FaultPlan())
    one.restart()
    [back] = until(one, can.BusState.ACTIVE)
    assert back.arbitration_id & 0x100  # CAN_ERR_RESTARTED
    one.send(frame(0x123))
    heard = receive(other, 33)
    assert [message.arbitration_id for message in heard if not message.is_error_frame] == [0x123]


def test_a_single_node_becomes_passive_and_not_bus_off(channel: str) -> None:
    with joined(channel) as one:
        one.send(frame())
        until(one, can.BusState.PASSIVE)
        assert one.recv(0.1) is None


def test_what_was_sent_before_leaving_still_arrives(two: Two) -> None:
    one, other = two
    for number in range(100):
        one.send(frame(0x100, bytes([number])))
    one.shutdown()
    assert [message.data[0] for message in receive(other, 100)] == list(range(100))


def test_frames_of_a_node_that_leaves_with_unread_records_are_all_sent(two: Two) -> None:
    """A release is the last frame of a gateway, which does not read the confirmation."""
    one, other = two
    one.send(frame(0x100, bytes([0])))
    receive(other, 1)
    assert select.select([one], [], [], PATIENCE)[0]  # its own frame's confirmation stays unread
    broker = _broker_of(one._channel)
    os.kill(broker, signal.SIGSTOP)
    try:
        for number in range(100):
            one.send(frame(0x100, bytes([number])))
        one.shutdown()
    finally:
        os.kill(broker, signal.SIGCONT)
    assert [message.data[0] for message in receive(other, 100)] == list(range(100))


def test_a_killed_broker_is_reported_at_once_and_the_channel_can_be_used_again(
    channel: str,
) -> None:
    with joined(channel) as one:
        broker = _broker_of(channel)
        subprocess.run(["kill", "-9", str(broker)], check=True)
        with pytest.raises(
            can.CanOperationError, match=r"the broker of the bus has ended|the bus is closed"
        ):
            one.recv(PATIENCE)
    with joined(channel) as one, joined(channel) as other:
        one.send(frame())
        assert len(receive(other, 1)) == 1


def test_a_broker_that_comes_late_has_lost_nothing(channel: str) -> None:
    """A loaded machine may stop the broker for long; a whole queue must fit into the socket."""
    with joined(channel, queue_length=600) as sender, joined(channel) as listener:
        broker = _broker_of(channel)
        os.kill(broker, signal.SIGSTOP)
        try:
            for number in range(600):
                sender.send(frame(number))
            with pytest.raises(can.CanOperationError, match="full"):
                sender.send(frame())
        finally:
            os.kill(broker, signal.SIGCONT)
        heard = receive(listener, 600)
    assert [message.arbitration_id for message in heard] == list(range(600))


@pytest.mark.parametrize(
    "nonsense",
    [
        b"",
        b"x",
        bytes(24),
        b"\x01" + bytes(23),
        b"\x01" + bytes(23) + b"{}",
        b"\x02" + bytes(40),
        b"\x01" + bytes(23) + b"[" * 5000,
        b"\xff" * 24,
        packed(Kind.HELLO, Hello("zero", 0, 0, True, None, 5, False).text()),
        packed(Kind.HELLO, Hello("never", 500_000, 2_000_000, True, float("nan"), 5, False).text()),
        packed(Kind.HELLO, Hello(5, 500_000, 2_000_000, True, None, 5, False).text()),  # type: ignore[arg-type]
    ],
    ids=len,
)
def test_a_connection_with_invalid_records_is_rejected_and_disturbs_no_node(
    two: Two, nonsense: bytes
) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as stranger:
        stranger.settimeout(PATIENCE)
        stranger.connect(address(two[0]._channel))
        stranger.send(nonsense)
        if nonsense:
            assert unpacked(stranger.recv(LARGEST)).kind is Kind.REFUSED
    two[0].send(frame(0x123))
    assert [message.arbitration_id for message in receive(two[1], 1)] == [0x123]


@pytest.mark.parametrize(
    "record",
    [
        HEAD.pack(Kind.FRAME, 0, 0, 0, 0x800, 0, 0),
        HEAD.pack(Kind.FRAME, 0, 0, 0, 1, 0, 0) + bytes(9),
        HEAD.pack(Kind.FRAME, 4, 0, 0, 1, 0, 0) + bytes(9),
        HEAD.pack(Kind.FAULTS, 0, 0, 0, 0, 0, 0) + b"{}",
        HEAD.pack(Kind.WELCOME, 0, 0, 0, 0, 0, 0)[:-1],
    ],
    ids=["identifier", "too long", "no such length", "no plan", "torn"],
)
def test_a_node_with_invalid_records_is_removed_and_disturbs_no_other(
    two: Two, channel: str, record: bytes
) -> None:
    one, other = two
    with joined(channel) as wrong:
        wrong._send_record(record)
        with pytest.raises(
            can.CanOperationError, match=r"rejected by the bus|the broker of the bus has ended"
        ):
            wrong.recv(PATIENCE)
    one.send(frame(0x123))
    assert [message.arbitration_id for message in receive(other, 1)] == [0x123]


def test_a_channel_s_name_that_is_too_long_is_refused() -> None:
    with pytest.raises(can.CanInitializationError, match="longer than"):
        SlipbenchBus("x" * 200)


def _broker_of(channel: str) -> int:
    """Find the process that serves a channel by its command line."""
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = entry.read_bytes().split(b"\0")
        except OSError:
            continue
        if b"slipbench.bench.bus.broker" in words and channel.encode() in words:
            return int(entry.parent.name)
    raise AssertionError(f"nobody serves {channel}")
