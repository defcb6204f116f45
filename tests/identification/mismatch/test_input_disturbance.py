"""Input disturbances: they superpose, act in their subsystem, and are recovered by a fit."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.injection import places
from slipbench.identification.mismatch.curves.input_spline import InputSpline
from slipbench.identification.mismatch.curves.model_spline import injection_of
from slipbench.identification.mismatch.curves.trace import regressors, sensors_as_places
from slipbench.identification.mismatch.fit.calibrate import start_fit
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.fit.refit import relinearized
from slipbench.identification.mismatch.simulation.injection_point import at_sensor
from slipbench.identification.mismatch.simulation.input_disturbance import InputDisturbance
from slipbench.identification.mismatch.simulation.model import predict, simulate
from slipbench.identification.mismatch.simulation.regressor import (
    HYSTERESIS,
    PAST,
    SCALE,
    kind_of,
    knots_for,
)
from tests.identification.mismatch.test_small import started

KNOWN = (f"{PAST}throttle", f"{HYSTERESIS}twist", f"{SCALE}tyre force along speed", "throttle rate")

FELT = {"servo": "throttle", "motion": "rear_speed"}


@cache
def fitted() -> Fit:
    model = started().training.coarse
    return start_fit(model, model.origin())


def spline_at(
    regressor: str, place_name: str, size: float, beside: Fit | None = None
) -> InputSpline:
    """A curve with values of alternating sign."""
    fit = beside or fitted()
    place = next(p for p in places(fit) if p.name == place_name)
    z = regressors(fit, place.subsystem, 0)[regressor]
    knots = knots_for(regressor, z[0] if kind_of(regressor) == SCALE else z)
    return InputSpline.beside(fit, place, regressor, knots).moved(
        size * np.cos(2.0 * np.arange(knots.size))
    )


@pytest.mark.parametrize("regressor", KNOWN)
def test_a_push_at_the_point_is_a_push_injected_into_the_model(regressor):
    fit = fitted()
    disturbance = spline_at(regressor, "engine torque", 0.3).effect()
    at_point = with_effects(fit, (spline_at(regressor, "engine torque", 0.3),))
    injected = replace(fit.model, injected=disturbance.waveforms)
    for ones, others in zip(at_point.predicted, predict(injected, fit.point), strict=True):
        for one, other in zip(ones, others, strict=True):
            assert one == pytest.approx(other)


def test_a_push_is_felt_when_it_acts_and_not_before():
    """Commands are late in the servo and at the spark; input disturbances there are not."""
    fit = fitted()
    record = fit.model.records[0]
    row = 3000
    for place in places(fit):
        waveform = np.zeros(record.grid.rows)
        waveform[row:] = place.size
        extra = fit.model.at(fit.point).input_disturbance(place, record, waveform)
        disturbed, plain = (
            simulate(fit.model, fit.point, 0, place.subsystem, e) for e in (extra, {})
        )
        moved = np.abs(disturbed[FELT[place.subsystem]] - plain[FELT[place.subsystem]])
        assert not moved[: row - 1].any(), place.name
        assert np.all(moved[row + 2 : row + 6] > 0.0), place.name


def test_pushes_act_in_their_drive_alone_and_are_not_each_other():
    fit = fitted()
    one = spline_at("throttle rate", "engine torque", 0.1).effect()
    same = InputDisturbance(one.subsystem, one.waveforms)
    assert one != same
    assert fit.model.subsystems_changed_by(one) == ("motion",)
    there = predict(fit.model, replace(fit.point, effects=(one,)))
    for block, before, after in zip(fit.model.partition.groups, fit.predicted, there, strict=True):
        moved = max(float(np.abs(a - b).max()) for a, b in zip(before, after, strict=True))
        assert (moved > 1e-6) == (
            block.subsystem == "motion" and block.order > 0
        ) or not block.order


def test_two_pushes_of_half_are_one():
    fit = fitted()
    full = spline_at("throttle rate", "driveline torque", 0.2)
    half = spline_at("throttle rate", "driveline torque", 0.1).effect()
    twice = replace(fit.point, effects=(half, InputDisturbance(half.subsystem, half.waveforms)))
    for ones, others in zip(
        predict(fit.model, twice), with_effects(fit, (full,)).predicted, strict=True
    ):
        for one, other in zip(ones, others, strict=True):
            assert one == pytest.approx(other)


@pytest.mark.parametrize("regressor", KNOWN)
def test_most_of_what_was_pushed_is_found_from_nothing(regressor):
    """The recording is a simulation with input disturbances; sensitivities are updated once."""
    fit = fitted()
    truth = with_effects(fit, (spline_at(regressor, "engine torque", 1.0),))
    model = replace(fit.model)
    model.__dict__["measured"] = [
        [m + (s - p) for m, s, p in zip(ms, ss, ps, strict=True)]
        for ms, ss, ps in zip(fit.model.measured, truth.predicted, fit.predicted, strict=True)
    ]
    model.__dict__["coarse"] = model
    start = replace(fit, model=model, candidates=())
    bare = optimize(start)
    found, known = (
        _settled(with_effects(start, (spline_at(regressor, "engine torque", size, start),))).score
        - bare.score
        for size in (0.0, 1.0)
    )
    assert known > 20.0
    assert found > 0.8 * known


def _settled(fit: Fit) -> Fit:
    """Optimize as for free curves: sensitivities at zero, from binned inputs, are approximate."""
    return optimize(relinearized(optimize(fit)))


def sensor_error(output: str, fit: Fit) -> tuple[InputSpline, np.ndarray]:
    """A curve along the time at a sensor, and what it adds to each bin of the first record."""
    place = next(p for p in sensors_as_places(fit) if p.name == at_sensor(output))
    z = regressors(fit, place.subsystem, 0)["time"]
    knots = knots_for("time", z)
    spline = InputSpline.beside(fit, place, "time", knots).moved(
        np.cos(2.0 * np.arange(knots.size))
    )
    return spline, fit.model.records[0].grid.binned(np.interp(z, knots, spline.values))


def test_an_error_of_a_sensor_is_in_its_output_alone():
    fit = fitted()
    spline, error = sensor_error("optical_speed", fit)
    there = with_effects(fit, (spline,)).predicted
    for block, before, after in zip(fit.model.partition.groups, fit.predicted, there, strict=True):
        for j, output in enumerate(block.outputs):
            change = after[0][:, j] - before[0][:, j]
            expected = error if output == "optical_speed" else 0.0
            assert change == pytest.approx(expected, abs=1e-9), output


def test_a_curve_acts_at_a_sensor_unless_its_recording_drives_a_simulation():
    """The motion is driven by the recorded opening: an error of that sensor would act there too."""
    fit = fitted()
    at_place = Curve("", "", "m/s", "time", np.arange(3.0), np.zeros(3), 20.0, 10.0, 1e-3)
    for output, possible in (("optical_speed", True), ("throttle_position", False)):
        assert bool(injection_of(fit, replace(at_place, place=at_sensor(output)))) == possible
