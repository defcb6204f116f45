"""A headline tile shows what is known; what is not known stands in the tables with its interval."""

from types import SimpleNamespace

import numpy as np
import pytest

from slipbench.identification.models.delay_profile import DelayProfile
from slipbench.identification.report.tiles import _model_tiles

MS = 1e-3


def study(delay, low, high):
    grid = np.linspace(low, high, 3)
    profile = DelayProfile(grid, (), grid, delay, low, high, None)
    model = SimpleNamespace(delay=profile, response=SimpleNamespace(input="throttle_position"))
    return SimpleNamespace(models=(model,))


@pytest.mark.parametrize(
    ("low", "high"), [(0.0, 12.3), (-1.0, 12.3), (0.1, 30.0), (4.0, 17.0), (np.nan, 12.3)]
)
def test_a_dead_time_that_is_not_known_is_no_headline(low, high):
    assert not _model_tiles(study(11.9 * MS, low * MS, high * MS))


@pytest.mark.parametrize(("low", "high"), [(11.2, 12.3), (8.0, 17.0)])
def test_a_known_dead_time_is_shown_with_its_interval(low, high):
    (tile,) = _model_tiles(study(11.9 * MS, low * MS, high * MS))
    assert tile.value == "11.9 ms"
    assert f"95 % interval {low:.1f} to {high:.1f} ms" in tile.note
