"""Laws: a protection that the frames obey is found, whatever its kind; one that they do not obey is not."""

import numpy as np
import pytest

from slipbench.protocol.binding.protection_search import counter_of, find_checksum, find_profile
from slipbench.protocol.codec.checksum import checksums
from slipbench.protocol.codec.protection import Bits, Guard, Plain, Profile1, Profile2, Profile5
from slipbench.protocol.database.layout import Checksum

LENGTH = 8
EVERYWHERE = tuple(reversed(range(LENGTH)))
COUNTER = Bits(48, 15, False)  # low half of byte 6


def frames(guard: Guard, seed: int, count: int = 400, lost: float = 0.0) -> np.ndarray:
    """Payloads of a sender whose bytes 3 to 5 change, with lost frames. Returns (n, LENGTH)."""
    print(f"seed {seed}")
    random = np.random.default_rng(seed)
    made = []
    for number in range(count):
        payload = bytearray(LENGTH)
        payload[3:6] = random.integers(0, 256, 3, dtype=np.uint8).tobytes()
        guard.protect(payload, number % guard.period if guard.period else 0)
        if random.random() >= lost:
            made.append(list(payload))
    return np.array(made, np.uint8)


@pytest.mark.parametrize(("seed", "count"), [(0, 400), (1, 400), (2, 1200), (3, 6000)])
@pytest.mark.parametrize("profile", [1, 2, 5])
def test_an_autosar_profile_is_found_and_verifies_all_frames(
    profile: int, seed: int, count: int
) -> None:
    random = np.random.default_rng(seed)
    data_id = int(random.integers(0, 1 << 16))
    ids = random.integers(0, 256, 16, dtype=np.uint8).tobytes()
    guard = {1: Profile1(data_id), 2: Profile2(ids), 5: Profile5(data_id)}[profile]
    found = find_profile(frames(guard, seed, count, lost=0.03 if seed < 2 else 0.0))
    assert found is not None
    assert found.protection.profile == profile
    assert found.share == 1.0
    again = {
        1: Profile1(found.protection.data_id),
        2: Profile2(found.protection.data_ids),
        5: Profile5(found.protection.data_id),
    }[profile]
    assert again.all_intact(frames(guard, seed + 1000)).all()  # frames that it has not seen
    if profile == 5:
        assert found.protection.data_id == data_id
    if profile == 1:
        assert found.equivalent == 256  # a CRC of 8 bits cannot tell 16 bits


RULES = [
    Checksum("", "xor"),
    Checksum("", "xor", start=0x5A),
    Checksum("", "sum", start=0x11),
    Checksum("", "sum", start=0x11, final_xor=0xFF),
    *(
        Checksum("", "crc8", polynomial, start, end)
        for polynomial in (0x1D, 0x2F, 0x07, 0x9B, 0x4B)
        for start, end in ((0, 0), (0xFF, 0xFF), (0x33, 0))
    ),
]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: f"{rule.kind}-{rule.polynomial:x}")
@pytest.mark.parametrize("place", [0, 7])
def test_a_checksum_is_found_and_verifies_frames_that_it_has_not_seen(
    rule: Checksum, place: int
) -> None:
    guard = Plain(COUNTER, 16, place, rule)
    found = find_checksum(frames(guard, 7, lost=0.02), (place, *EVERYWHERE))
    assert found is not None
    assert (found.place, found.share, found.others) == (place, 1.0, ())
    assert found.rule.kind == rule.kind
    others = frames(guard, 8)
    assert (checksums(found.rule, np.delete(others, place, axis=1)) == others[:, place]).all()


@pytest.mark.parametrize("kind", ["E2E", "crc8"])
def test_damaged_frames_do_not_hide_a_protection(kind: str) -> None:
    guard = Profile1(0x123) if kind == "E2E" else Plain(COUNTER, 16, 7, Checksum("", "crc8", 0x2F))
    data = frames(guard, 3, count=1000)
    data[::100, 4] ^= 0x10
    found = find_profile(data) if kind == "E2E" else find_checksum(data, EVERYWHERE)
    assert found is not None
    assert 0.985 < found.share < 0.995


@pytest.mark.parametrize("distinct", [16, 60, 300])
def test_random_data_is_never_verified(distinct: int) -> None:
    for seed in range(25):
        print(f"seed {seed}")
        random = np.random.default_rng(seed)
        data = random.integers(0, 256, (distinct, LENGTH), dtype=np.uint8)
        data[:, 1] = (data[:, 1] & 0xF0) | np.arange(distinct) % 15  # a counter alone is no profile
        assert find_profile(data) is None
        assert find_checksum(data, EVERYWHERE) is None


def test_a_copied_byte_is_no_checksum() -> None:
    random = np.random.default_rng(0)
    data = np.zeros((300, LENGTH), np.uint8)
    data[:, 2] = random.integers(0, 256, 300)
    data[:, 7] = data[:, 2] ^ 0x0F
    for changes in (0, 4, 100):  # a switch that changes makes no checksum of a copy
        data[300 - changes :, 4] = 1
        assert find_checksum(data, EVERYWHERE) is None


def test_a_checksum_that_the_capture_cannot_tell_names_the_others() -> None:
    """Bytes that hold 0 or 1: the sum and the XOR of the highest bits cannot be told apart."""
    random = np.random.default_rng(1)
    data = np.zeros((400, LENGTH), np.uint8)
    for place, bit in zip((1, 2, 3, 4, 5), (0, 1, 2, 3, 4), strict=True):
        data[:, place] = random.integers(0, 2, 400) << bit
    data[:, 7] = data[:, :7].sum(axis=1)
    found = find_checksum(data, (7,))
    assert found is not None
    assert {found.rule.kind, *(other.kind for other in found.others)} >= {"sum", "xor"}


@pytest.mark.parametrize(("period", "width"), [(15, 4), (16, 4), (256, 8), (4, 2), (100, 8)])
def test_a_counter_counts_with_lost_frames_and_in_a_thinned_log(period: int, width: int) -> None:
    random = np.random.default_rng(period)
    raw = np.arange(1000) % period
    assert counter_of(raw, width) == (period, 1)
    assert counter_of(raw[random.random(1000) > 0.04], width) == (period, 1)
    if period > 8:
        assert counter_of(raw[::7], width) == (period, 7)


def test_what_is_no_counter_does_not_count() -> None:
    random = np.random.default_rng(5)
    for width in (2, 4, 8, 16):
        assert counter_of(random.integers(0, 1 << width, 2000), width) is None
        assert counter_of(np.zeros(2000, np.int64), width) is None
        assert counter_of(np.arange(2000) % 2, width) is None
    ramp = np.cumsum(random.integers(0, 3, 2000)) % 256
    assert counter_of(ramp, 8) is None
