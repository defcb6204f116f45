"""Result of an analysis as data: the content of verdict.json.

version      version of this format; it is incremented where a field is added
mismatch     {found, p_value}: whether a mismatch is detected, and the family-wise p-value;
             null where the analysis stopped before a conclusion
location     {block, injection, regressor, band, region, along, direction, shape, gain, ...}
             or null
suspected    the same, not significant: possible location of missing physics where a held-out error
             is large; null where a location is known or no error is large
effects      [{name, subject, block, gain, trace, regressor, parameters: [{name, value, unit,
             interval}]}], strongest first; trace: its response in recordings, from the effect's
             page; regressor: the quantity over which it acts
intervals    what the intervals of the parameters are conditional on
unknown      {found, shape}: whether a mismatch exists that no effect of the library explains
remains      {injection, regressor, shape, share}: residual beside the accepted effects, as a share
             of what they explain in mean squares; null where there is none or it is not computed
curve        {injection, unit, regressor, knots, values, gain, confirmed}: free curve instead of an
             effect
equivalents  [[names]] that are indistinguishable in these recordings
rivals       {name: {other name: nats behind}}; negative where one is better that is less plausible or not significant
doubts       {name: prior doubt} of names that are indistinguishable
not_excited  [names] of effects that these recordings do not excite enough to be detected
not_told     [parameters] of the vehicle file that are not identifiable from these recordings
far          [parameters] that calibration moved by more than 3 prior standard deviations
next_trial   {why, trial} the candidate experiment with the largest expected gain, or null
improvement  {log_likelihood_gain, interval, outputs: [{output, unit, share, simulation, one_step,
             band, in_band}]}: held out, improved against re-calibrated; null without a mismatch
vetoes       [{name, gain, least, reason}]: effects and curves that held-out recordings contradict
held_out     [{output, unit, nominal, calibrated, improved, floor, floor_from, interval, large}];
             large: improved exceeds 5 times the floor
headline     output of the first sentence, chosen on the training recordings
lack_of_fit  [{trials, f, p_value}] of repeated trials: re-calibrated, and improved
left_out     ["recording: channel: why"] of data that could not be used
training     [paths] of the training runs, relative to the folder of verdict.json, with the segment
             that was used, as in run@0:60; empty where they are unknown
check        {seed, requested, seconds, limit, ended, same, place, inside, false_alarms, effects,
             answers, failures}: how often the analysis of simulated recordings gives the same
             result (explain --check); null without a check
complete     false where the analysis was interrupted or failed
failure      the step that failed and its error; empty if none
"""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from slipbench.identification.mismatch.fit.floor import LackOfFit
from slipbench.identification.mismatch.fit.held_out import Error, Veto
from slipbench.identification.mismatch.naming.interval import Estimate
from slipbench.identification.mismatch.reporting.check_result import Check, check_tree
from slipbench.identification.mismatch.reporting.improvement import Improvement
from slipbench.identification.mismatch.simulation.written_units import SI, WrittenUnits
from slipbench.protocol.extras import optional_library
from slipbench.protocol.notebook import card

VERSION = 6
INTERVALS = (
    "Intervals hold for this set of effects only: they do not include that another set is the right"
    " one."
)


@dataclass(frozen=True)
class Location:
    """Where a mismatch acts. band: Hz; region: range of the quantity `along`, SI.

    p_value: family-wise, of a location that is not significant; None: it is significant.
    """

    block: str
    injection: str
    regressor: str
    shape: str
    gain: float
    confirmed: float
    band: tuple[float, float] | None = None
    region: tuple[float, float] | None = None
    direction: str = "both"
    along: str = ""
    along_unit: str = ""
    p_value: float | None = None


@dataclass(frozen=True)
class FoundEffect:
    """An effect that is missing in the simulation, with its parameters.

    stated: value of the first parameter in the file; None: the file does not contain the effect.
    """

    name: str
    subject: str
    block: str
    parameters: tuple[Estimate, ...]
    gain: float
    trace: str = ""
    regressor: str = ""
    stated: float | None = None


@dataclass(frozen=True)
class FarParameter:
    """A parameter that calibration moved far from its prior mean; SI.

    deviations: change in prior standard deviations, which the file states.
    """

    key: str
    stated: float
    calibrated: float
    deviations: float


@dataclass(frozen=True)
class Remains:
    """Residual of the accepted effects. share: of what they explain, in mean squares."""

    injection: str
    regressor: str
    shape: str
    share: float


@dataclass(frozen=True)
class FoundCurve:
    """A free curve f(regressor) that acts in the simulation at a place; gains in nats."""

    injection: str
    unit: str
    regressor: str
    knots: tuple[float, ...]
    values: tuple[float, ...]
    gain: float
    confirmed: float


@dataclass(frozen=True)
class Verdict:
    """Result of an analysis, SI; see the docstring of this module. written: units of reports."""

    mismatch: bool | None
    p_value: float | None
    location: Location | None = None
    effects: tuple[FoundEffect, ...] = ()
    unknown: bool = False
    shape: str = ""
    remains: Remains | None = None
    curve: FoundCurve | None = None
    equivalents: tuple[tuple[str, ...], ...] = ()
    rivals: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    doubts: Mapping[str, str] = field(default_factory=dict)
    not_excited: tuple[str, ...] = ()
    not_told: tuple[str, ...] = ()
    far: tuple[FarParameter, ...] = ()
    next_trial: Mapping[str, Any] | None = None
    improvement: Improvement | None = None
    vetoes: tuple[Veto, ...] = ()
    held_out: tuple[Error, ...] = ()
    headline: str = ""
    lack_of_fit: tuple[LackOfFit, ...] = ()
    left_out: tuple[str, ...] = ()
    training: tuple[str, ...] = ()
    check: Check | None = None
    suspected: Location | None = None
    complete: bool = True
    failure: str = ""
    written: WrittenUnits = SI

    def to_pandas(self) -> Any:
        """Return a pandas.DataFrame of the effects' parameters: value and 95 % interval, in SI.

        Columns: effect, subject, parameter, value, low, high, unit. Raises InputError where pandas
        is not installed.
        """
        pandas = optional_library("pandas")
        rows = [
            (effect.name, effect.subject, p.name, p.value, p.low, p.high, p.unit)
            for effect in self.effects
            for p in effect.parameters
        ]
        columns = ["effect", "subject", "parameter", "value", "low", "high", "unit"]
        return pandas.DataFrame(rows, columns=columns)

    def _repr_html_(self) -> str:
        from slipbench.identification.mismatch.reporting.memo import lines

        return card("Simulation against recordings", [line for line in lines(self) if line])


def as_tree(verdict: Verdict) -> dict[str, Any]:
    """Return the verdict in the form of verdict.json."""
    tree = {"version": VERSION, **asdict(verdict), "intervals": INTERVALS}
    del tree["written"]
    tree["check"] = None if verdict.check is None else check_tree(verdict.check)
    for error, entry in zip(verdict.held_out, tree["held_out"], strict=True):
        entry["large"] = error.large
    tree["mismatch"] = {"found": verdict.mismatch, "p_value": tree.pop("p_value")}
    tree["unknown"] = {"found": verdict.unknown, "shape": tree.pop("shape")}
    for effect in tree["effects"]:
        for p in effect["parameters"]:
            p["interval"] = [p.pop("low"), p.pop("high")]
    return {key: _plain(value) for key, value in tree.items()}


def as_json(verdict: Verdict) -> str:
    """Return the text of verdict.json."""
    return json.dumps(as_tree(verdict), indent=2, allow_nan=False) + "\n"


def _plain(tree: Any) -> Any:
    if isinstance(tree, dict):
        return {str(key): _plain(value) for key, value in tree.items()}
    if isinstance(tree, (list, tuple)):
        return [_plain(value) for value in tree]
    if isinstance(tree, float):
        return tree if math.isfinite(tree) else None
    return tree
