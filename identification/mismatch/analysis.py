"""Results of an analysis: the accepted fit, the unexplained residual, equivalent effects."""

import traceback
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from slipbench.identification.mismatch.curves.adequacy import Remainder
from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.free_curve import FreeCurve
from slipbench.identification.mismatch.curves.operating_region import OperatingRegion
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.held_out import Error, Veto
from slipbench.identification.mismatch.naming.named import Named
from slipbench.identification.mismatch.simulation.model import Model, models
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.system import System
from slipbench.identification.mismatch.thresholds import (
    EXCITED,
    FALSE_ALARM_RATE,
    INDISTINGUISHABLE,
)


@dataclass(eq=False)
class Analysis:
    """Results of an analysis, filled step by step, so that an interruption loses no result.

    before, after: free curves in the residual of the calibrated system, and of the named effects.
    operating_region: operating region of the located curve. held_out_runs: held-out runs of the nominal, the
    calibrated and the improved system.
    failure: step and error that stopped the analysis; empty if none.
    vetoes: effects and free curves that the held-out recordings contradict.
    runs: paths of the training and held-out recordings, with their segments.
    names_kept: whether the named effects predict better than a free curve in their place; None: not
    compared, what remains beside them decides.
    """

    system: System
    training: Model
    held_out: Model | None
    base: Fit | None = None
    before: list[Curve] = field(default_factory=list)
    operating_region: OperatingRegion | None = None
    named: Named | None = None
    headline: str = ""
    after: list[Curve] = field(default_factory=list)
    remains: Remainder | None = None
    held_out_runs: list[Fit] = field(default_factory=list)
    errors: list[Error] = field(default_factory=list)
    free: FreeCurve | None = None
    vetoes: list[Veto] = field(default_factory=list)
    names_kept: bool | None = None
    proposal: tuple[str, Any] | None = None
    done: int = 0
    complete: bool = False
    failure: str = ""
    runs: tuple[str, ...] = ()


def begin(system: System, training: Sequence[Record], held_out: Sequence[Record]) -> Analysis:
    """Begin an analysis: models of the system on the training and held-out recordings."""
    training_model, held_out_model = models(system, training, held_out)
    return Analysis(system, training_model, held_out_model if held_out else None)


def failure_message(step: str, fault: Exception) -> str:
    """Describe the failure of a step in one line: step, error, and the line of code."""
    frames = traceback.extract_tb(fault.__traceback__)
    where = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if frames else ""
    return f"{step}: {type(fault).__name__}: {' '.join(str(fault).split())}{where}"


def accepted(a: Analysis) -> Fit:
    """Return the accepted fit: with named effects, with the free curve instead, or calibrated."""
    assert a.base is not None
    assert a.named is not None
    if not unexplained(a):
        return a.named.fit
    return a.free.fit if a.free else a.base


def unexplained(a: Analysis) -> bool:
    """Return whether a significant residual remains beside the accepted effects (if any).

    Without any, also where effects are significant on the training recordings and contradicted by
    the held-out ones: something is missing, but not what these effects describe.
    """
    assert a.named is not None
    if not a.named.names:
        return _any_significant(a.before) or a.named.p < FALSE_ALARM_RATE
    if a.names_kept is not None:
        return not a.names_kept
    return a.remains is not None and not a.remains.small


def localizing_curve(a: Analysis) -> Curve | None:
    """Return the free curve that localizes the mismatch; None: no curve is significant.

    This is the located curve, unless the curve in the simulation acts at another place and gains
    at least ALIKE nats more: the located curve is fitted to the residual of fixed parameters.
    """
    located = a.before[0] if a.before and a.before[0].significant else None
    if located is None or a.free is None or a.free.curve.place == located.place:
        return located
    if a.free.log_likelihood_gain < located.log_likelihood_gain + INDISTINGUISHABLE:
        return located
    return replace(
        a.free.curve,
        log_likelihood_gain=a.free.log_likelihood_gain,
        confirmed=a.free.confirmed,
        p=located.p,
    )


def _any_significant(curves: Sequence[Curve]) -> bool:
    return any(c.significant for c in curves)


def equivalents(named: Named) -> list[tuple[str, ...]]:
    """Return classes of names that are indistinguishable, the accepted name first."""
    return [
        (name, *others)
        for name, nats_behind in named.rivals.items()
        if (others := [other for other, nats in nats_behind.items() if nats < INDISTINGUISHABLE])
    ]


def not_excited(named: Named) -> list[str]:
    """Return effects that are not detectable in these recordings at their typical size."""
    known = set(named.names)
    return [
        s.candidate.name
        for s in named.scores
        if s.typical < EXCITED and s.candidate.name not in known
    ]
