"""Laws of the predictive density: it is a density, and under it the true hypothesis stands."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from slipbench.identification.experiments import prediction
from slipbench.identification.experiments.hypothesis import NOTHING, hypotheses_of
from slipbench.identification.experiments.prediction import FREEDOM, log_t_density, run_evidence
from slipbench.identification.experiments.sequential_test import rejected, standing
from slipbench.identification.mismatch.fit.calibrate import calibrate, far_from_prior
from slipbench.identification.mismatch.simulation.model import models
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.plant.vehicles import DEMONSTRATION
from tests.identification.experiments.problems import recorded
from tests.identification.mismatch.conditions import erring, system
from tests.identification.motorcycle_recording import Ride, ride

SEED = 71
RECORDED = Ride("sweep", 2, 1300.0, 0.03, 0.5, 12.0, seconds=6.0)
DESIGNED = (
    Ride("square", 2, 1200.0, 0.03, 0.8, seconds=5.0),
    Ride("sweep", 2, 1350.0, 0.03, 0.5, 12.0, seconds=5.0),
)


@pytest.mark.parametrize("columns", [0, 1, 3])
def test_the_density_is_that_of_a_multivariate_t(columns):
    rng = np.random.default_rng(SEED)
    values, mean = rng.standard_normal((2, 5))
    spread = rng.standard_normal((5, columns))
    shape = np.eye(5) + spread @ spread.T
    wanted = stats.multivariate_t(mean, shape, df=FREEDOM).logpdf(values)
    assert log_t_density(values, mean, spread) == pytest.approx(wanted, rel=1e-9)


def evidence(names: tuple[str, ...], truth: str, seed: int):
    """Evidence of two designed runs of a motorcycle that errs as the vehicle file states."""
    print(f"seed {seed}")
    question = hypotheses_of(names, system().library, "test")
    true = erring(seed, 1.0)
    if truth != NOTHING:
        (one,) = (h.candidate for h in question if h.name == truth)
        assert one is not None
        true = replace(true, effects=(one.effect(),))
    trials = [replace(t, seed=100 * seed + n) for n, t in enumerate((RECORDED, *DESIGNED))]
    records = [system().prepare(ride(true, trial)) for trial in trials]
    return [
        run_evidence(system(), records[:n], records[n], [question])[0]
        for n in range(1, len(records))
    ]


def test_a_hypothesis_that_cannot_be_simulated_is_not_refuted_by_that(monkeypatch):
    monkeypatch.setattr(prediction, "_learnt", lambda _, h, *__: None)
    monkeypatch.setattr(prediction, "calibrate", lambda *_: fit)
    fit = recorded()
    question = hypotheses_of((NOTHING, "backlash"), system().library, "test")
    record = fit.model.records[0]
    (found,) = run_evidence(system(), [record], record, [question])
    assert set(found.log_density.values()) == {0.0}
    assert found.power == 0.0


@pytest.mark.parametrize("truth", [NOTHING, "backlash"])
def test_the_true_hypothesis_stands_at_every_look_and_the_other_is_rejected(truth):
    """Between effects: laws/slow/test_designed_evidence.py."""
    names = (NOTHING, "backlash")
    runs = evidence(names, truth, SEED)
    assert truth not in rejected(names, runs)
    assert standing(names, runs) == (truth,)


def test_what_calibration_made_up_for_stands_where_a_new_run_shows_it() -> None:
    """The numbers without a backlash end far from the file, and keep it away from the earlier run."""
    true = load_vehicle(DEMONSTRATION).motorcycle
    true = replace(true, effects=tuple(e for e in true.effects if e.key == "backlash"))
    rides = [
        Ride("sweep", 2, 1204.0, 0.0217, 0.5, 12.0, seconds=8.0, seed=5),
        Ride("sweep", 2, 1204.0, 0.0217, 0.5, 12.0, seconds=8.0, seed=7),
        Ride("sweep", 2, 1170.0, 0.0243, 1.12, 9.33, seconds=6.0, seed=9),
    ]
    records = [system().prepare(ride(true, r)) for r in rides]
    question = hypotheses_of((NOTHING, "backlash"), system().library, "test")
    (earlier,) = models(system(), records[:2])
    assert far_from_prior(calibrate(earlier, earlier.origin()))
    (found,) = run_evidence(system(), records[:2], records[2], [question])
    assert standing((NOTHING, "backlash"), [found]) == ("backlash",)
