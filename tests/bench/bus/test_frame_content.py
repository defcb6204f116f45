"""Laws of single-frame signals: cantools agrees, other bits stay, protection is that of the codec."""

import cantools.database
import pytest
from cantools.database.can import Database
from hypothesis import given
from hypothesis import strategies as st

from slipbench import dbc
from slipbench.bench.bus.frame_content import (
    counter_in,
    crc_correct,
    physical,
    protect,
    raw_of,
    raw_value,
    value_in,
    with_raw,
)
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import RiderControls
from slipbench.protocol.database.database import describe, load_database

DATABASE = load_database(dbc.MOTORBIKE)


@st.composite
def messages(draw: st.DrawFn) -> Database:
    """A message of eight bytes with one signal of any place, length, byte order and sign."""
    little = draw(st.booleans())
    length = draw(st.integers(1, 64))
    first = draw(st.integers(0, 64 - length))
    start = first if little else 8 * (first // 8) + 7 - first % 8
    sign, order = draw(st.sampled_from("+-")), int(little)
    text = f'BO_ 100 M: 8 E\n SG_ s : {start}|{length}@{order}{sign} (1,0) [0|0] "" E\n'
    if length == 32 and draw(st.booleans()):
        text += "SIG_VALTYPE_ 100 s : 1;\n"
    loaded = cantools.database.load_string(f'VERSION ""\nBU_: E\n{text}', "dbc", strict=False)
    assert isinstance(loaded, Database)
    return loaded


@given(messages(), st.binary(min_size=8, max_size=8))
def test_a_raw_value_is_that_of_cantools(database: Database, data: bytes) -> None:
    message = describe(database.messages[0])
    decoded = database.decode_message(100, data, decode_choices=False, scaling=False)
    assert isinstance(decoded, dict)
    theirs = decoded["s"]
    ours = raw_value(message.signal("s"), data)
    assert ours == theirs or (ours != ours and theirs != theirs)  # NaN


@given(messages(), st.binary(min_size=8, max_size=8), st.binary(min_size=8, max_size=8))
def test_writing_changes_the_bits_of_the_signal_only(
    database: Database, data: bytes, other: bytes
) -> None:
    signal = describe(database.messages[0]).signal("s")
    raw = raw_value(signal, other)
    written = with_raw(signal, data, raw)
    back = raw_value(signal, written)
    assert back == raw or (back != back and raw != raw)
    before = raw_value(signal, data)
    if raw == raw and before == before:  # a NaN may change its payload
        assert with_raw(signal, written, before) == data


@pytest.mark.parametrize("name", [each.name for each in DATABASE.messages])
def test_a_payload_that_is_too_short_is_no_value(name: str) -> None:
    message = DATABASE.message(name)
    signal = message.signals[-1]
    assert value_in(message, signal, bytes(message.length - 1)) is None
    with pytest.raises(ValueError, match="ends at bit"):
        raw_value(signal, b"")


def test_a_multiplexed_signal_has_a_value_in_its_own_frames_only() -> None:
    message = DATABASE.message("RearTeeth")
    layout = message.signal("layout")
    for number, name in ((0, "short_interval_1"), (1, "long_interval_1"), (3, "standing_time")):
        data = with_raw(layout, bytes(8), number)
        assert value_in(message, message.signal(name), data) == 0.0
        assert value_in(message, message.signal(name), with_raw(layout, data, 2)) is None


@given(st.integers(0, 14), st.floats(0, 1), st.booleans())
def test_protection_is_that_of_the_codec(counter: int, grip: float, button: bool) -> None:
    identifier, data = Codec(DATABASE).encode(
        RiderControls(button, grip, 0.0, 0.0, 0.0), counter=counter
    )
    message = DATABASE.message("RiderControls")
    assert message.identifier == identifier
    assert crc_correct(message, data)
    assert counter_in(message, data) == counter
    damaged = with_raw(
        message.signal("grip"), data, int(raw_value(message.signal("grip"), data)) ^ 1
    )
    assert not crc_correct(message, damaged)
    assert crc_correct(message, protect(message, damaged))
    assert counter_in(message, protect(message, damaged)) == counter
    assert counter_in(message, protect(message, damaged, counter + 1)) == (counter + 1) % 15
    assert protect(message, data) == data


def test_a_message_without_protection_is_not_changed() -> None:
    message = DATABASE.message("ChassisStatus")
    assert protect(message, b"abc", 7) == b"abc"
    assert crc_correct(message, b"abc")
    assert counter_in(message, b"abc") is None


def test_a_value_becomes_the_nearest_raw_value_or_an_error() -> None:
    speed = DATABASE.message("EngineStatus").signal("engine_speed")
    assert physical(speed, raw_of(speed, 9000.2)) == 9000.0
    assert physical(speed, raw_of(speed, 9000.3)) == 9000.5
    with pytest.raises(ValueError, match=r"is not in 0 to 32767\.5"):
        raw_of(speed, 40000)
