"""Comparison of runs: pooled response, differences against their intervals, models on each other's data.

compared = compare([(found, study), ...])
compared.pooled, [row.words for row in compared.differences], compared.parameters
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from slipbench.identification.models.delay_profile import DelayProfile
from slipbench.identification.models.rational_ml import ACROSS, Mode
from slipbench.identification.models.recommended import Recommended
from slipbench.identification.models.roots import oscillating, real_poles
from slipbench.identification.models.study import Study
from slipbench.identification.models.validation import Validation, validated_on
from slipbench.identification.report.run_verdict import RunVerdict
from slipbench.identification.report.words import p_value, time_unit
from slipbench.identification.response.identify import Identification
from slipbench.identification.response.resonance import Resonance
from slipbench.identification.response.response import FrequencyResponse
from slipbench.identification.session.pooled import pooled
from slipbench.identification.session.repeatability import Repeatability, repeatability
from slipbench.identification.session.run_verdict import run_verdict
from slipbench.protocol.errors import InputError

LEVEL = 0.05  # family-wise probability under which runs differ


@dataclass(frozen=True)
class ComparedRun:
    """A run with its verdict. response: the one compared, None where it has none like the others."""

    name: str
    verdict: RunVerdict
    found: Identification
    study: Study
    response: FrequencyResponse | None


@dataclass(frozen=True)
class Difference:
    """A run against the pooled response of the other runs.

    adjusted: probability of such a distance by noise alone, corrected for the number of runs (Holm)
    others: number of the other runs
    """

    run: str
    found: Repeatability
    adjusted: float
    others: int

    @property
    def significant(self) -> bool:
        """Whether the run differs from the others at a family-wise level of 5 %."""
        return self.adjusted < LEVEL

    @property
    def words(self) -> str:
        """Difference as a sentence."""
        f = self.found
        one = self.others == 1
        apart = f"differs from the other run{'' if one else 's'}"
        how = apart if self.significant else "does not differ significantly"
        by = "noise" if one else "noise and the scatter of the others"
        return (
            f"{self.run} {how}: distance {100 * f.distance:.1f} % of the gain, {100 * f.expected:.1f} %"
            f" expected from {by} ({p_value(self.adjusted)})."
        )


@dataclass(frozen=True)
class Parameter:
    """A parameter of the model in every run.

    unit      display unit; values, deviations: (runs,) in it, NaN where a run does not have it
    probability  of so different values by chance (chi-square test of homogeneity), adjusted (Holm)
    """

    name: str
    unit: str
    values: tuple[float, ...]
    deviations: tuple[float, ...]
    probability: float

    @property
    def words(self) -> str:
        """Result of the test."""
        if not np.isfinite(self.probability):
            return "too few runs have it"
        return f"{'differs' if self.probability < LEVEL else 'equal within intervals'} ({p_value(self.probability)})"


@dataclass(frozen=True)
class Comparison:
    """Runs side by side. validation: (model's run, data's run) -> NRMSE fit, %."""

    runs: tuple[ComparedRun, ...]
    pooled: FrequencyResponse
    differences: tuple[Difference, ...]
    parameters: tuple[Parameter, ...]
    validation: dict[tuple[str, str], Validation]

    @property
    def headline(self) -> str:
        """Main result in a sentence."""
        own = [one for one in self.runs if one.response is not None]
        apart = [d.run for d in self.differences if d.significant]
        if not self.differences:
            return f"{len(own)} runs have too few reliable frequencies in common to be compared."
        if not apart:
            return f"{len(own)} runs do not differ beyond their intervals."
        if len(own) == 2:
            return f"{own[0].name} and {own[1].name} differ beyond their intervals."
        verb = "differs" if len(apart) == 1 else "differ"
        return f"{', '.join(apart)} {verb} from the other runs beyond the intervals."


def compare(runs: Sequence[tuple[Identification, Study]]) -> Comparison:
    """Compare the main responses of runs. Raises InputError with fewer than two that have one."""
    names = _names([found for found, _ in runs])
    path = next(((f.main.input, f.main.output) for f, _ in runs if f.main is not None), None)
    made = tuple(
        ComparedRun(name, run_verdict(found, study), found, study, _like(found, path))
        for name, (found, study) in zip(names, runs, strict=True)
    )
    own = [one for one in made if one.response is not None]
    responses = [one.response for one in own if one.response is not None]
    if len(responses) < 2:
        raise InputError(
            "fewer than two runs have a frequency response of the same input and output",
            where=", ".join(names),
            found="; ".join(f"{one.name}: {one.verdict}" for one in made),
            remedy="name runs of the same actuator, or give --input and --output",
        )
    _check_units(own)
    try:
        together = pooled(responses)
    except ValueError as fault:
        raise InputError(
            "the runs cannot be pooled", where=", ".join(names), found=str(fault)
        ) from fault
    return Comparison(made, together, _differences(own, responses), _parameters(own), _across(own))


def _check_units(runs: Sequence[ComparedRun]) -> None:
    """Raise InputError where a signal is of another quantity in another run."""
    units = {one.name: one.response.si_units for one in runs if one.response is not None}
    if len(set(units.values())) > 1:
        raise InputError(
            "the signals have other units in other runs",
            where=", ".join(units),
            expected="input and output of the same quantities in every run",
            found="; ".join(f"{run}: {u} to {y}" for run, (u, y) in units.items()),
            remedy="name runs of the same machine",
        )


def _names(runs: Sequence[Identification]) -> list[str]:
    """Folder names, made distinct."""
    plain = [one.recording.folder.name for one in runs]
    return [name if plain.count(name) == 1 else f"{name} ({k + 1})" for k, name in enumerate(plain)]


def _like(found: Identification, path: tuple[str, str] | None) -> FrequencyResponse | None:
    return next((r for r in found.responses if (r.input, r.output) == path), None)


def _differences(
    own: list[ComparedRun], responses: list[FrequencyResponse]
) -> tuple[Difference, ...]:
    tests = []
    for k, one in enumerate(own[:1] if len(own) == 2 else own):
        others = pooled(responses[:k] + responses[k + 1 :])
        if (found := repeatability(responses[k], others)) is not None:
            tests.append((one.name, found))
    adjusted = holm([found.chance for _, found in tests])
    return tuple(
        Difference(n, f, p, len(own) - 1) for (n, f), p in zip(tests, adjusted, strict=True)
    )


def holm(probabilities: Sequence[float]) -> list[float]:
    """Probabilities adjusted for their number (S. Holm, Scand. J. Statistics 6 (1979) 65)."""
    order = np.argsort(probabilities)
    count = len(probabilities)
    stepped = [(count - k) * probabilities[at] for k, at in enumerate(order)]
    adjusted = np.minimum(np.maximum.accumulate(stepped), 1.0) if count else np.empty(0)
    made = np.empty(count)
    made[order] = adjusted
    return [float(p) for p in made]


def _parameters(own: list[ComparedRun]) -> tuple[Parameter, ...]:
    models = [_model(one) for one in own]
    factor, each = time_unit(
        max((d for d, _ in map(_delay, models) if np.isfinite(d)), default=0.0)
    )
    rows = {
        ("natural frequency", "Hz"): [
            _frequency(m, one) for m, one in zip(models, own, strict=True)
        ],
        ("damping ratio", "1"): [_damping(m, one) for m, one in zip(models, own, strict=True)],
        ("slowest real pole", "Hz"): [_real_pole(m) for m in models],
        ("dead time", each): [_delay(m, factor) for m in models],
    }
    rows = {key: values for key, values in rows.items() if any(np.isfinite(v) for v, _ in values)}
    chances = [_homogeneous(values) for values in rows.values()]
    known = [p for p in chances if np.isfinite(p)]
    adjusted = iter(holm(known))
    return tuple(
        Parameter(
            name,
            unit,
            tuple(v for v, _ in values),
            tuple(s for _, s in values),
            next(adjusted) if np.isfinite(p) else float("nan"),
        )
        for ((name, unit), values), p in zip(rows.items(), chances, strict=True)
    )


NONE = (float("nan"), float("nan"))


def _model(of: ComparedRun) -> Recommended | None:
    """Model of the compared response."""
    return next((m for m in of.study.models if m.response is of.response), None)


def _mode(model: Recommended | None, of: ComparedRun) -> Mode | None:
    """Oscillating pole pair nearest to the resonance, or the least damped one."""
    pairs = oscillating(model.fit) if model else []
    if not pairs:
        return None
    peak = of.found.resonance
    if isinstance(peak, Resonance):
        return min(pairs, key=lambda m: abs(np.log(m.frequency / peak.frequency)))
    return min(pairs, key=lambda m: m.damping)


def _frequency(model: Recommended | None, of: ComparedRun) -> tuple[float, float]:
    mode = _mode(model, of)
    return (mode.frequency, mode.frequency_deviation) if mode else NONE


def _damping(model: Recommended | None, of: ComparedRun) -> tuple[float, float]:
    mode = _mode(model, of)
    return (mode.damping, mode.damping_deviation) if mode else NONE


def _real_pole(model: Recommended | None) -> tuple[float, float]:
    """Slowest real pole in the band and its standard deviation, Hz."""
    poles = real_poles(model.fit) if model else []
    top = model.fit.lines.frequency[-1] if model else 0.0
    return next(((f, half / ACROSS) for f, half in poles if half < f < top), NONE)


def _delay(model: Recommended | None, factor: float = 1.0) -> tuple[float, float]:
    """Dead time and its standard deviation, s times `factor`."""
    if model is None or not isinstance(model.delay, DelayProfile):
        return NONE
    delay = model.delay
    return factor * delay.delay, factor * (delay.high - delay.low) / (2 * ACROSS)


def _homogeneous(values: list[tuple[float, float]]) -> float:
    """Probability of so different values by chance; NaN for fewer than two."""
    known = [(v, s) for v, s in values if np.isfinite(v) and s > 0]
    if len(known) < 2:
        return float("nan")
    value, deviation = np.array(known).T
    weight = deviation**-2.0
    mean = np.sum(weight * value) / np.sum(weight)
    return float(stats.chi2.sf(np.sum(weight * (value - mean) ** 2), len(known) - 1))


def _across(own: list[ComparedRun]) -> dict[tuple[str, str], Validation]:
    """Model of every run on the data of every other run."""
    made = {}
    for one in own:
        model = _model(one)
        for other in own if model is not None else ():
            if other is one:
                continue
            assert model is not None
            checked = validated_on(model.fit, other.found)
            if isinstance(checked, Validation):
                made[one.name, other.name] = checked
    return made
