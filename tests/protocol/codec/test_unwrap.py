"""Laws: a wrapping count or clock is given its turns back exactly."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from slipbench.protocol.codec.unwrap import unwrap, unwrap_clock

MODULI = st.sampled_from([2, 15, 256, 8192, 2**20, 2**32])


@given(MODULI, st.integers(0, 10**6), st.data())
def test_a_count_that_goes_up_by_less_than_a_turn_is_recovered(modulo, first, data):
    steps = data.draw(st.lists(st.integers(0, modulo - 1), max_size=50))
    true = first + np.cumsum([0, *steps])
    assert (np.diff(unwrap(true % modulo, modulo)) == np.diff(true)).all()
    assert unwrap(true % modulo, modulo)[0] == first % modulo


@given(st.sampled_from([2**20, 2**24, 2**32]), st.integers(0, 2**40), st.data())
def test_a_clock_is_recovered_across_any_gap_despite_jitter(modulo, first, data):
    gaps = data.draw(st.lists(st.integers(0, 20 * modulo), max_size=50))
    true = first + np.cumsum([0, *gaps])
    late = data.draw(
        st.lists(st.integers(0, modulo // 2 - 1), min_size=true.size, max_size=true.size)
    )
    arrival = np.maximum.accumulate(true + np.array(late)) + 12345
    arrival = true + np.array(late) + 12345
    found = unwrap_clock(true % modulo, modulo, arrival)
    assert (found - found[0] == true - true[0]).all()


@given(st.integers(0, 2**30), st.integers(1, 500))
def test_a_frame_overtaken_by_a_younger_one_stays_in_its_place(first, back):
    true = np.array([first, first + 1000, first + 1000 - back, first + 2000])
    found = unwrap_clock(true % 2**20, 2**20, first + np.array([0, 1000, 1001, 2000]))
    assert (np.diff(found) == np.diff(true)).all()


def test_nothing_unwraps_to_nothing():
    nothing = np.zeros(0, np.int64)
    assert unwrap(nothing, 256).size == unwrap_clock(nothing, 256, nothing).size == 0
