"""Laws of a model whose parameters are smooth functions of speed."""

import numpy as np
import pytest

from slipbench.identification.models.scheduled import (
    NAMES,
    NoSchedule,
    ScheduledFit,
    Trial,
    fit_scheduled,
    leave_one_out,
)
from slipbench.identification.models.switched import Direction, SwitchedModel
from slipbench.identification.response.response import FrequencyResponse

SPEEDS = (40.0, 44.0, 48.0, 52.0, 56.0)
FREQUENCY = np.linspace(0.6, 12, 60)


def truth(speed) -> SwitchedModel:
    x = np.log(speed / 48.0)
    side = Direction(0.18 * np.exp(-1.1 * x), 4e-3, 0.0)
    pair = (2 * np.pi * 8.3 * np.exp(0.3 * x), 0.28 * np.exp(1.2 * x))
    return SwitchedModel(side, side, (pair, (80.0, 0.4)), 0.014)


def trial(speed, seed=0, noise=2e-3) -> Trial:
    rng = np.random.default_rng(seed + round(100 * speed))
    value, deviation = truth(speed).response(FREQUENCY), np.full(FREQUENCY.size, noise)
    error = rng.standard_normal((2, FREQUENCY.size)) @ np.eye(FREQUENCY.size) * noise / np.sqrt(2)
    return Trial(
        speed,
        FrequencyResponse(
            "throttle_command",
            "slip",
            FREQUENCY,
            value + error[0] + 1j * error[1],
            np.full(FREQUENCY.size, 0.99),
            deviation,
            1.96,
            "synthetic",
        ),
    )


@pytest.fixture(scope="module")
def trials():
    return [trial(speed) for speed in SPEEDS]


@pytest.fixture(scope="module")
def fit(trials) -> ScheduledFit:
    found = fit_scheduled(trials)
    assert isinstance(found, ScheduledFit)
    return found


@pytest.mark.parametrize("speed", [40.0, 46.0, 56.0])
def test_the_true_response_is_found_at_any_speed_between(fit, speed):
    told, true = (m.response(FREQUENCY) for m in (fit.at(speed), truth(speed)))
    assert np.abs(told - true).max() < 0.01 * np.abs(true).max()


def test_gain_resonance_and_damping_lie_in_their_intervals(fit):
    for name, at in (
        ("gain", lambda m: m.opening.gain),
        ("frequency 1", lambda m: m.resonances[0][0]),
        ("damping 1", lambda m: m.resonances[0][1]),
    ):
        for speed in SPEEDS:
            value, half = fit.parameter(name, speed)
            print(
                f"{name} at {speed:g} m/s: {value:.4g} +- {half:.2g}, true {at(truth(speed)):.4g}"
            )
            assert abs(value - at(truth(speed))) < 1.6 * half


def test_only_noise_is_left(fit):
    assert 0.5 < fit.chi_square_ratio < 1.5


def test_intervals_shrink_with_the_noise(fit):
    quiet = fit_scheduled([trial(speed, noise=5e-4) for speed in SPEEDS])
    assert isinstance(quiet, ScheduledFit)
    assert quiet.parameter("gain", 48.0)[1] < fit.parameter("gain", 48.0)[1]


def test_beyond_the_trials_nothing_is_extrapolated(fit):
    assert fit.at(200.0) == fit.at(max(SPEEDS))
    assert fit.at(1.0) == fit.at(min(SPEEDS))


def test_a_speed_left_out_is_foretold_better_than_by_one_model_for_all(trials):
    rows = leave_one_out(trials)
    assert not isinstance(rows, NoSchedule)
    assert [row.speed for row in rows] == [44.0, 48.0, 52.0]
    for row in rows:
        assert row.scheduled < 0.03
        assert row.scheduled < row.constant or row.speed == 48.0


def test_two_speeds_are_refused(trials):
    assert isinstance(fit_scheduled(trials[:2]), NoSchedule)
    assert isinstance(leave_one_out(trials[:3]), NoSchedule)


def test_an_unbelieved_response_is_refused_by_its_speed(trials):
    lost = FrequencyResponse(
        "throttle_command",
        "slip",
        FREQUENCY,
        trials[0].response.value,
        np.full(FREQUENCY.size, 0.1),
        trials[0].response.deviation,
        1.96,
        "noise",
    )
    found = fit_scheduled([*trials[1:], Trial(40.0, lost)])
    assert isinstance(found, NoSchedule)
    assert "40.0 m/s" in found.reason


def test_names_are_those_of_the_parameters(fit):
    assert all(np.isfinite(fit.parameter(name, 48.0)).all() for name in NAMES)
