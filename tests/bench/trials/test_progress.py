"""The progress of a live trial moves with its phases and never goes back."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.bench.trials.progress import script_duration, script_time
from slipbench.protocol.codec.messages import Phase
from tests.bench.trials.test_whole_trial import prepared

ORDER = [Phase.IDLE, Phase.ARMED, Phase.EXCITING, Phase.SETTLING, Phase.HANDING_BACK, Phase.DONE]


@pytest.fixture(scope="module")
def trial():
    return prepared().trial


@given(st.lists(st.floats(0, 1e4), min_size=len(ORDER), max_size=len(ORDER)))
@settings(deadline=None)
def test_it_grows_from_0_to_the_end_however_long_each_phase_lasts(trial, durations):
    shown = [
        script_time(trial, phase, part * elapsed)
        for phase, elapsed in zip(ORDER, durations, strict=True)
        for part in (0.0, 0.5, 1.0)
    ]
    assert shown == sorted(shown)
    assert shown[0] == 0.0
    assert shown[-1] == script_duration(trial)


def test_during_the_excitation_it_moves_with_time(trial):
    at = [script_time(trial, Phase.EXCITING, elapsed) for elapsed in (0.0, 0.5, 1.0)]
    assert at[1] - at[0] == pytest.approx(0.5)
    assert at[2] - at[1] == pytest.approx(0.5)


def test_a_trip_shows_the_end(trial):
    assert script_time(trial, Phase.TRIPPED, 0.0) == script_duration(trial)
