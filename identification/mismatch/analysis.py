"""What an analysis knows so far, and what follows from it: which fit stands, what is open."""

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
from slipbench.identification.mismatch.naming.named import ALIKE, Named
from slipbench.identification.mismatch.naming.score import SHOWN
from slipbench.identification.mismatch.simulation.model import Model, models
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.system import System


@dataclass(eq=False)
class Analysis:
    """Everything that is known so far; filled step by step, so that a stop loses nothing.

    failure: step and error that ended it early; empty where none did.
    vetoes: what held-out recordings contradict.
    runs: paths of its recordings, training and held out, with their segments.
    kept: whether names stand though a free curve finds more beside them, since none does as well
    in their place.
    """

    system: System
    training: Model
    held_out: Model | None
    base: Fit | None = None
    before: list[Curve] = field(default_factory=list)
    when: OperatingRegion | None = None
    named: Named | None = None
    headline: str = ""
    after: list[Curve] = field(default_factory=list)
    remains: Remainder | None = None
    proof: list[Fit] = field(default_factory=list)
    errors: list[Error] = field(default_factory=list)
    free: FreeCurve | None = None
    vetoes: list[Veto] = field(default_factory=list)
    kept: bool = False
    proposal: tuple[str, Any] | None = None
    done: int = 0
    complete: bool = False
    failure: str = ""
    runs: tuple[str, ...] = ()


def begin(system: System, training: Sequence[Record], held_out: Sequence[Record]) -> Analysis:
    """Put the recordings beside the system."""
    learnt, proof = models(system, training, held_out)
    return Analysis(system, learnt, proof if held_out else None)


def described(step: str, fault: Exception) -> str:
    """Failure of a step in one line: step, error, and the line of code where it arose."""
    frames = traceback.extract_tb(fault.__traceback__)
    where = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if frames else ""
    return f"{step}: {type(fault).__name__}: {' '.join(str(fault).split())}{where}"


def accepted(a: Analysis) -> Fit:
    """Return the fit that stands: with names, with the free curve in their place, or bare."""
    assert a.base is not None
    assert a.named is not None
    if not unexplained(a):
        return a.named.fit
    return a.free.fit if a.free else a.base


def unexplained(a: Analysis) -> bool:
    """Whether a free curve still finds what the accepted effects (or none) do not explain."""
    assert a.named is not None
    if not a.named.names:
        return _certain(a.before)
    return not a.kept and a.remains is not None and not a.remains.small


def where_found(a: Analysis) -> Curve | None:
    """Return the free curve that tells where it acts without the library; None: none is certain.

    That is the located one, unless one at another place stands in the simulation and explains more
    there: a located curve has the calibrated numbers beside it and meets what is left of them.
    """
    located = a.before[0] if a.before and a.before[0].certain else None
    if located is None or a.free is None or a.free.curve.place == located.place:
        return located
    if a.free.log_likelihood_gain < located.log_likelihood_gain + ALIKE:
        return located
    return replace(
        a.free.curve,
        log_likelihood_gain=a.free.log_likelihood_gain,
        confirmed=a.free.confirmed,
        p=located.p,
    )


def _certain(curves: Sequence[Curve]) -> bool:
    return any(c.certain for c in curves)


def equivalents(named: Named) -> list[tuple[str, ...]]:
    """Classes of names that these recordings do not tell apart, the accepted one first."""
    return [
        (found, *others)
        for found, behind in named.competing.items()
        if (others := [other for other, nats in behind.items() if nats < ALIKE])
    ]


def not_excited(named: Named) -> list[str]:
    """Effects that these recordings would not have shown at their typical size."""
    known = set(named.names)
    return [
        s.candidate.name
        for s in named.scores
        if s.typical < SHOWN and s.candidate.name not in known
    ]
