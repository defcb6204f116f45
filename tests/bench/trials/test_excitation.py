"""Laws of the waveforms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.bench.trials.excitation import plan_excitation
from slipbench.protocol.errors import InputError
from slipbench.protocol.waveforms import linear_sweep, logarithmic_sweep, odd_multisine
from tests.bench.conditions import trial_file

WAVEFORMS = {
    "linear_sweep": {"start": "0.5 Hz", "stop": "5 Hz"},
    "logarithmic_sweep": {"start": "0.5 Hz", "stop": "5 Hz"},
    "square": {"frequency": "1 Hz"},
    "multisine": {"lowest": "0.5 Hz", "highest": "5 Hz", "period": "2 s"},
}


def excitation(waveform, **changes):
    spec = {
        "actuator": "throttle",
        "amplitude": "4 %",
        "duration": "6 s",
        "waveform": waveform,
        **WAVEFORMS[waveform],
        **changes,
    }
    return plan_excitation(trial_file(excitation=spec))


@pytest.mark.parametrize("waveform", WAVEFORMS)
def test_every_waveform_starts_and_ends_at_rest_and_moves_within_the_rate(waveform):
    made = excitation(waveform)
    steps = np.diff(made.table, prepend=0.0, append=0.0)
    assert np.max(np.abs(steps)) <= 6.0 * made.period * (1 + 1e-9)
    assert made.value(-0.001) == made.value(made.duration) == 0.0


@pytest.mark.parametrize("waveform", WAVEFORMS)
def test_every_waveform_reaches_its_amplitude_and_not_more(waveform):
    assert np.max(np.abs(excitation(waveform).table)) == pytest.approx(0.04, rel=2e-3)


@pytest.mark.parametrize("waveform", WAVEFORMS)
def test_the_same_trial_gives_the_same_waveform(waveform):
    assert np.array_equal(excitation(waveform).table, excitation(waveform).table)


@pytest.mark.parametrize("sweep", [linear_sweep, logarithmic_sweep])
@given(start=st.floats(0.1, 3), ratio=st.floats(1.0, 20), duration=st.floats(2, 30))
@settings(max_examples=30, deadline=None)
def test_a_sweep_runs_from_its_first_frequency_to_its_last(sweep, start, ratio, duration):
    stop, h = start * ratio, 1e-6
    for at, frequency in ((0.0, start), (duration, stop)):
        around = np.array([at - h, at, at + h])
        value = sweep(around, start, stop, duration)
        slope = (value[2] - value[0]) / (2 * h)
        assert slope**2 == pytest.approx(
            (2 * np.pi * frequency) ** 2 * (1 - value[1] ** 2), rel=1e-3, abs=1e-3
        )


@given(seed=st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_a_multisine_has_only_odd_harmonics_inside_its_band(seed):
    time = np.arange(0, 4.0, 0.001)
    wave = odd_multisine(time, 2.0, 1.0, 10.0, seed)
    lines = np.abs(np.fft.rfft(wave)) / time.size
    harmonic = np.arange(lines.size) / 2  # two periods are analysed
    inside = (harmonic % 2 == 1) & (harmonic >= 2) & (harmonic <= 20)
    assert np.all(lines[inside] > 1e-3)
    assert np.max(lines[~inside]) < 1e-12


@given(seed=st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_with_detection_one_odd_line_of_every_four_stays_free(seed):
    time = np.arange(0, 4.0, 0.001)
    wave = odd_multisine(time, 2.0, 1.0, 10.0, seed, detection=True)
    lines = np.abs(np.fft.rfft(wave)) / time.size
    odd = lines[2 * np.arange(3, 20, 2)]  # 9 odd harmonics: two groups of four and one more
    free = odd < 1e-12
    assert free[:4].sum() == free[4:8].sum() == 1
    assert not free[8]
    assert np.max(lines[2 * np.arange(0, 21, 2)]) < 1e-12


@given(seed=st.integers(0, 1_000))
@settings(max_examples=25, deadline=None)
def test_a_multisine_never_exceeds_its_amplitude(seed):
    """Not even between the points at which its peak was sought: the bench would trip."""
    wave = odd_multisine(np.arange(0, 4.0, 0.001), 4.0, 0.5, 12.0, seed)
    assert np.max(np.abs(wave)) <= 1.0


def test_whole_periods_are_played_to_their_end():
    made = excitation("multisine", duration="6 s")
    periods = made.table.reshape(3, -1)
    assert np.allclose(periods[0], periods[2], atol=1e-9)


def test_different_seeds_give_different_phases():
    time = np.arange(0, 2.0, 0.001)
    assert not np.allclose(odd_multisine(time, 2.0, 1, 10, 1), odd_multisine(time, 2.0, 1, 10, 2))


def test_a_square_wave_opens_as_long_as_it_closes():
    table = excitation("square", duration="6 s").table
    assert abs(float(np.mean(table))) < 2e-4


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"excitation__stop": "60 Hz"}, "more than the command rate carries"),
        ({"excitation__stop": "6 Hz", "command__period": "10 ms"}, "shorten command.period"),
        ({"excitation__amplitude": "7 %"}, "limits.throttle_deviation"),
        ({"excitation__amplitude": "0 %"}, "limits.throttle_deviation"),
        ({"limits__throttle_rate": "50 %/s"}, "faster than the trial's rate limit"),
        ({"excitation__actuator": "spark", "excitation__amplitude": "5 deg"}, "limits.spark"),
    ],
)
def test_what_the_bench_cannot_carry_is_refused_with_the_remedy(changes, words):
    with pytest.raises(InputError, match=words):
        plan_excitation(trial_file(**changes))
