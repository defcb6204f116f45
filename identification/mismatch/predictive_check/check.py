"""Posterior predictive check of a verdict: analyse recordings simulated from the accepted fit.

The method is that of Gelman, Meng and Stern, "Posterior predictive assessment of model fitness via
realized discrepancies", Statistica Sinica 6, 1996. The discrepancy is the result of the whole
analysis: parameters are drawn, recordings are simulated with the measured inputs and the sensors of
the measured recordings, and these are analysed. Simulations without the effects give the rate of
false alarms.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from slipbench.identification.mismatch.analysis import Analysis, accepted, failure_message
from slipbench.identification.mismatch.explain import CONCLUDED, NAMES, analyse
from slipbench.identification.mismatch.naming.search import Say
from slipbench.identification.mismatch.predictive_check.counts import Counts
from slipbench.identification.mismatch.predictive_check.order import Order
from slipbench.identification.mismatch.predictive_check.outcome import (
    AnalysisResult,
    compare,
    result_of,
)
from slipbench.identification.mismatch.predictive_check.replica import simulated
from slipbench.identification.mismatch.reporting.check_result import (
    COMPLETE,
    INTERRUPTED,
    OUT_OF_TIME,
    Check,
)
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.verdict import Verdict
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError
from slipbench.protocol.errors import is_interrupt


class TimeLimitError(Exception):
    """The time limit of the check was exceeded during an analysis."""


def analyses_of(a: Analysis, count: int) -> int:
    """Return the number of analyses of a check: 2 count, or count if no mismatch was identified."""
    return (2 if _has_simulable_mismatch(a) else 1) * count


def checked(a: Analysis, count: int, say: Say) -> Verdict:
    """Return the verdict of an analysis, with a check if it is complete. count: 0: no check."""
    result = verdict(a)
    if not count or not result.complete:
        return result
    return replace(result, check=check(a, result, Order(count), say))


def check(a: Analysis, first: Verdict, order: Order, say: Say = lambda _: None) -> Check:
    """Simulate the recordings of a complete analysis and analyse them again.

    Sets with and without the effects alternate, so that an early stop (Ctrl-C, the time limit)
    keeps results of both; an interrupted analysis is not counted.
    """
    reference = result_of(a, first)
    counts, start = Counts(reference.names), order.clock()

    def report_within_limit(message: str) -> None:
        if order.limit is not None and order.clock() - start > order.limit:
            raise TimeLimitError
        say(message)

    end_reason = COMPLETE
    try:
        for message, task in _tasks(a, reference, order, counts):
            report_within_limit(message)
            task(partial(_report_step, report_within_limit, message))
    except TimeLimitError:
        end_reason = OUT_OF_TIME
    except KeyboardInterrupt:
        end_reason = INTERRUPTED
    return counts.result(order, order.clock() - start, end_reason)


def _report_step(say: Say, message: str, step: str) -> None:
    say(f"{message}: {step}")


def _has_simulable_mismatch(a: Analysis) -> bool:
    """Return whether an accepted effect or free curve exists that can be simulated."""
    fit = accepted(a)
    return bool(fit.candidates or fit.model.injected)


def _tasks(
    a: Analysis, reference: AnalysisResult, order: Order, counts: Counts
) -> Iterator[tuple[str, Callable[[Say], None]]]:
    """Yield the analyses to do: a label and a function that runs the analysis."""
    for number in range(1, order.count + 1):
        label = f"Check {number} of {order.count}"
        if _has_simulable_mismatch(a):
            yield (
                f"{label}, with effects",
                partial(_analyse_with_effects, a, reference, order, number, counts),
            )
        yield (
            f"{label}, without effects",
            partial(_analyse_without_effects, a, order, number, counts),
        )


def _analyse_with_effects(
    a: Analysis, reference: AnalysisResult, order: Order, number: int, counts: Counts, say: Say
) -> None:
    if (simulation := _simulate(a, order, number, True, counts)) is not None:
        replica, truth = simulation
        repeated = _analyse(replica, order, counts.failures, say)
        counts.again.append(compare(reference, repeated, truth))


def _analyse_without_effects(
    a: Analysis, order: Order, number: int, counts: Counts, say: Say
) -> None:
    if (simulation := _simulate(a, order, number, False, counts)) is not None:
        repeated = _analyse(simulation[0], order, counts.failures, say)
        counts.alarms.append(bool(repeated.verdict.mismatch) or bool(repeated.names))


def _simulate(
    a: Analysis, order: Order, number: int, with_effects: bool, counts: Counts
) -> tuple[Analysis, dict[str, Effect]] | None:
    """Return a simulated set and its effects; None if the simulation fails, which is recorded."""
    rng = np.random.default_rng((order.seed, number, int(with_effects)))
    try:
        return simulated(a, rng, with_effects)
    except PlantError as fault:
        counts.failures.append(failure_message("simulation", fault))
        return None


def _analyse(a: Analysis, order: Order, failures: list[str], say: Say) -> AnalysisResult:
    """Return the result for a simulated set; a failed analysis counts as one without a result."""
    try:
        analyse(a, order.library, say, until=CONCLUDED)
    except (TimeLimitError, KeyboardInterrupt):
        raise
    except Exception as fault:
        if is_interrupt(fault):
            raise KeyboardInterrupt from fault
        failures.append(failure_message(NAMES[a.done], fault))
    return result_of(a, verdict(a))
