"""One case: a plant, its hidden effect, three recordings, and the verdict of `explain`."""

import time
from dataclasses import dataclass

import numpy as np

from benchmarks.model_files.hidden import Hidden, hidden, same_for_recordings
from benchmarks.model_files.simulated import drawn, nominal, recorded
from benchmarks.model_files.systems import PLANTS, Plant
from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.verdict import Verdict
from slipbench.plant.errors import PlantError
from slipbench.protocol.recording.recording import Recording

TRAINING = 2


@dataclass(frozen=True)
class Outcome:
    """hidden: its name. nats: its gain for an observer who knows it. named: effects of the verdict.

    right: the one name is true, or listed as equal to the true one. inside, intervals: how many of the
    parameters of what was named right lie in their 95 % intervals, and how many there are. seconds: of
    processor time.
    """

    number: int
    plant: str
    hidden: str
    outside: bool
    nats: float
    alarm: bool
    named: tuple[str, ...]
    right: bool
    inside: int
    intervals: int
    seconds: float


def outcome(seed: int, number: int) -> Outcome:
    """Draw a case, simulate it and analyse it."""
    rng = np.random.default_rng((seed, number))
    plant = PLANTS[number % len(PLANTS)]
    secret, runs = _recordings(plant, rng)
    system = nominal(plant)
    begun = time.process_time()
    records = [system.prepare(run) for run in runs]
    found = verdict(analyse(begin(system, records[:TRAINING], records[TRAINING:])))
    took = time.process_time() - begun
    names = tuple(f"{e.name}.{e.subject}" if e.subject else e.name for e in found.effects)
    right = same_for_recordings(names, found.equivalents, secret.name)
    inside, count = _intervals(found, secret) if names == (secret.name,) else (0, 0)
    return Outcome(
        number,
        plant.name,
        secret.name,
        secret.outside,
        secret.nats,
        found.mismatch,
        names,
        right,
        inside,
        count,
        took,
    )


def _recordings(plant: Plant, rng: np.random.Generator) -> tuple[Hidden, list[Recording]]:
    """Draw the hidden effect until all recordings can be simulated with it."""
    true = drawn(plant, rng)
    while True:
        secret = hidden(true, plant, rng)
        effects = () if secret.effect is None else (secret.effect,)
        try:
            runs = [recorded(true, plant, effects, rng, f"run{k}") for k in range(TRAINING + 1)]
        except PlantError:
            continue
        return secret, runs


def _intervals(found: Verdict, secret: Hidden) -> tuple[int, int]:
    """Count the parameters whose intervals hold the truth, and all that have an interval."""
    assert secret.effect is not None
    named = zip(secret.effect.parameters(), secret.effect.values(), strict=True)
    truths = {known.name: float(value) for known, value in named}
    intervals = [p for p in found.effects[0].parameters if p.name in truths and p.low < p.high]
    return sum(p.low <= truths[p.name] <= p.high for p in intervals), len(intervals)
