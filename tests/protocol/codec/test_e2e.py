"""Laws: a receiver knows what was lost, repeated, late or wrong, live and in a log alike."""

import numpy as np
from e2e.p01 import e2e_p01_check, e2e_p01_protect
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.faults import Fault

TIMEOUT = 0.010


def heard(counters, state=e2e.INITIAL, period=0.001):
    """Faults that a receiver names as frames with these counters come every ms."""
    faults = []
    for number, counter in enumerate(counters):
        state, fault = e2e.check(state, counter, True, number * period, TIMEOUT)
        faults.append(fault)
    return faults


@given(st.integers(0, 14), st.integers(1, 200))
def test_an_unbroken_count_has_no_fault(first, n):
    assert not any(heard([(first + i) % 15 for i in range(n)]))


@given(st.lists(st.integers(1, 14), min_size=1, max_size=100), st.integers(0, 14))
def test_every_lost_frame_is_counted(steps, first):
    counters = (first + np.cumsum([0, *steps])) % 15
    lost = sum(fault.count for fault in heard(counters.tolist()) if fault)
    assert lost == sum(steps) - len(steps)
    in_log = e2e.losses(counters)
    assert in_log[in_log > 0].sum() == lost


@given(st.lists(st.integers(0, 14), max_size=100))
def test_a_log_is_judged_as_it_would_have_been_live(counters):
    live = heard(counters)
    for fault, lost in zip(live, e2e.losses(np.array(counters, np.int64)).tolist(), strict=True):
        if lost < 0:
            assert fault.fault is Fault.REPEATED
        elif lost:
            assert (fault.fault, fault.count) == (Fault.LOST, lost)
        else:
            assert fault is None


@given(st.integers(0, 14), st.integers(0, 14))
def test_a_wrong_crc_changes_nothing_but_is_told(before, counter):
    state, _ = e2e.check(e2e.INITIAL, before, True, 0.0, TIMEOUT)
    after, fault = e2e.check(state, counter, False, 0.001, TIMEOUT)
    assert after == state
    assert fault.fault is Fault.CRC


@given(st.integers(0, 14), st.floats(0.011, 100))
def test_silence_is_stale_and_a_repetition_does_not_break_it(counter, wait):
    state, _ = e2e.check(e2e.INITIAL, counter, True, 0.0, TIMEOUT)
    assert e2e.silence(state, TIMEOUT, TIMEOUT) is None
    state, fault = e2e.check(state, counter, True, TIMEOUT / 2, TIMEOUT)
    assert fault.fault is Fault.REPEATED
    assert e2e.silence(state, wait, TIMEOUT).fault is Fault.STALE
    state, fault = e2e.check(state, counter, True, wait, TIMEOUT)
    assert fault.fault is Fault.STALE
    assert e2e.check(state, (counter + 1) % 15, True, wait, TIMEOUT)[1] is None


def test_nothing_is_stale_before_it_was_ever_seen():
    assert e2e.silence(e2e.INITIAL, 1e9, TIMEOUT) is None


@given(
    arrays.arrays(np.uint8, st.tuples(st.integers(0, 20), st.integers(2, 30))),
    st.integers(0, 0xFFFF),
)
def test_the_crcs_of_a_log_are_those_of_the_library(data, data_id):
    for row, crc in zip(data, e2e.crcs(data, data_id), strict=True):
        payload = bytearray(row.tobytes())
        e2e_p01_protect(payload, data_id, increment_counter=False)
        assert payload[0] == crc
        counts = payload[1] & 0x0F < e2e.PERIOD
        assert e2e_p01_check(payload, data_id) == counts
        assert e2e.crc_is_right(payload, data_id) == counts
        assert e2e.rightly_protected(np.array([list(payload)], np.uint8), data_id)[0] == counts


@given(st.binary(min_size=2, max_size=30), st.integers(0, 0xFFFF), st.integers(0, 14))
def test_protection_touches_crc_and_counter_alone(payload, data_id, counter):
    protected = bytearray(payload)
    e2e.protect(protected, data_id, counter)
    assert protected[1] == (payload[1] & 0xF0) | counter
    assert protected[2:] == payload[2:]
    assert e2e.crc_is_right(protected, data_id)
