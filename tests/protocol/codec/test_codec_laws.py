"""Laws of a codec as it is made from a database: whose layouts it accepts and what it says of them."""

import math
from dataclasses import replace
from enum import IntEnum

import numpy as np
import pytest

from slipbench.dbc import MOTORBIKE
from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.checksum import crc8_table
from slipbench.protocol.codec.codec import MESSAGES, Codec, Sender
from slipbench.protocol.codec.encode import encode
from slipbench.protocol.codec.faults import Fault, FrameFault
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    EngineStatus,
    Intervals,
    OpticalSpeed,
    Phase,
    ToothIntervals,
    TrialStatus,
    TripReason,
)
from slipbench.protocol.codec.slot import slot
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database, Message, Protection, Signal
from slipbench.protocol.errors import InputError

DATABASE = load_database(MOTORBIKE)
SPEED = OpticalSpeed(53.21, True, 4.5)
TEETH = ToothIntervals(Intervals.SHORT, 7, (0.0021, 0.0022))


def changed(name: str, **signals: dict) -> Database:
    """The bench's database, some signals of one message changed."""
    return Database(
        "mine.dbc",
        "",
        tuple(
            replace(
                message,
                signals=tuple(replace(s, **signals.get(s.name, {})) for s in message.signals),
            )
            if message.name == name
            else message
            for message in DATABASE.messages
        ),
    )


def test_a_new_codec_knows_every_message_by_name_and_identifier():
    codec = Codec(DATABASE)
    for name in MESSAGES:
        message = DATABASE.message(name)
        assert codec.identifier(name) == message.identifier
        assert codec.name(message.identifier) == name
        signal = message.signal("layout") if "Teeth" in name else message.signals[-1]
        assert codec.period(name, signal.name) > 0
    assert codec.name(0x7FF) is None
    frame = codec.encode(SPEED)
    assert frame == codec.encode(SPEED, counter=0)
    assert codec.counter(*frame) == 0
    assert codec.counter(*codec.encode(SPEED, counter=16)) == 1
    assert isinstance(codec.decode(*frame), OpticalSpeed)
    assert len(frame[1]) == DATABASE.message("OpticalSpeed").length


def test_a_counter_is_that_of_protected_frames_alone():
    codec = Codec(DATABASE)
    identifier, data = codec.encode(SPEED, counter=9)
    assert codec.counter(identifier, data) == 9
    assert codec.counter(identifier, data[:-1]) is None
    assert codec.counter(0x7FF, data) is None
    unprotected = DATABASE.message("Temperatures")
    assert codec.counter(unprotected.identifier, bytes(8)) is None


def test_an_unknown_message_is_an_error_that_lists_those_that_are_known():
    with pytest.raises(InputError, match="no message 'Nobody'") as refused:
        Codec(DATABASE).identifier("Nobody")
    for name in MESSAGES:
        assert name in str(refused.value)


def test_faults_name_the_message_and_what_was_expected_and_found():
    codec = Codec(DATABASE)
    identifier, data = codec.encode(SPEED)
    length = len(data)
    assert codec.decode(identifier, data[:-1]) == FrameFault(
        Fault.SHORT, "OpticalSpeed", "", f"{length} bytes", f"{length - 1} bytes"
    )
    wrong = bytes((data[0] ^ 1, *data[1:]))
    fault = codec.decode(identifier, wrong)
    assert (fault.fault, fault.message, fault.signal) == (Fault.CRC, "OpticalSpeed", "")
    assert fault.found == wrong[:2].hex()
    assert fault.expected
    nobody = codec.decode(0x7FF, data)
    assert (nobody.fault, nobody.message, nobody.found) == (Fault.UNKNOWN, "", "0x7ff")
    assert nobody.expected


def test_a_value_out_of_range_is_named_in_si():
    """EngineStatus.gear beyond its maximum, rightly protected."""
    codec, message = Codec(DATABASE), DATABASE.message("EngineStatus")
    gear = message.signal("gear")
    identifier, data = codec.encode(EngineStatus(1466.0, 2, 0.6, 0.0))
    word = int.from_bytes(data, "little") | ((1 << gear.length) - 1) << gear.start
    payload = bytearray(word.to_bytes(len(data), "little"))
    e2e.protect(payload, message.protection.data_id, 0)
    fault = codec.decode(identifier, payload)
    most = (1 << gear.length) - 1
    assert fault == FrameFault(
        Fault.RANGE, "EngineStatus", "gear", f"{gear.minimum:g} to {gear.maximum:g} (SI)", f"{most}"
    )


def test_a_sender_goes_on_from_the_counter_of_each_message_and_wraps():
    codec = Codec(DATABASE)
    sender = Sender(codec)
    for turn in range(32):
        assert codec.counter(*sender.encode(SPEED)) == turn % 15
        assert sender.counters == {"OpticalSpeed": (turn + 1) % 15}
    with pytest.raises(ValueError, match="speed"):
        sender.encode(replace(SPEED, speed=1e9))
    assert sender.counters == {"OpticalSpeed": 2}  # what was not sent does not count


def test_tooth_frames_hold_what_their_layout_says():
    codec = Codec(DATABASE)
    found = codec.capacity("RearTeeth")
    assert set(found) == set(Intervals)
    for layout, (number, longest) in found.items():
        fits = ToothIntervals(layout, 1, (longest,) * number)
        frame = codec.encode(fits, name="RearTeeth")
        assert codec.decode(*frame).intervals == pytest.approx(fits.intervals)
        for intervals in ((longest,) * (number + 1), (longest * 1.01,), ()):
            with pytest.raises(ValueError, match="RearTeeth"):
                codec.encode(replace(fits, intervals=intervals), name="RearTeeth")
    assert codec.capacity("OpticalSpeed") == {}
    zero = ToothIntervals(Intervals.STANDING, 1, (0.0,))
    assert codec.decode(*codec.encode(zero, name="FrontTeeth")) == zero


def teeth_frame(raws: tuple[int, ...]) -> tuple[int, bytes]:
    """A rightly protected RearTeeth frame of short intervals with these raw values."""
    message = DATABASE.message("RearTeeth")
    codec = Codec(DATABASE)
    identifier, data = codec.encode(TEETH, name="RearTeeth")
    word = int.from_bytes(data, "little")
    slots = [s for s in message.signals if int(Intervals.SHORT) in s.multiplexer_ids]
    for signal, raw in zip(sorted(slots, key=lambda s: s.start), raws, strict=True):
        mask = (1 << signal.length) - 1
        word = word & ~(mask << signal.start) | raw << signal.start
    payload = bytearray(word.to_bytes(len(data), "little"))
    e2e.protect(payload, message.protection.data_id, 0)
    return identifier, bytes(payload)


@pytest.mark.parametrize(
    ("raws", "used"),
    [
        ((5, 6, 7), 3),
        ((5, 6, 0), 2),
        ((5, 0, 0), 1),
        ((0, 0, 0), 0),
        ((5, 0, 7), 0),
        ((0, 6, 7), 0),
    ],
)
def test_intervals_are_those_before_the_first_zero_and_none_may_follow_it(raws, used):
    found = Codec(DATABASE).decode(*teeth_frame(raws))
    if used:
        assert found.intervals == pytest.approx([raw * 1e-6 for raw in raws[:used]])
        assert (found.layout, found.tooth_count) == (Intervals.SHORT, 7)
        return
    assert (found.fault, found.message, found.signal) == (Fault.RANGE, "RearTeeth", "layout")
    assert found.found == str(list(raws))
    assert found.expected


@pytest.mark.parametrize(
    ("signals", "protection"),
    [
        ({"crc": {"start": 4}}, None),
        ({"crc": {"length": 7}}, None),
        ({"counter": {"start": 12}}, None),
        ({"counter": {"length": 3}}, None),
        ({}, Protection(2, 7)),
    ],
)
def test_a_protection_that_is_not_laid_out_as_profile_1_is_refused(signals, protection):
    database = changed("OpticalSpeed", **signals)
    if protection:
        messages = [
            replace(m, protection=protection) if m.name == "OpticalSpeed" else m
            for m in database.messages
        ]
        database = Database("mine.dbc", "", tuple(messages))
    with pytest.raises(InputError, match=r"OpticalSpeed.*profile 1"):
        Codec(database)


def with_message(name: str, **changes) -> Database:
    """The bench's database, one message changed."""
    messages = (replace(m, **changes) if m.name == name else m for m in DATABASE.messages)
    return Database("mine.dbc", "", tuple(messages))


def test_crc_and_counter_without_a_declared_protection_are_refused():
    """Otherwise no CRC would be checked. A message with one of them alone is not protected."""
    signals = DATABASE.message("OpticalSpeed").signals
    header = tuple(s for s in signals if s.name in ("crc", "counter"))
    for kept in (signals, header):
        with pytest.raises(InputError, match=r"OpticalSpeed.*no end-to-end protection"):
            Codec(with_message("OpticalSpeed", signals=kept, protection=None))
    for gone in ("crc", "counter"):
        kept = tuple(s for s in signals if s.name != gone)
        codec = Codec(with_message("OpticalSpeed", signals=kept, protection=None))
        identifier, data = codec.encode(SPEED)
        assert codec.counter(identifier, data) is None
        other = bytes((data[0] ^ 0xFF, data[1] ^ 0x0F)) + data[2:]
        assert codec.decode(identifier, other) == codec.decode(identifier, data)


def test_a_frame_with_an_unknown_layout_is_a_fault_and_no_exception():
    """A layout of three bits carries 4 to 7 as well, which no frame of the bench has."""
    wide = {"layout": {"length": 3, "maximum": 3}, "tooth_count": {"start": 54, "length": 8}}
    signals = tuple(
        replace(s, **wide.get(s.name, {"length": min(s.length, 14)}))
        for s in DATABASE.message("RearTeeth").signals
        if s.name not in ("crc", "counter")
    )
    codec = Codec(with_message("RearTeeth", signals=signals, protection=None))
    for raw in range(8):
        word = raw << 12 | 1 << 22 | 1 << 36
        found = codec.decode(codec.identifier("RearTeeth"), word.to_bytes(8, "little"))
        if raw <= 3:
            assert isinstance(found, ToothIntervals)
        else:
            assert found == FrameFault(Fault.RANGE, "RearTeeth", "layout", "0 to 3 (SI)", str(raw))


@pytest.mark.parametrize("layout", Intervals)
def test_each_layout_of_a_tooth_frame_has_signals_and_a_standing_wheel_has_one(layout):
    signals = DATABASE.message("RearTeeth").signals
    kept = tuple(s for s in signals if int(layout) not in s.multiplexer_ids)
    with pytest.raises(InputError, match=f"0 signals .* layout = {int(layout)} "):
        Codec(with_message("RearTeeth", signals=kept))
    half = {"length": 21, "multiplexer": "layout", "multiplexer_ids": (int(layout),)}
    pair = (Signal("one", 22, unit="us", **half), Signal("two", 43, unit="us", **half))
    both = with_message("RearTeeth", signals=kept + pair)
    if layout is Intervals.STANDING:
        with pytest.raises(InputError, match=f"2 signals .* layout = {int(layout)} "):
            Codec(both)
    else:
        assert Codec(both).capacity("RearTeeth")[layout] == (2, pytest.approx((2**21 - 1) * 1e-6))


@pytest.mark.parametrize("change", [{"little_endian": False}, {"is_float": True}])
def test_columns_are_encoded_for_little_endian_integers_only(change):
    with pytest.raises(ValueError, match=r"OpticalSpeed\.speed: only little-endian"):
        encode(changed("OpticalSpeed", speed=change), "OpticalSpeed", {"speed": np.ones(2)})


def test_a_unit_that_is_not_known_is_refused_and_the_known_ones_are_named():
    with pytest.raises(InputError, match="unit 'furlong'") as refused:
        Codec(changed("OpticalSpeed", speed={"unit": "furlong"}))
    assert "km/h" in str(refused.value)
    assert "OpticalSpeed.speed" in str(refused.value)
    unknown = changed("OpticalSpeed", speed={"unit": "furlong"})
    with pytest.raises(InputError, match="unit 'furlong'") as refused:
        encode(unknown, "OpticalSpeed", {"speed": np.ones(2)})
    assert "OpticalSpeed.speed" in str(refused.value)
    # A count is raw, so a codec takes any unit of it; its period has none that is known.
    codec = Codec(changed("RearTeeth", tooth_count={"unit": "teeth"}))
    with pytest.raises(InputError, match="unit 'teeth'") as refused:
        codec.period("RearTeeth", "tooth_count")
    assert "RearTeeth.tooth_count" in str(refused.value)


class Three(IntEnum):
    A, B, C = 0, 1, 2


class Gap(IntEnum):
    A, C = 0, 2


def one_signal(**changes) -> tuple[Database, Message]:
    signal = Signal("x", 8, 4, **changes)
    message = Message("M", 1, 2, (signal,))
    return Database("mine.dbc", "", (message,)), message


def test_the_range_of_a_signal_is_that_of_its_bits_and_of_what_the_database_allows():
    """Bounds that are no multiple of the resolution leave what lies between them."""
    for changes, low, high in (
        ({}, 0, 15),
        ({"signed": True}, -8, 7),
        ({"minimum": 2.0, "maximum": 9.0}, 2, 9),
        ({"minimum": -3.0, "maximum": 99.0}, 0, 15),
        ({"scale": 0.1, "offset": 1.0, "minimum": 1.25, "maximum": 1.95}, 3, 9),
        ({"scale": 0.1, "offset": 1.0, "minimum": 1.3, "maximum": 1.9}, 3, 9),
        ({"scale": 0.1, "offset": 1.0, "maximum": 1.9}, 0, 9),
        ({"scale": 0.1, "offset": 1.0, "minimum": 1.3}, 3, 15),
        ({"scale": -0.1, "offset": 1.0, "maximum": 0.7}, 3, 15),
        ({"scale": -0.1, "offset": 1.0, "minimum": 0.1}, 0, 9),
        ({"scale": -0.1, "offset": 1.0, "minimum": 0.1, "maximum": 0.7}, 3, 9),
    ):
        place = slot(*one_signal(**changes), "x", float)
        assert (place.low, place.high) == (low, high), changes
        assert (place.shift, place.mask) == (8, 15)
        assert place.sign == (8 if changes.get("signed") else 0)


def test_an_enumeration_must_have_a_member_for_each_value():
    place = slot(*one_signal(maximum=2.0), "x", Three)
    assert place.values == {0: Three.A, 1: Three.B, 2: Three.C}
    assert slot(*one_signal(maximum=1.0), "x", bool).values == {0: False, 1: True}
    assert slot(*one_signal(), "x", float).values is None
    assert slot(*one_signal(), "x", int).values is None
    with pytest.raises(InputError, match="the signal carries 0 to 2") as refused:
        slot(*one_signal(maximum=2.0), "x", Gap)
    assert "mine.dbc: M.x" in str(refused.value)
    with pytest.raises(InputError, match="the signal carries 0 to 3"):
        slot(*one_signal(maximum=3.0), "x", Three)


def test_a_count_is_a_raw_value_and_a_quantity_has_its_unit():
    database, message = one_signal(scale=2.0, offset=1.0, unit="km/h")
    count, speed = (slot(database, message, "x", kind) for kind in (int, float))
    assert (count.scale, count.offset) == (1, 0)
    assert speed.scale == pytest.approx(2.0 / 3.6)
    assert speed.offset == pytest.approx(1.0 / 3.6)
    assert count.name == "mine.dbc: M.x"
    assert speed.physical(3) == f"{7.0 / 3.6:g}"
    hot = slot(*one_signal(offset=5.0, unit="degC"), "x", float)
    assert hot.offset == pytest.approx(278.15)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_refused_by_name(value):
    for wraps in (False, True):
        place = slot(*one_signal(wraps=wraps), "x", float)
        with pytest.raises(ValueError, match=r"M\.x = -?(nan|inf) is not a number"):
            place.pack(value)


def test_a_value_is_packed_to_the_nearest_step_in_its_place():
    place = slot(*one_signal(scale=0.5, offset=-1.0, maximum=3.0), "x", float)
    assert place.pack(0.2) == 2 << 8
    assert place.pack(0.3) == 3 << 8
    assert place.pack(-1.2) == 0
    assert place.pack(3.2) == 8 << 8
    for value in (-1.3, 3.3):
        with pytest.raises(ValueError, match=r"M\.x = .* is not in -1 to 3 \(SI\)"):
            place.pack(value)
    wrapping = slot(*one_signal(wraps=True), "x", float)
    assert wrapping.pack(17.0) == 1 << 8
    signed = slot(*one_signal(signed=True), "x", float)
    assert signed.pack(-1.0) == 15 << 8


def test_columns_hold_counts_raw_and_quantities_in_si_and_wrap_where_a_clock_does():
    database, _ = one_signal(scale=2.0, offset=1.0)
    assert encode(database, "M", {"x": np.array([1, 15])})[:, 1].tolist() == [1, 15]
    assert encode(database, "M", {"x": np.array([True, False])})[:, 1].tolist() == [1, 0]
    assert encode(database, "M", {"x": np.array([1.0, 31.0])})[:, 1].tolist() == [0, 15]
    assert encode(database, "M", {"x": np.array([5.0, 6.9])})[:, 1].tolist() == [2, 3]
    database, _ = one_signal(wraps=True)
    assert encode(database, "M", {"x": np.array([15.0, 16.0, 33.0])})[:, 1].tolist() == [15, 0, 1]
    database, _ = one_signal(signed=True)
    assert encode(database, "M", {"x": np.array([-8, -1, 7])})[:, 1].tolist() == [8, 15, 7]
    assert encode(database, "M", {"x": 3}).shape == (1, 2)


@pytest.mark.parametrize("wrong", [[0, 16, 3], [0.0, -1.0, 99.0], [2.0, 15.6, 1.0]])
def test_the_first_value_that_does_not_fit_is_named_with_its_place(wrong):
    database, _ = one_signal()
    with pytest.raises(ValueError, match=rf"M\.x: {round(wrong[1])} at place 1 is not in 0 to 15"):
        encode(database, "M", {"x": np.array(wrong)})


def test_an_offset_counts_in_what_a_refusal_says():
    database, _ = one_signal(scale=2.0, offset=1.0)
    with pytest.raises(ValueError, match=r"33 at place 0 is not in 1 to 31 \(SI\)"):
        encode(database, "M", {"x": np.array([33.0])})


def test_columns_of_a_message_longer_than_a_word_are_refused():
    message = Message("M", 1, 9, (Signal("x", 8, 4),), fd=True)
    with pytest.raises(ValueError, match="up to 8 bytes"):
        encode(Database("mine.dbc", "", (message,)), "M", {"x": np.ones(1)})
    eight = Message("M", 1, 8, (Signal("x", 60, 4), Signal("y", 0, 4)))
    frames = encode(
        Database("mine.dbc", "", (eight,)), "M", {"x": np.array([9]), "y": np.array([3])}
    )
    assert frames.tolist() == [[3, 0, 0, 0, 0, 0, 0, 9 << 4]]


def test_columns_are_protected_from_the_counter_on_that_is_given():
    codec, database = Codec(DATABASE), DATABASE
    columns = {"speed": np.full(40, 53.21), "valid": np.ones(40, int), "time": np.full(40, 4.5)}
    for first in (0, 4):
        frames = encode(database, "OpticalSpeed", columns, first)
        for number, frame in enumerate(frames):
            assert bytes(frame) == codec.encode(SPEED, counter=(first + number) % 15)[1]
    assert (
        encode(database, "OpticalSpeed", columns) == encode(database, "OpticalSpeed", columns, 0)
    ).all()


def test_an_unprotected_message_is_laid_out_and_nothing_else():
    frames = encode(
        DATABASE, "Temperatures", {DATABASE.message("Temperatures").signals[0].name: 300.0}
    )
    assert frames.shape == (1, DATABASE.message("Temperatures").length)


def test_a_counter_is_written_modulo_15_and_leaves_the_nibble_beside_it():
    for counter in (0, 14, 15, 16, 31):
        payload = bytearray(b"\x00\xa9\x05")
        e2e.protect(payload, 0x1234, counter)
        assert payload[1] == 0xA0 | counter % 15
        assert e2e.crc_is_right(payload, 0x1234)
        assert not e2e.crc_is_right(payload, 0x1235)


def test_the_age_of_a_stale_frame_is_named_with_what_was_allowed():
    state, _ = e2e.check(e2e.INITIAL, 3, True, 1.0, 0.25)
    assert e2e.silence(state, 1.25, 0.25) is None
    assert e2e.silence(state, 1.5, 0.25) == FrameFault(Fault.STALE, "", "", "within 0.25", "0.5")
    assert e2e.INITIAL.counter is e2e.INITIAL.time is None


def test_a_frame_after_a_gap_names_how_many_were_lost_and_is_the_last_seen():
    state, fault = e2e.check(e2e.INITIAL, 13, True, 1.0, 0.25)
    assert fault is None
    state, fault = e2e.check(state, 2, True, 1.1, 0.25)  # 14, 0 and 1 are missing
    assert fault == FrameFault(Fault.LOST, count=3)
    assert state == e2e.ReceiverState(2, 1.1)
    state, fault = e2e.check(state, 3, True, 1.2, 0.25)
    assert fault is None
    again, fault = e2e.check(state, 3, True, 1.3, 0.25)
    assert (again, fault) == (state, FrameFault(Fault.REPEATED))
    again, fault = e2e.check(state, 4, False, 1.3, 0.25)
    assert (again, fault) == (state, FrameFault(Fault.CRC))


def test_losses_of_a_log_are_counted_frame_by_frame():
    found = e2e.losses(np.array([13, 2, 3, 3, 2], np.int64))
    assert found.tolist() == [0, 3, 0, -1, 13]
    assert found.dtype == np.int64
    assert e2e.losses(np.array([], np.int64)).tolist() == []
    assert e2e.losses(np.array([5], np.int64)).tolist() == [0]


def test_a_command_that_is_released_encodes_and_decodes_in_a_new_codec():
    codec = Codec(DATABASE)
    release = ActuatorCommand(Authority.NONE, 0.0, 0.0, 1.0)
    assert codec.decode(*codec.encode(release)) == release


def test_the_table_is_that_of_the_crc_of_sae_j1850():
    """Its check value: start and final inversion of 0xFF, over the digits 1 to 9, give 0x4B."""
    table, crc = crc8_table(0x1D), 0xFF
    assert sorted(table) == list(range(256))
    for byte in b"123456789":
        crc = table[crc ^ byte]
    assert crc ^ 0xFF == 0x4B
    found = e2e.crcs(np.zeros((2, 3), np.uint8), 7)
    assert found.dtype == np.uint8


@pytest.mark.parametrize("name", ["crc", "counter"])
def test_a_protected_message_without_crc_or_counter_is_refused(name):
    signals = tuple(s for s in DATABASE.message("OpticalSpeed").signals if s.name != name)
    messages = tuple(
        replace(m, signals=signals) if m.name == "OpticalSpeed" else m for m in DATABASE.messages
    )
    with pytest.raises(InputError, match="OpticalSpeed"):
        Codec(Database("mine.dbc", "", messages))


def test_clocks_of_the_bench_wrap_in_columns_where_no_attribute_says_so():
    """As in single messages; a signal of the same name in another message does not."""
    database = changed("OpticalSpeed", time={"wraps": False})
    period = Codec(DATABASE).period("OpticalSpeed", "time")
    columns = {"speed": [53.21] * 2, "valid": [1, 1]}
    late, early = (
        encode(database, "OpticalSpeed", columns | {"time": np.full(2, t)})
        for t in (4.5 + period, 4.5)
    )
    assert (late == early).all()
    other = Message("Other", 1, 8, (Signal("time", 0, 16),))
    with pytest.raises(ValueError, match=r"Other\.time"):
        encode(Database("mine.dbc", "", (other,)), "Other", {"time": np.array([70_000.0])})


def test_whole_numbers_of_the_own_database_are_received_as_whole_numbers():
    codec = Codec(DATABASE)
    engine = codec.decode(*codec.encode(EngineStatus(1000.0, 3, 0.1, 0.0)))
    status = TrialStatus(Phase.ARMED, Authority.NONE, TripReason.NONE, 70_001)
    assert type(engine.gear) is int
    assert type(codec.decode(*codec.encode(status)).tick) is int
