"""Laws of the protection of a message: each kind finds what it promises to find."""

from random import Random

import cantools.database.can as can
import numpy as np
import pytest

from slipbench.protocol.codec.checksum import checksum, checksums
from slipbench.protocol.codec.protection import (
    Bits,
    Guard,
    Plain,
    Profile1,
    Profile2,
    Profile5,
    guard_of,
)
from slipbench.protocol.database.layout import Checksum, Message, Protection, Signal
from slipbench.protocol.errors import InputError

J1850 = Checksum("sum", "crc8", 0x1D, 0xFF, 0xFF)
IDS = bytes(range(1, 17))
COUNTERS = {  # layouts of a counter, byte 0 is the checksum
    "nibble": Bits(8, 0xF, False),
    "big nibble of 8 bytes": Bits(48, 0xF, True),
    "across bytes": Bits(13, 0x3FF, False),
    "big, across bytes": Bits(29, 0x3FF, True),
}
GUARDS: dict[str, Guard] = {
    "E2E1": Profile1(0x123),
    "E2E2": Profile2(IDS),
    "E2E5": Profile5(0x1234),
    "crc8": Plain(Bits(8, 0xF, False), 16, 0, J1850),
    "xor": Plain(Bits(8, 0xF, False), 15, 0, Checksum("sum", "xor", start=0x5A)),
    "sum": Plain(Bits(8, 0xFF, False), 256, 0, Checksum("sum", "sum", final_xor=0xFF)),
    "crc8 at the end": Plain(None, 0, 7, Checksum("sum", "crc8", 0x2F, 0x11, 0)),
    **{f"counter, {key}": Plain(bits, 10, 0, None) for key, bits in COUNTERS.items()},
}
CHECKED = [name for name in GUARDS if not name.startswith("counter")]


def payloads(seed: str, number: int, length: int = 8) -> list[bytearray]:
    print("seed", seed)
    random = Random(seed)
    return [bytearray(random.randbytes(length)) for _ in range(number)]


# Check values of the catalogue of parametrised CRC algorithms (Cook), for "123456789".
@pytest.mark.parametrize(
    ("rule", "value"),
    [
        (J1850, 0x4B),
        (Checksum("", "crc8", 0x2F, 0xFF, 0xFF), 0xDF),  # CRC-8/AUTOSAR
        (Checksum("", "crc8", 0x07), 0xF4),  # CRC-8/SMBUS
        (Checksum("", "crc8", 0x9B, 0xFF), 0xDA),  # CRC-8/CDMA2000
        (Checksum("", "xor"), 0x31),
        (Checksum("", "sum"), 0xDD),
        (Checksum("", "sum", start=0x11), 0xEE),
        (Checksum("", "sum", start=0x30, final_xor=0x0F), 0x02),
    ],
)
def test_checksums_have_the_published_check_values(rule, value):
    data = b"123456789"
    assert checksum(rule, data) == value
    assert checksums(rule, np.frombuffer(data, np.uint8)[None, :]).tolist() == [value]


# AUTOSAR, E2E protocol specification (PRS_E2EProtocol), examples of each profile: 8 bytes of zero.
@pytest.mark.parametrize(
    ("guard", "counter", "expected"),
    [
        (Profile1(0x123), 0, "cc00"),
        (Profile2(IDS), 1, "1b01"),
        (Profile2(IDS), 2, "9802"),
        (Profile2(IDS), 3, "3103"),
        (Profile2(IDS), 4, "0d04"),
        (Profile5(0x1234), 0, "1cca00"),
    ],
)
def test_profiles_have_the_values_of_the_specification(guard, counter, expected):
    payload = bytearray(8)
    guard.protect(payload, counter)
    assert payload.hex() == expected.ljust(16, "0")


@pytest.mark.parametrize("name", GUARDS)
def test_what_is_protected_is_intact_under_every_counter_and_nothing_else_changed(name):
    guard = GUARDS[name]
    for payload in payloads(name, 10):
        for counter in range(guard.period or 1):
            made = bytearray(payload)
            guard.protect(made, counter)
            assert guard.intact(made)
            assert guard.counter(made) == (counter if guard.period else None)
            again = bytearray(made)
            guard.protect(again, counter)
            assert again == made
    changed = [a ^ b for a, b in zip(payload, made, strict=True)]
    touched = {
        "E2E1": "ff0f",
        "E2E2": "ff0f",
        "E2E5": "ffffff",
        "crc8": "ff0f",
        "xor": "ff0f",
        "sum": "ffff",
    }
    if name in touched:
        header = bytes.fromhex(touched[name].ljust(16, "0"))
        assert all(bits & ~may == 0 for bits, may in zip(changed, header, strict=True))


@pytest.mark.parametrize("name", CHECKED)
def test_each_single_bit_error_is_found(name):
    guard = GUARDS[name]
    for number, payload in enumerate(payloads(name, 4)):
        guard.protect(payload, number)
        for bit in range(64):
            wrong = bytearray(payload)
            wrong[bit // 8] ^= 1 << bit % 8
            assert not guard.intact(wrong), bit


@pytest.mark.parametrize("name", ["E2E1", "E2E2", "E2E5", "crc8"])
def test_each_burst_within_one_byte_is_found(name):
    """A CRC of n bits finds each burst of up to n bits (Peterson and Brown, 1961)."""
    guard, (payload,) = GUARDS[name], payloads(name, 1)
    guard.protect(payload, 3)
    for place in range(8):
        for burst in range(1, 256):
            wrong = bytearray(payload)
            wrong[place] ^= burst
            assert not guard.intact(wrong), (place, burst)


@pytest.mark.parametrize("name", ["E2E1", "E2E2", "E2E5"])
def test_a_frame_of_another_data_id_is_not_intact(name):
    other = {"E2E1": Profile1(0x124), "E2E2": Profile2(IDS[1:] + IDS[:1]), "E2E5": Profile5(0x1235)}
    (payload,) = payloads(name, 1)
    GUARDS[name].protect(payload, 4)
    assert not other[name].intact(payload)


@pytest.mark.parametrize("name", GUARDS)
def test_a_log_is_checked_as_its_frames_are_one_by_one(name):
    guard = GUARDS[name]
    rows = payloads(name, 200)
    for number, payload in enumerate(rows[:40]):
        guard.protect(payload, number % (guard.period or 1))
    data = np.array([list(row) for row in rows], np.uint8)
    assert guard.all_intact(data).tolist() == [guard.intact(bytearray(row)) for row in rows]
    counters = [guard.counter(row) or 0 for row in rows]
    assert guard.counters(data).tolist() == counters
    for some in (data, data[:0]):
        assert guard.all_intact(some).dtype == np.bool_
        assert guard.counters(some).dtype == np.int64


@pytest.mark.parametrize("name", ["xor", *(f"counter, {key}" for key in COUNTERS)])
def test_a_counter_is_intact_in_a_log_exactly_below_its_period(name):
    guard, data = GUARDS[name], np.zeros((16, 8), np.uint8)
    for counter in range(16):
        payload = bytearray(8)
        guard.protect(payload, counter)
        data[counter] = list(payload)
    assert guard.all_intact(data).tolist() == [counter < guard.period for counter in range(16)]


def test_a_counter_that_its_sender_never_reaches_is_not_intact():
    for guard, header in ((GUARDS["E2E1"], b"\x00\x0f"), (GUARDS["counter, nibble"], b"\x00\x0a")):
        payload = bytearray(header + bytes(6))
        assert not guard.intact(payload)


def message(*signals: Signal, protection: Protection, length: int = 8) -> Message:
    return Message("Made", 0x100, length, signals, protection=protection)


PLACED = (Signal("crc", 0, 8), Signal("cnt", 8, 4), Signal("value", 16, 16))


@pytest.mark.parametrize(
    ("made", "says"),
    [
        (message(*PLACED, protection=Protection(7)), "profile 7"),
        (message(protection=Protection(1, 5), length=1), "1 bytes"),
        (message(protection=Protection(2, 0, IDS), length=1), "1 bytes"),
        (message(protection=Protection(5, 5), length=2), "2 bytes"),
        (message(*PLACED, protection=Protection(0, counter="nobody")), "nobody"),
        (message(*PLACED, protection=Protection(0, counter="cnt", period=17)), "period = 17"),
        (
            message(*PLACED, protection=Protection(0, checksum=Checksum("value", "xor"))),
            "Made.value cannot be a checksum",
        ),
        (
            message(Signal("crc", 4, 8), protection=Protection(0, checksum=Checksum("crc", "xor"))),
            "one whole byte",
        ),
        (
            message(Signal("cnt", 8, 4, signed=True), protection=Protection(0, counter="cnt")),
            "Made.cnt cannot be a counter",
        ),
        (
            message(
                Signal("page", 0, 1, is_multiplexer=True),
                Signal("cnt", 8, 4, multiplexer="page", multiplexer_ids=(1,)),
                protection=Protection(0, counter="cnt"),
            ),
            "in every frame",
        ),
    ],
)
def test_a_protection_that_does_not_suit_its_message_is_refused(made, says):
    with pytest.raises(InputError, match="Made") as refused:
        guard_of(made)
    assert says in str(refused.value)


@pytest.mark.parametrize(
    ("protection", "taken", "free"),
    [
        (Protection(1, 5), ("crc", "cnt"), "value"),
        (Protection(2, 0, IDS), ("crc", "cnt"), "value"),
        (Protection(5, 5), ("crc", "cnt", "value"), "other"),
        (Protection(0, counter="cnt"), ("cnt",), "crc"),
        (Protection(0, counter="cnt", checksum=Checksum("crc", "sum")), ("cnt", "crc"), "value"),
    ],
)
def test_no_role_lies_where_the_protection_writes(protection, taken, free):
    made = message(*PLACED, Signal("other", 32, 8), protection=protection)
    assert guard_of(made, [free]) is not None
    for name in taken:
        with pytest.raises(InputError, match=f"^Made.{name} is bound to a role"):
            guard_of(made, [free, name])


@pytest.mark.parametrize("big", [False, True])
def test_a_counter_signal_is_read_and_written_as_the_database_lays_it_out(big):
    for start, length in ((12, 4), (10, 11), (3, 2), (23, 16)):
        signal = Signal("cnt", start, length, little_endian=not big)
        made = message(signal, protection=Protection(0, counter="cnt"))
        guard = guard_of(made)
        order = "big_endian" if big else "little_endian"
        theirs = can.Message(0, "Made", 8, [can.Signal("cnt", start, length, order)])
        for counter in (0, 1, (1 << length) - 1):
            payload = bytearray(8)
            guard.protect(payload, counter)
            assert payload == theirs.encode({"cnt": counter}), (start, length, counter)
            assert guard.counter(payload) == counter


@pytest.mark.parametrize(
    ("protection", "guard", "length"),
    [
        (Protection(1, 0x123), Profile1(0x123), 2),
        (Protection(2, 0, IDS), Profile2(IDS), 2),
        (Protection(5, 0x1234), Profile5(0x1234), 3),
    ],
)
def test_a_profile_fits_in_a_message_as_long_as_its_header(protection, guard, length):
    assert guard_of(message(protection=protection, length=length)) == guard


@pytest.mark.parametrize("byte", [0, 3, 7])
def test_a_checksum_lies_in_the_byte_of_its_signal(byte):
    for little in (True, False):
        signal = Signal("crc", 8 * byte + (0 if little else 7), 8, little_endian=little)
        rule = Checksum("crc", "xor")
        made = message(signal, protection=Protection(0, checksum=rule))
        assert guard_of(made) == Plain(None, 0, byte, rule)


def test_a_counter_without_a_checksum_has_none():
    made = message(*PLACED, protection=Protection(0, counter="cnt"))
    assert guard_of(made) == Plain(Bits(8, 0xF, False), 16, 0, None)


def test_a_counter_has_at_most_16_bits_and_a_checksum_is_in_every_frame():
    made = message(Signal("cnt", 8, 17), protection=Protection(0, counter="cnt"))
    with pytest.raises(InputError, match="cannot be a counter"):
        guard_of(made)
    paged = Signal("crc", 8, 8, multiplexer="page", multiplexer_ids=(1,))
    protection = Protection(0, checksum=Checksum("crc", "xor"))
    with pytest.raises(InputError, match="cannot be a checksum"):
        guard_of(message(Signal("page", 0, 1, is_multiplexer=True), paged, protection=protection))


@pytest.mark.parametrize(
    ("start", "length", "taken"),
    [(7, 8, True), (11, 4, True), (12, 2, True), (13, 4, True), (15, 4, False), (23, 8, False)],
)
def test_a_big_endian_signal_lies_in_the_header_where_one_of_its_bits_does(start, length, taken):
    """Profile 1 writes byte 0 and the low nibble of byte 1; start: the highest bit of the signal."""
    made = message(Signal("s", start, length, little_endian=False), protection=Protection(1, 5))
    if not taken:
        assert guard_of(made, ["s"]) == Profile1(5)
        return
    with pytest.raises(InputError, match=r"Made\.s is bound to a role"):
        guard_of(made, ["s"])
