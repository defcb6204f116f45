"""Inadequate names are replaced only by a more predictive curve, or if most error remains."""

import json

import numpy as np
import pytest

from slipbench.identification.mismatch import comparison, explain
from slipbench.identification.mismatch.fit.held_out import Veto
from slipbench.identification.mismatch.naming import search
from slipbench.identification.mismatch.reporting.verdict import as_json
from slipbench.plant.errors import PlantError
from tests.identification.mismatch.laws.explained import explained, names, reported
from tests.identification.mismatch.laws.spring import PERIOD, cubic, spring, swung

LIBRARY = ("cubic.deflection", "dead_zone.deflection", "asymmetry.deflection")
SMALL, LARGE = 0.05, 0.3
"""Cubes, 1/m^2: beside the lag the large one explains most of the error, the small one does not."""


def lagging(force):
    """A lag that the library here does not have: the cube is right, and does not suffice."""
    keep, y, out = np.exp(-PERIOD / 0.02), 0.0, np.empty_like(force)
    for k, u in enumerate(force):
        y = keep * y + (1.0 - keep) * u
        out[k] = y
    return out


@pytest.fixture(scope="module")
def rides():
    return {
        cube: [swung(seed, cubic(cube), felt=lagging, seconds=8.0) for seed in (1, 2, 3)]
        for cube in (SMALL, LARGE)
    }


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return spring(tmp_path_factory.mktemp("spring"))


@pytest.fixture
def prediction_diverges(monkeypatch):
    def diverges(*_):
        raise PlantError("it diverges", "here", "numbers", "none", "smaller steps")

    monkeypatch.setattr(explain, "predicted_gain", diverges)
    monkeypatch.setattr(comparison, "predicted_gain", diverges)


@pytest.fixture
def no_curve_stands(monkeypatch):
    monkeypatch.setattr(explain, "fit_curves_in_model", lambda *_: None)


def test_a_curve_that_predicts_better_takes_the_place_of_names(nominal, rides):
    found = explained(nominal, rides[SMALL][:2], rides[SMALL][2:], LIBRARY)
    assert found.unknown, reported(found)
    assert not found.effects
    (error,) = found.held_out
    assert error.improved < 0.5 * error.calibrated


@pytest.mark.usefixtures("no_curve_stands")
def test_names_stand_that_held_out_recordings_confirm_and_that_leave_less_than_they_explain(
    nominal, rides
):
    """Regression: they were withdrawn in favour of the re-calibrated file."""
    found = explained(nominal, rides[LARGE][:2], rides[LARGE][2:], LIBRARY)
    assert names(found) == ["cubic.deflection"], reported(found)
    assert found.remains is not None
    (error,) = found.held_out
    assert error.improved < 0.5 * error.calibrated


@pytest.mark.usefixtures("no_curve_stands", "prediction_diverges")
def test_names_that_cannot_be_simulated_with_the_trained_parameters_are_withdrawn(nominal, rides):
    found = explained(nominal, rides[LARGE][:2], rides[LARGE][2:], LIBRARY)
    assert found.complete
    assert found.unknown, reported(found)


@pytest.mark.usefixtures("prediction_diverges")
def test_a_curve_that_cannot_be_simulated_on_held_out_recordings_is_contradicted(nominal, rides):
    found = explained(nominal, rides[SMALL][:2], rides[SMALL][2:], LIBRARY)
    assert found.complete
    assert found.curve is None
    curves = [v for v in found.vetoes if v.name.startswith("free curve")]
    assert curves, reported(found)
    assert all(v.reason == "they cannot be simulated with it" for v in curves)
    (written,) = {
        v["gain"] for v in json.loads(as_json(found))["vetoes"] if v["name"] == curves[0].name
    }
    assert written is None


@pytest.mark.usefixtures("no_curve_stands")
def test_names_that_leave_more_than_they_explain_are_withdrawn(nominal, rides):
    found = explained(nominal, rides[SMALL][:2], rides[SMALL][2:], LIBRARY)
    assert found.unknown, reported(found)
    assert not found.effects


@pytest.mark.usefixtures("no_curve_stands")
def test_without_held_out_recordings_names_that_do_not_suffice_are_withdrawn(nominal, rides):
    found = explained(nominal, rides[LARGE][:2], (), LIBRARY)
    assert found.unknown, reported(found)
    assert not found.effects


def test_of_names_that_predict_worse_only_the_last_one_goes(nominal, monkeypatch):
    calls = []

    def loses_once(model, base, fit, most):
        calls.append([c.name for c in fit.candidates])
        lost = Veto(" + ".join(calls[-1]), -50.0, -most, "worse")
        return lost if len(calls) == 1 else None

    monkeypatch.setattr(search, "mispredicted", loses_once)
    rides = [swung(seed, cubic(LARGE), felt=lagging, seconds=8.0) for seed in (1, 2, 3)]
    found = explained(nominal, rides[:2], rides[2:], ("cubic.deflection", "lag.force"))
    first, second = calls
    assert len(first) == 2
    assert second == first[:-1]
    assert names(found) == second, reported(found)
    assert found.vetoes[-1].name == " + ".join(first)
