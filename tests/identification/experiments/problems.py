"""Design problems for tests: a vehicle as calibrated, with the noise of recordings of it."""

from dataclasses import replace
from functools import cache

import numpy as np

from slipbench.identification.experiments.bounds import Bounds
from slipbench.identification.experiments.hypothesis import hypotheses_of
from slipbench.identification.experiments.search import Problem
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.sensitivity import none
from slipbench.identification.mismatch.simulation.model import models, predict
from slipbench.plant.vehicle_file import Vehicle
from slipbench.protocol.configuration import load_toml, parse
from slipbench.protocol.trial_file import Limits, TrialFile
from tests.identification.mismatch.conditions import erring, nominal, system
from tests.identification.motorcycle_recording import Ride, ride
from tests.paths import TRIALS

RECORDED = (Ride("sweep", 2, 1200.0, 0.03, 0.5, 12.0, seconds=8.0, seed=51),)
WIDE = {
    "engine_speed": ["8500 rpm", "13500 rpm"],
    "speed": ["30 m/s", "58 m/s"],
    "throttle": ["0.5 %", "40 %"],
}


@cache
def recorded() -> Fit:
    """The nominal vehicle with the noise of recordings of a motorcycle like it."""
    records = [system().prepare(ride(erring(3), trial)) for trial in RECORDED]
    (model,) = models(system(), records)
    noise = calibrate(model, model.origin()).noise
    return Fit(
        model, model.origin(), predict(model, model.origin()), noise, none(model, model.origin())
    )


def limits(**changes: object) -> Limits:
    """Limits of the shipped throttle sweep, wide about the speed, with changes."""
    tree = load_toml(TRIALS / "throttle_sweep.toml")
    tree["limits"] = {**tree["limits"], **WIDE, **changes}
    return parse(tree, TrialFile, where="test").limits


def problem(*names: str, straight: float = 1200.0, known: Fit | None = None, **changes) -> Problem:
    """Problem that tells these hypotheses apart. changes: of the limits."""
    asked = hypotheses_of(names, system().library, "test")
    bounds = Bounds(limits(**changes), straight)
    return Problem(known or recorded(), (asked,), bounds, ("throttle",))


def another_motorcycle(seed: int) -> Fit:
    """The problem's vehicle with other numbers, as if it had been calibrated so."""
    known = recorded()
    rng = np.random.default_rng(seed)
    gears = tuple(float(g * rng.uniform(0.85, 1.15)) for g in nominal().motorcycle.gears)
    bike = replace(erring(seed, 1.0), gears=gears)
    vehicle: Vehicle = replace(nominal(), motorcycle=bike)
    (model,) = models(replace(system(), vehicle=vehicle), known.model.records)
    origin = model.origin()
    return Fit(model, origin, known.predicted, known.noise, none(model, origin))
