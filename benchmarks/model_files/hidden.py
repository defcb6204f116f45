"""Hidden part of a case: nothing, an effect of the library, or a curve outside the library."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.model_files.simulated import outputs_of
from benchmarks.model_files.systems import Plant
from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.identification.mismatch.systems.model_file import Number
from slipbench.identification.mismatch.systems.placing import Read, library, places
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.identification.mismatch.systems.table_curve import TableCurve, known_quantities
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

WITHIN, OUTSIDE = 0.45, 0.15
"""Shares of the cases with an effect of the library, and with a curve outside of it."""
SHARES = (0.1, 2.0)
"""Of the typical size of an effect."""
VISIBLE = (50.0, 20_000.0)
"""Log-likelihood gain of the known hidden effect, parameters and first values fitted, nats."""
LARGEST = 1.0
"""Of the standard deviation of an output: hidden effects change none by more."""
DIFFERENCE_STEP = 0.05
TRIES = 200
KNOTS = 9
WAVES = (1.0, 2.5)
"""Periods of a curve over its regressor."""
HEIGHT = (0.02, 0.2)
"""Of the usual magnitude of the place."""


@dataclass(frozen=True)
class Hidden:
    """effect: None: nothing is hidden. outside: whether the library lacks it. nats: its gain."""

    effect: Effect | None
    outside: bool = False
    nats: float = 0.0

    @property
    def name(self) -> str:
        """Name as in a verdict."""
        if self.effect is None:
            return "nothing"
        if isinstance(self.effect, TableCurve):
            return f"a curve at {self.effect.place} along {self.effect.along}"
        return self.effect.key


def hidden(system: ModelSystem, plant: Plant, rng: np.random.Generator) -> Hidden:
    """Draw the hidden effect. system: the true one."""
    share = rng.random()
    if share > WITHIN + OUTSIDE:
        return Hidden(None)
    inputs = {k: d.drawn(rng, plant.count, plant.period) for k, d in plant.inputs.items()}
    plain = outputs_of(system, plant, inputs)
    slopes = _slopes(system, plant, inputs, plain)
    for _ in range(TRIES):
        outside = share > WITHIN
        effect = _curve(system, plant, inputs, rng) if outside else _effect(system, rng)
        try:
            shown = outputs_of(system, plant, inputs, (effect,))
        except PlantError:
            continue
        if any(np.ptp(shown[k] - plain[k]) > LARGEST * np.ptp(plain[k]) for k in plain):
            continue
        nats = _nats(_whitened(plant, shown, plain), slopes)
        if VISIBLE[0] < nats < VISIBLE[1]:
            return Hidden(effect, outside, nats)
    return Hidden(None)


def _effect(system: ModelSystem, rng: np.random.Generator) -> SeamEffect:
    """Draw an effect of the library: place, size and shape."""
    kinds = library(system.read or Read(system.file))
    kind = kinds[rng.integers(len(kinds))]
    values = {}
    for known, typical in zip(kind.parameters(), kind().values(), strict=True):
        share = float(np.exp(rng.uniform(*np.log(SHARES)))) if known.sized else 1.0
        absent = known.absent if known.sized and np.isfinite(known.absent) else 0.0
        size = absent + share * (typical - absent)
        values[known.name] = float(np.clip(size, known.low, known.high))
    return kind(**values)


def _curve(
    system: ModelSystem, plant: Plant, inputs: dict[str, Floats], rng: np.random.Generator
) -> TableCurve:
    """Draw a wave along a state or an input, at a seam, an input or an output."""
    file = system.file
    there = [p for p in places(file) if p.kind in ("seam", "input", "output")]
    place = there[rng.integers(len(there))]
    moving = {**file.inputs, **file.states}
    known = known_quantities(place.name, system.equations, file)
    names = [n for n in moving if n in known and n != place.name]
    along = names[rng.integers(len(names))] if names else place.name
    reach = 1.5 * abs(moving[along].size.si) if along in moving else place.size
    knots = np.linspace(-reach, reach, KNOTS)
    wave = np.sin(np.pi * rng.uniform(*WAVES) * knots / reach + rng.uniform(0.0, 2.0 * np.pi))
    heights = rng.uniform(*HEIGHT) * place.size * wave
    return TableCurve(place.name, along, tuple(map(float, knots)), tuple(map(float, heights)))


def _slopes(
    system: ModelSystem, plant: Plant, inputs: dict[str, Floats], plain: dict[str, Floats]
) -> Floats:
    """Return what each number and each first value of a state changes, whitened, (samples, all)."""
    others = [*_other_numbers(system), *_other_starts(system)]
    shown = [outputs_of(other, plant, inputs) for other in others]
    return np.column_stack([_whitened(plant, one, plain) for one in shown])


def _other_numbers(system: ModelSystem) -> Iterator[ModelSystem]:
    for k, value in enumerate(system.values):
        values = system.values.copy()
        values[k] = value * (1.0 + DIFFERENCE_STEP)
        yield replace(system, values=values)


def _other_starts(system: ModelSystem) -> Iterator[ModelSystem]:
    for name, state in system.file.states.items():
        if not isinstance(state.start, str):
            start = Number(
                value=state.start.si + DIFFERENCE_STEP * state.size.si, unit=state.size.si_unit
            )
            states = {**system.file.states, name: state.model_copy(update={"start": start})}
            yield replace(system, file=system.file.model_copy(update={"states": states}))


def _whitened(plant: Plant, one: dict[str, Floats], other: dict[str, Floats]) -> Floats:
    return np.concatenate([(one[k] - other[k]) / plant.outputs[k][1] for k in plant.outputs])


def _nats(change: Floats, slopes: Floats) -> float:
    """Return half the square of what calibration leaves of a change."""
    taken, *_ = np.linalg.lstsq(slopes, change, rcond=None)
    return 0.5 * float(np.sum((change - slopes @ taken) ** 2))


def same_for_recordings(names: Sequence[str], ties: Sequence[Sequence[str]], truth: str) -> bool:
    """Return whether the one given name is the truth or is listed as indistinguishable from it."""
    if list(names) == [truth]:
        return True
    return len(names) == 1 and any(truth in tie and names[0] in tie for tie in ties)
