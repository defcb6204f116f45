"""What real sockets do that no imitation does: they fill up, and then refuse or forget."""

import socket
import struct
import subprocess
from collections.abc import Iterator

import can
import pytest
from can.interfaces.socketcan import SocketcanBus

from slipbench.bench.bus.opening import RECEIVE_BUFFER, BusAddress, open_bus, receive_buffer
from slipbench.bench.gateway.controller_state import ControllerState
from tests.bench.bus.test_load import BURST, numbered, numbers
from tests.bench.bus.wires import PATIENCE, VCAN, receive, send, socketcan
from tests.socketcan.inside.programs import wait_for_listeners


@pytest.fixture
def slow_wire() -> Iterator[None]:
    """Let the interface carry 8 kB/s from a short queue, as a bus that others keep busy does."""
    limit = ["root", "netem", "rate", "64kbit", "limit", "50"]
    subprocess.run(["tc", "qdisc", "replace", "dev", VCAN, *limit], check=True)
    yield
    subprocess.run(["tc", "qdisc", "del", "dev", VCAN, "root"], check=True)


@pytest.mark.usefixtures("slow_wire")
def test_a_full_queue_refuses_and_a_sender_that_tries_again_loses_nothing() -> None:
    with socketcan() as wire:
        sender, listener = wire.node(False), wire.node(False)
        refusals = sum(send(sender, numbered(number)) for number in range(200))
        assert refusals > 0
        assert numbers(receive(listener, 200)) == list(range(200))


def send_without_patience(sender: can.BusABC) -> None:
    for number in range(200):
        sender.send(numbered(number))


@pytest.mark.usefixtures("slow_wire")
def test_the_refusal_names_the_full_buffer() -> None:
    with socketcan() as wire:
        sender = wire.node(False)
        with pytest.raises(can.CanOperationError, match="No buffer space available"):
            send_without_patience(sender)


def kept_without_reading(room: int) -> list[int]:
    """Give what a listener with a receive buffer of `room` bytes has of a burst after its end."""
    with socketcan() as wire:
        sender, listener = wire.node(False), wire.node(False)
        assert isinstance(listener, SocketcanBus)
        listener.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, room)
        for number in range(BURST):
            send(sender, numbered(number))
        heard: list[can.Message] = []
        while (message := listener.recv(0.2)) is not None:
            heard.append(message)
        return numbers(heard)


def test_a_listener_that_does_not_read_loses_the_newest_and_is_not_told() -> None:
    """Why a gateway must empty its socket every tick, and why counters are checked."""
    little, more = kept_without_reading(40_000), kept_without_reading(200_000)
    assert little == list(range(len(little)))
    assert more == list(range(len(more)))
    assert 0 < 2 * len(little) < len(more) < BURST


def test_a_bus_that_the_bench_opens_keeps_a_whole_second_unread() -> None:
    """Here we may go beyond the limit of the system; elsewhere `run.toml` tells what we got."""
    with (
        socketcan() as wire,
        open_bus(BusAddress("socketcan", VCAN), receive_own_messages=False) as bus,
    ):
        sender = wire.node(False)
        granted = receive_buffer(bus)
        assert granted is not None
        assert granted >= RECEIVE_BUFFER
        for number in range(BURST):
            send(sender, numbered(number))
        assert numbers(receive(bus, BURST)) == list(range(BURST))


def test_an_error_frame_of_the_kernel_tells_that_the_controller_is_off() -> None:
    """A vcan has no controller, so the frame is put there as a driver would (linux/can/error.h)."""
    off, back = (0x20000040, bytes(8)), (0x20000100, bytes(8))
    with (
        open_bus(BusAddress("socketcan", VCAN), receive_own_messages=False) as bus,
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as driver,
    ):
        driver.bind((VCAN,))
        controller = ControllerState(bus)
        assert not controller.off()
        for (identifier, details), is_off in ((off, True), (back, False)):
            driver.send(struct.pack("=IB3x8s", identifier, 8, details))
            [heard] = receive(bus, 1)
            assert heard.is_error_frame
            controller.error_frame(heard)
            controller.off()  # what was since it was asked last
            assert controller.off() is is_off


def test_candump_sees_what_was_sent_and_cansend_is_heard() -> None:
    """can-utils are the other implementation: neither side can be wrong in the same way."""
    witness = subprocess.Popen(
        ["candump", "-L", "-n", "9", VCAN], stdout=subprocess.PIPE, text=True
    )
    with socketcan() as wire:
        node = wire.node(False)
        wait_for_listeners(2)
        for length in range(8):
            send(
                node,
                can.Message(
                    arbitration_id=length, data=range(length), is_extended_id=bool(length % 2)
                ),
            )
        subprocess.run(["cansend", VCAN, "7FF##1" + "A5" * 12], check=True)
        [heard] = receive(node, 1)
    lines = witness.communicate(timeout=PATIENCE)[0].splitlines()
    assert (heard.arbitration_id, bytes(heard.data), heard.is_fd) == (0x7FF, b"\xa5" * 12, True)
    *classic, wide = (line.split()[2] for line in lines)
    assert classic == [
        f"{n:0{8 if n % 2 else 3}X}#{bytes(range(n)).hex().upper()}" for n in range(8)
    ]
    # Newer kernels add the flag 4, "this is CAN FD", to 1, "its data was sent at the higher rate".
    assert wide in {f"7FF##{flags}" + "A5" * 12 for flags in "15"}
