"""Verdict of recordings: the only interface between the laws and the analysis engine."""

from collections.abc import Sequence

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.verdict import FoundEffect, Verdict
from slipbench.identification.mismatch.simulation.system import System
from slipbench.protocol.recording.recording import Recording


def explained(
    system: System,
    training: Sequence[Recording],
    held_out: Sequence[Recording] = (),
    library: Sequence[str] = (),
) -> Verdict:
    """Verdict of an analysis. library: effects to look for, "name" or "name.place"; none: all."""
    kinds = [k for k in system.library if not library or k.name in library or k().key in library]
    assert len({k.name for k in kinds} | {k().key for k in kinds}) >= len(library)
    records = ([system.prepare(r) for r in rides] for rides in (training, held_out))
    return verdict(analyse(begin(system, *records), kinds))


def names(verdict: Verdict) -> list[str]:
    """Names of the accepted effects with their subjects, in alphabetical order."""
    return sorted(f"{e.name}.{e.subject}" if e.subject else e.name for e in verdict.effects)


def effect(verdict: Verdict, name: str) -> FoundEffect:
    """Return the accepted effect of this name."""
    return next(e for e in verdict.effects if e.name == name)


def holds(verdict: Verdict, name: str, parameter: str, truth: float, slack: float = 0.0) -> bool:
    """Whether the interval of a parameter contains the truth. slack: share of the truth."""
    estimate = next(p for p in effect(verdict, name).parameters if p.name == parameter)
    print(
        f"{name}.{parameter}: {estimate.value:.4g} "
        f"({estimate.low:.4g} to {estimate.high:.4g}), {truth:.4g}"
    )
    return estimate.low - slack * abs(truth) <= truth <= estimate.high + slack * abs(truth)


def large_errors(verdict: Verdict) -> list[str]:
    """Outputs whose held-out error stays far above its floor with all accepted effects."""
    return [e.output for e in verdict.held_out if e.large]


def reported(verdict: Verdict) -> str:
    """Return a verdict in one line, for the message of a failed test."""
    errors = "; ".join(
        f"{e.output} {e.nominal:.3g} {e.calibrated:.3g} {e.improved:.3g} floor {e.floor:.3g}"
        for e in verdict.held_out
    )
    place = verdict.location.injection if verdict.location else "no place"
    along = verdict.location.regressor if verdict.location else ""
    return (
        f"found {verdict.mismatch} p {verdict.p_value:.3g}; {names(verdict)}; {place} / {along};"
        f" unknown {verdict.unknown}; curve {verdict.curve and verdict.curve.injection};"
        f" remains {verdict.remains and round(verdict.remains.share, 4)};"
        f" equivalents {verdict.equivalents}; held out {errors}"
    )
