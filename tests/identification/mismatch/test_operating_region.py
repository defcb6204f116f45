"""The band of a trace is that of the outputs that show it."""

import numpy as np
import pytest

from slipbench.identification.mismatch.curves.operating_region import _lines


@pytest.mark.parametrize("next_to_nothing", [0.0, 1e-200, 1e-150, 1e-20])
def test_an_output_that_shows_nothing_has_no_say_in_the_band(next_to_nothing):
    t = np.arange(400) * 0.01
    trace = np.sin(2 * np.pi * 4.0 * t)
    beside = next_to_nothing * np.random.default_rng(1).standard_normal(t.size)
    both = _lines([np.stack((trace, beside), axis=1)], 0.01)
    assert both == pytest.approx(_lines([trace[:, None]], 0.01))
    assert np.argmax(both) == 16
