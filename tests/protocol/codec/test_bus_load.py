"""Laws: a frame's bits are counted as they are sent, and the bus carries the database in time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.dbc import MOTORBIKE, MOTORBIKE_FD
from slipbench.protocol.codec.bus_load import bus_load
from slipbench.protocol.codec.frame_bits import frame_bits
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database, Message
from slipbench.protocol.database.schedule import load, longest, schedule
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.frame_log import FrameLog
from tests.protocol.logs.test_decode import LENGTHS, log_of

BITRATE, FAST = 1_000_000, 5_000_000
DLC = {length: code for code, length in enumerate([*range(9), 12, 16, 20, 24, 32, 48, 64])}


def number(value, width):
    return [value >> place & 1 for place in reversed(range(width))]


def crc15(bits):
    """Bosch, CAN Specification 2.0, section 3.1.1: the shift register, bit by bit."""
    register = 0
    for bit in bits:
        next_bit = bit ^ (register >> 14 & 1)
        register = register << 1 & 0x7FFF
        if next_bit:
            register ^= 0x4599
    return number(register, 15)


def stuffed(bits):
    """The bits as sent: after five equal ones their complement."""
    sent = []
    for bit in bits:
        sent.append(bit)
        if len(sent) >= 5 and len(set(sent[-5:])) == 1:
            sent.append(1 - bit)
    return sent


def identifier_bits(identifier, extended):
    if not extended:
        return [0, *number(identifier, 11)]
    return [0, *number(identifier >> 18, 11), 1, 1, *number(identifier & 0x3FFFF, 18)]


def payload_bits(payload):
    return [bit for byte in payload for bit in number(byte, 8)]


def classic(identifier, extended, payload):
    control = [0, 0, 0, *number(len(payload), 4)]
    bits = [*identifier_bits(identifier, extended), *control, *payload_bits(payload)]
    return len(stuffed([*bits, *crc15(bits)])) + 13


def fd(identifier, extended, payload):
    """Bits at the nominal and at the data rate."""
    flags = [0, 1, 0, 1] if extended else [0, 0, 1, 0, 1]  # RRS, (IDE), FDF, res, BRS
    slow = [*identifier_bits(identifier, extended), *flags]
    bits = [*slow, 0, *number(DLC[len(payload)], 4), *payload_bits(payload)]
    sent, slow_sent = stuffed(bits), stuffed(slow)
    if (
        len(set(sent[-6:-1])) == 1
        and sent[-1] != sent[-2]
        and sent != [*stuffed(bits[:-1]), bits[-1]]
    ):
        sent = sent[:-1]
    crc = 4 + 17 + 6 if len(payload) <= 16 else 4 + 21 + 7
    return len(slow_sent) + 13, len(sent) - len(slow_sent) + crc


@st.composite
def frames(draw, lengths):
    extended = draw(st.booleans())
    identifier = draw(
        st.integers(0, 0x1FFFFFFF if extended else 0x7FF)
        | st.sampled_from([0, 0x7FF, *([0x1FFFFFFF] if extended else [])])
    )
    length = draw(st.sampled_from(lengths))
    payload = draw(
        st.binary(min_size=length, max_size=length)
        | st.sampled_from([bytes(length), b"\xff" * length, b"\x0f" * length, b"\x83" * length])
    )
    return identifier, extended, payload


@given(st.lists(frames(range(9)), max_size=8))
def test_classic_frames_are_counted_bit_by_bit(sent):
    log = log_of(sent, width=8)
    bits = frame_bits(log)
    assert bits.nominal.tolist() == [classic(*frame) for frame in sent]
    assert not bits.data.any()


@settings(max_examples=200)
@given(st.lists(frames([0, *LENGTHS]), max_size=8))
def test_fd_frames_are_counted_bit_by_bit(sent):
    log = log_of(sent)
    log = FrameLog(**{**vars(log), "fd": np.ones(len(log), np.bool_)})
    bits = frame_bits(log)
    told = list(zip(bits.nominal.tolist(), bits.data.tolist(), strict=True))
    assert told == [fd(*frame) for frame in sent]


@given(frames(range(9)))
def test_no_frame_is_longer_than_the_worst_case(frame):
    identifier, extended, payload = frame
    message = Message("M", identifier, len(payload), extended=extended)
    assert classic(*frame) <= round(longest(message, BITRATE) * BITRATE)


@given(frames([0, *LENGTHS]))
def test_no_fd_frame_is_longer_than_the_worst_case(frame):
    identifier, extended, payload = frame
    message = Message("M", identifier, len(payload), extended=extended, fd=True)
    slow, fast = fd(*frame)
    assert slow / BITRATE + fast / FAST <= longest(message, BITRATE, FAST) + 1e-12


def test_the_worst_case_is_that_of_the_literature():
    """Davis et al. 2007, section 3.1: 55 + 10 s bits with 11-bit, 80 + 10 s with 29-bit ids."""
    for length in range(9):
        for extended, fixed in ((False, 55), (True, 80)):
            message = Message("M", 1, length, extended=extended)
            assert round(longest(message, BITRATE) * BITRATE) == fixed + 10 * length


@pytest.mark.parametrize(("path", "fast"), [(MOTORBIKE, None), (MOTORBIKE_FD, FAST)])
def test_our_bus_carries_its_messages_in_time(path, fast):
    scheduled = schedule(load_database(path), BITRATE, fast)
    assert load(scheduled) < 0.60
    for each in scheduled:
        assert each.response < each.period, each.message.name


@pytest.mark.parametrize(
    ("path", "teeth", "intervals"), [(MOTORBIKE, 16, 3), (MOTORBIKE_FD, 48, 10)]
)
def test_the_tooth_frames_reach_350_km_h(path, teeth, intervals):
    database = load_database(path)
    for name, radius in (("RearTeeth", 0.32), ("FrontTeeth", 0.30)):
        teeth_per_second = 350 / 3.6 / radius / (2 * np.pi) * teeth
        message = database.message(name)
        short = [each for each in message.signals if each.multiplexer_ids == (0,)]
        assert len(short) == intervals
        assert message.cycle_time < intervals / teeth_per_second
        assert short[0].maximum * 1e-6 > 1 / teeth_per_second


def test_the_second_instance_may_be_later_than_the_first():
    """Davis et al. 2007, table 1: three messages of 125 bits at 125 kbit/s.

    The earlier analysis gave 3 ms for the third, the response of its first instance; its second
    takes 3.5 ms.
    """
    bits = 125
    messages = tuple(
        Message(name, rank, 7, cycle_time=period)
        for rank, (name, period) in enumerate([("A", 2.5e-3), ("B", 3.5e-3), ("C", 3.5e-3)])
    )
    scheduled = schedule(Database("paper", "", messages), bits * 1000)
    assert [each.transmission for each in scheduled] == pytest.approx([1e-3] * 3)
    assert [each.response for each in scheduled] == pytest.approx([2e-3, 3e-3, 3.5e-3])


def test_more_than_the_bus_carries_never_arrives():
    messages = (Message("A", 1, 8, cycle_time=1e-3), Message("B", 2, 8, cycle_time=1e-3))
    scheduled = schedule(Database("full", "", messages), 200_000)
    assert scheduled[1].response == float("inf")


def test_a_message_without_a_cycle_time_cannot_be_scheduled():
    with pytest.raises(InputError, match="lonely"):
        schedule(Database("mine.dbc", "", (Message("lonely", 1, 8),)), BITRATE)


@given(st.lists(frames(range(9)), min_size=2, max_size=30), st.floats(1e-5, 1.0))
def test_windows_add_up_to_the_whole(sent, window):
    log = log_of(sent, width=8)
    found = bus_load(log, BITRATE, window=window)["can0"]
    duration = (log.time_ns[-1] - log.time_ns[0]) * 1e-9
    lasts = np.minimum(window, duration - found.time)
    total = frame_bits(log).nominal.sum() / BITRATE
    assert (found.load * lasts).sum() == pytest.approx(total)
    assert found.mean == pytest.approx(total / duration)
    assert found.peak >= found.mean * 0.999999


def test_buses_are_told_apart():
    log = log_of([(1, False, bytes(8)), (1, False, bytes(8)), (1, False, bytes(8))], width=8)
    log = FrameLog(**{**vars(log), "bus": np.array([0, 1, 1], np.uint8), "buses": ("a", "b", "c")})
    found = bus_load(log, BITRATE)
    assert found["b"].mean == pytest.approx(2 * found["a"].mean)
    assert found["c"].mean == 0


def test_a_log_without_frames_has_no_load():
    assert bus_load(log_of([], width=8), BITRATE)["can0"].mean == 0
