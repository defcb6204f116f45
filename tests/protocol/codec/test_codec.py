"""Laws: what one node says another hears, in SI, or the frame is refused by name."""

import math
from dataclasses import fields
from enum import IntEnum
from itertools import permutations
from typing import get_type_hints

import cantools.database
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.dbc import MOTORBIKE, MOTORBIKE_FD
from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.codec import MESSAGES, Codec, Sender
from slipbench.protocol.codec.faults import Fault, FrameFault
from slipbench.protocol.codec.messages import (
    Authority,
    EcuStatus,
    Intervals,
    Phase,
    ToothIntervals,
    TrialStatus,
    TripReason,
)
from slipbench.protocol.codec.slot import SI
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError
from slipbench.protocol.units import linear

DATABASES = {path.stem: load_database(path) for path in (MOTORBIKE, MOTORBIKE_FD)}
CODECS = {name: Codec(database) for name, database in DATABASES.items()}
DATABASE, CODEC = DATABASES["motorbike"], CODECS["motorbike"]
REFERENCE = cantools.database.load_file(MOTORBIKE)
PLAIN = [name for name, kind in MESSAGES.items() if kind is not ToothIntervals]


def resolution(signal):
    """One step of a signal in SI."""
    return abs(signal.scale * linear(signal.unit, SI[signal.unit])[0])


def limits(signal):
    """Least and greatest value of a signal in SI."""
    slope, zero = linear(signal.unit, SI[signal.unit])
    return signal.minimum * slope + zero, signal.maximum * slope + zero


@st.composite
def plain(draw, name):
    """Any message but tooth intervals, every value within its range."""
    kind, values = MESSAGES[name], {}
    for field, hint in get_type_hints(kind).items():
        low, high = limits(DATABASE.message(name).signal(field))
        if issubclass(hint, IntEnum):
            values[field] = draw(st.sampled_from(hint))
        elif hint is bool:
            values[field] = draw(st.booleans())
        elif hint is int:
            values[field] = draw(st.integers(round(low), round(high)))
        else:
            values[field] = draw(st.floats(low, high))
    return kind(**values)


@st.composite
def tooth_intervals(draw, codec="motorbike"):
    """Any tooth intervals that fit a frame."""
    message = DATABASES[codec].message("RearTeeth")
    layout = draw(st.sampled_from(Intervals))
    slots = [each for each in message.signals if int(layout) in each.multiplexer_ids]
    most = int(slots[0].maximum)
    sizes = st.integers(1, most)
    intervals = draw(st.lists(sizes, min_size=1, max_size=len(slots)))
    return ToothIntervals(layout, draw(st.integers(0, 255)), tuple(i * 1e-6 for i in intervals))


anything = st.sampled_from(PLAIN).flatmap(lambda name: st.tuples(st.just(name), plain(name)))
any_frame = st.one_of(anything, tooth_intervals().map(lambda message: ("FrontTeeth", message)))
counters = st.integers(0, 14)


@given(anything, counters)
def test_what_is_sent_is_heard_to_half_a_step(named, counter):
    name, message = named
    heard = CODEC.decode(*CODEC.encode(message, counter=counter, name=name))
    assert type(heard) is type(message)
    for field in fields(message):
        signal = DATABASE.message(name).signal(field.name)
        sent, got = getattr(message, field.name), getattr(heard, field.name)
        wrong = abs(sent - got)
        if signal.wraps:  # the last half step is told as the first of the next turn
            wrong = min(wrong, CODEC.period(name, field.name) - wrong)
        assert wrong <= resolution(signal) * 0.5000001, field.name
        assert type(got) is type(sent)


@pytest.mark.parametrize("codec", CODECS)
@given(st.data(), counters)
def test_tooth_intervals_are_heard_as_sent(codec, data, counter):
    message = data.draw(tooth_intervals(codec))
    heard = CODECS[codec].decode(*CODECS[codec].encode(message, counter=counter, name="RearTeeth"))
    assert heard.layout is message.layout
    assert heard.tooth_count == message.tooth_count
    assert heard.intervals == pytest.approx(message.intervals, abs=1e-9)


@given(any_frame, counters)
def test_a_frame_heard_and_sent_again_is_the_same_frame(named, counter):
    frame = CODEC.encode(named[1], counter=counter, name=named[0])
    assert CODEC.encode(CODEC.decode(*frame), counter=counter, name=named[0]) == frame


@settings(max_examples=30)
@given(any_frame, counters)
def test_no_single_wrong_bit_passes_a_protected_frame(named, counter):
    identifier, payload = CODEC.encode(named[1], counter=counter, name=named[0])
    if DATABASE.message(named[0]).protection is None:
        return
    for bit in range(8 * len(payload)):
        wrong = bytearray(payload)
        wrong[bit // 8] ^= 1 << bit % 8
        assert CODEC.decode(identifier, bytes(wrong)).fault is Fault.CRC


@settings(max_examples=20)
@given(any_frame, counters)
def test_no_protected_frame_passes_for_another_message(named, counter):
    _, payload = CODEC.encode(named[1], counter=counter, name=named[0])
    for message in DATABASE.messages:
        if message.protection and message.name != named[0] and len(payload) == message.length:
            heard = CODEC.decode(message.identifier, payload)
            if DATABASE.message(named[0]).protection:
                assert heard.fault is Fault.CRC


def test_every_command_and_safety_status_is_protected_by_an_id_of_its_own():
    protected = {each.name for each in DATABASE.messages if each.protection}
    assert protected == set(MESSAGES) - {"ChassisStatus", "Temperatures"}
    ids = [each.protection.data_id for each in DATABASE.messages if each.protection]
    assert len(set(ids)) == len(ids)


@given(any_frame, counters)
def test_the_wire_is_what_cantools_reads(named, counter):
    name, message = named
    identifier, payload = CODEC.encode(message, counter=counter, name=name)
    read = REFERENCE.decode_message(identifier, payload, decode_choices=False)
    if DATABASE.message(name).protection:
        assert read["counter"] == counter == CODEC.counter(identifier, payload)
    heard = CODEC.decode(identifier, payload)
    for field in fields(message):
        if field.name in read:
            signal = DATABASE.message(name).signal(field.name)
            slope, zero = linear(signal.unit, SI[signal.unit])
            told = read[field.name] * slope + zero
            assert told == pytest.approx(float(getattr(heard, field.name)), rel=1e-12, abs=1e-12)


@given(anything, st.data())
def test_what_does_not_fit_is_refused_never_wrapped(named, data):
    name, message = named
    kinds = get_type_hints(type(message))
    floats = [field for field, kind in kinds.items() if kind is float]
    if not floats:
        return
    field = data.draw(st.sampled_from(floats))
    signal = DATABASE.message(name).signal(field)
    low, high = limits(signal)
    far = data.draw(st.floats(1, 1e9)) * resolution(signal)
    for value in (
        math.nan,
        math.inf,
        -math.inf,
        *(() if signal.wraps else (high + far, low - far)),
    ):
        values = {each: getattr(message, each) for each in kinds} | {field: value}
        with pytest.raises(ValueError, match=field):
            CODEC.encode(type(message)(**values), name=name)


@given(st.sampled_from(PLAIN), st.data())
def test_values_beyond_their_range_are_a_fault_not_a_value(name, data):
    """Even when they are rightly protected."""
    message = DATABASE.message(name)
    payload = bytearray(data.draw(st.binary(min_size=message.length, max_size=message.length)))
    if message.protection:
        e2e.protect(payload, message.protection.data_id, data.draw(counters))
    read = REFERENCE.decode_message(message.identifier, bytes(payload), decode_choices=False)
    names = [field.name for field in fields(MESSAGES[name])]
    outside = [
        each
        for each in names
        if not message.signal(each).minimum - 1e-9
        <= read[each]
        <= message.signal(each).maximum + 1e-9
    ]
    heard = CODEC.decode(message.identifier, payload)
    assert isinstance(heard, FrameFault) == bool(outside)
    if outside:
        assert (heard.fault, heard.message, heard.signal) == (Fault.RANGE, name, outside[0])


@given(any_frame, counters, st.binary(max_size=4))
def test_a_short_frame_is_a_fault_and_a_longer_one_is_read(named, counter, more):
    identifier, payload = CODEC.encode(named[1], counter=counter, name=named[0])
    assert CODEC.decode(identifier, payload + more) == CODEC.decode(identifier, payload)
    for length in range(len(payload)):
        fault = CODEC.decode(identifier, payload[:length])
        assert fault.fault is Fault.SHORT
        assert str(len(payload)) in fault.expected
        assert str(length) in fault.found


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_an_identifier_of_nobody_is_a_fault(identifier, payload):
    if CODEC.name(identifier) is None:
        assert CODEC.decode(identifier, payload).fault is Fault.UNKNOWN


@given(st.integers(0, 10**9), st.integers(0, 10**7))
def test_clocks_and_counts_wrap_at_their_width(microseconds, tick):
    status = EcuStatus(Authority.NONE, 0.0, 0.0, microseconds * 1e-6)
    heard = CODEC.decode(*CODEC.encode(status))
    assert round(heard.time * 1e6) == microseconds % 2**24
    assert CODEC.period("EcuStatus", "time") == pytest.approx(2**24 * 1e-6)
    trial = TrialStatus(Phase.IDLE, Authority.NONE, TripReason.NONE, tick)
    assert CODEC.decode(*CODEC.encode(trial)).tick == tick % CODEC.period("TrialStatus", "tick")


def test_a_sender_counts_each_message_on_its_own():
    sender = Sender(CODEC)
    teeth = ToothIntervals(Intervals.SINGLE, 0, (0.1,))
    for turn in range(40):
        for name in ("RearTeeth", "FrontTeeth"):
            assert CODEC.counter(*sender.encode(teeth, name=name)) == turn % 15


@pytest.mark.parametrize(
    ("layout", "intervals"),
    [
        (Intervals.SHORT, ()),
        (Intervals.SHORT, (0.001,) * 4),
        (Intervals.SHORT, (0.0164,)),
        (Intervals.LONG, (1.05,)),
        (Intervals.SINGLE, (0.0,)),
        (Intervals.SHORT, (0.001, 0.0, 0.001)),
    ],
)
def test_intervals_that_a_layout_cannot_hold_are_refused(layout, intervals):
    with pytest.raises(ValueError, match="RearTeeth"):
        CODEC.encode(ToothIntervals(layout, 1, intervals), name="RearTeeth")


def test_the_wire_resolves_what_identification_needs():
    finest = {
        ("ActuatorCommand", "throttle"): 1e-4,
        ("EcuStatus", "throttle_command"): 1e-4,
        ("ThrottleStatus", "position"): 1e-4,
        ("EcuStatus", "spark_command"): math.radians(0.02),
        ("EngineStatus", "spark_advance"): math.radians(0.02),
        ("EngineStatus", "engine_speed"): 0.5 * math.tau / 60,
        ("OpticalSpeed", "speed"): 0.005,
    }
    for (message, field), step in finest.items():
        assert resolution(DATABASE.message(message).signal(field)) <= step * 1.0000001
    for message in DATABASE.messages:
        for signal in message.signals:
            if signal.name in ("time", "tooth_time"):
                assert signal.unit == "us"
                assert signal.scale == 1
                assert signal.length >= 20


@pytest.mark.parametrize("removed", ["EcuStatus", "RearTeeth"])
def test_a_database_without_a_message_of_the_bench_is_refused_by_name(removed):
    rest = tuple(each for each in DATABASE.messages if each.name != removed)
    with pytest.raises(InputError, match=removed):
        Codec(Database("mine.dbc", "", rest))


def test_both_variants_carry_the_same_messages():
    classic, fd = (DATABASES[name] for name in ("motorbike", "motorbike_fd"))
    assert classic.by_name.keys() == fd.by_name.keys()
    for name in classic.by_name.keys() - {"RearTeeth", "FrontTeeth"}:
        one, other = classic.message(name), fd.message(name)
        assert (one.identifier, one.signals) == (other.identifier, other.signals)
    for one, other in permutations(classic.messages, 2):
        assert one.identifier != other.identifier
