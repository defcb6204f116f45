"""Vehicles with parameter errors of several per cent, and analyses on which laws are tested."""

from dataclasses import replace
from functools import cache

import numpy as np

from slipbench.identification.mismatch.analysis import Analysis, begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.verdict import Verdict
from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.library import BY_NAME
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.vehicle_file import Vehicle, load_vehicle
from slipbench.plant.vehicles import builtin_vehicle
from tests.identification.motorcycle_recording import HELD_OUT, TRAINING, ride

FEW = (
    "rate_limit",
    "asymmetric_filling",
    "backlash",
    "hardening_cush",
    "driveline_loss",
    "relaxation_length",
    "tooth_misplacement",
    "eccentricity",
    "optical_lag",
)
"""Effects with which the laws are tested; the full library takes a minute per analysis."""


@cache
def nominal() -> Vehicle:
    return load_vehicle(builtin_vehicle("nominal"))


def system() -> MotorcycleSystem:
    return MotorcycleSystem(nominal())


def erring(seed: int, share: float = 0.6) -> Motorcycle:
    """The nominal motorcycle with every parameter off by a share of its prior deviation."""
    rng, vehicle = np.random.default_rng(seed), nominal()
    blocks = {}
    for name, block in vehicle.motorcycle.blocks():
        changed = {}
        for p in block.parameters():
            if half_width := vehicle.plus_minus.get(f"{name}.{p.name}"):
                value = getattr(block, p.name)
                factor = np.exp(share * rng.standard_normal() * half_width / (1.96 * value))
                changed[p.name] = float(np.clip(value * factor, p.low, p.high))
        blocks[name] = replace(block, **changed)
    return replace(vehicle.motorcycle, **blocks)


def analysis(
    effects: tuple[Effect, ...] = (),
    seed: int = 1,
    without: tuple[str, ...] = (),
    drop: tuple[str, ...] = (),
    training=TRAINING,
    held_out=HELD_OUT,
) -> Analysis:
    """Ride, record and analyse. without: names taken out of the library; drop: channels."""
    print(f"seed {seed}")
    true = replace(erring(seed), effects=effects)
    records = [
        [
            system().prepare(ride(true, replace(t, seed=t.seed + 100 * seed, drop=drop)))
            for t in trials
        ]
        for trials in (training, held_out)
    ]
    library = [BY_NAME[name] for name in FEW if name not in without]
    return analyse(begin(system(), *records), library)


def found(*args, **kwargs) -> Verdict:
    return verdict(analysis(*args, **kwargs))
