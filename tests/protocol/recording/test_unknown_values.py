"""Samples that a role map calls unknown are left out, whatever the rounding of their text."""

import numpy as np
import pytest

from slipbench.protocol.database.layout import Signal
from slipbench.protocol.logs.decode import Samples
from slipbench.protocol.recording.bus_channels import _known
from slipbench.protocol.recording.role_map import Source


@pytest.mark.parametrize("scale", [0.1, 0.01, 0.3, 1.7])
def test_a_raw_value_is_unknown_by_what_the_database_shows_of_it(scale):
    signal = Signal("s", 0, 8, scale=scale, offset=-40)
    samples = Samples(signal, np.arange(256), np.arange(256))
    for raw in range(256):
        source = Source(signals=("M.s",), unknown=(float(f"{raw * scale - 40:.9g}"),))
        assert _known(samples, source).raw.tolist() == [n for n in range(256) if n != raw]


def test_a_float_is_unknown_at_its_value_alone():
    signal = Signal("s", 0, 32, is_float=True)
    raw = np.array([-1.0, -0.75, 0.0, np.float32(-0.1)])
    source = Source(signals=("M.s",), unknown=(-1.0, -0.1))
    assert _known(Samples(signal, np.arange(4), raw), source).raw.tolist() == [-0.75, 0.0]
