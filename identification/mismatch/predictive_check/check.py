"""Can a verdict be trusted on these recordings? Simulate them from the fit, and explain them again.

This is a posterior predictive check (Gelman, Meng and Stern, "Posterior predictive assessment of
model fitness via realized discrepancies", Statistica Sinica 6, 1996) whose discrepancy is the answer
of the whole analysis: from the drawn parameters to recordings with the inputs and sensors of the recorded ones,
and back. The same without the effects gives the rate of false alarms.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from slipbench.identification.mismatch.analysis import Analysis, accepted, described
from slipbench.identification.mismatch.explain import CONCLUDED, NAMES, analyse
from slipbench.identification.mismatch.naming.search import Say
from slipbench.identification.mismatch.predictive_check.counts import Counts
from slipbench.identification.mismatch.predictive_check.order import Order
from slipbench.identification.mismatch.predictive_check.outcome import Answer, answer_of, compared
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
    """The time limit ended an analysis."""


def analyses_of(a: Analysis, count: int) -> int:
    """Return how many analyses a check makes: where nothing was identified, one kind only."""
    return (2 if _found(a) else 1) * count


def checked(a: Analysis, count: int, say: Say) -> Verdict:
    """Verdict of an analysis, with its check where it is complete. count: 0: no check."""
    found = verdict(a)
    if not count or not found.complete:
        return found
    return replace(found, check=check(a, found, Order(count), say))


def check(a: Analysis, first: Verdict, order: Order, say: Say = lambda _: None) -> Check:
    """Simulate the recordings of a complete analysis and explain them again.

    Sets with and without the effects take turns, so that an early end (Ctrl-C, the time limit)
    keeps some of both; an analysis that it cuts off is not counted.
    """
    wanted = answer_of(a, first)
    found, begun = Counts(wanted.names), order.clock()

    def watched(words: str) -> None:
        if order.limit is not None and order.clock() - begun > order.limit:
            raise TimeLimitError
        say(words)

    ended = COMPLETE
    try:
        for words, work in _work(a, wanted, order, found):
            watched(words)
            work(partial(_with, watched, words))
    except TimeLimitError:
        ended = OUT_OF_TIME
    except KeyboardInterrupt:
        ended = INTERRUPTED
    return found.result(order, order.clock() - begun, ended)


def _with(say: Say, words: str, step: str) -> None:
    say(f"{words}: {step}")


def _found(a: Analysis) -> bool:
    """Tell whether something was identified that can be simulated: effects, or a free curve."""
    fit = accepted(a)
    return bool(fit.candidates or fit.model.injected)


def _work(
    a: Analysis, wanted: Answer, order: Order, found: Counts
) -> Iterator[tuple[str, Callable[[Say], None]]]:
    """Yield what is to be done: words for it, and the work."""
    for number in range(1, order.count + 1):
        told = f"Check {number} of {order.count}"
        if _found(a):
            yield f"{told}, with effects", partial(_repeat, a, wanted, order, number, found)
        yield f"{told}, without effects", partial(_alarm, a, order, number, found)


def _repeat(
    a: Analysis, wanted: Answer, order: Order, number: int, found: Counts, say: Say
) -> None:
    if (made := _simulated(a, order, number, True, found)) is not None:
        replica, truth = made
        again = _explained(replica, order, found.failures, say)
        found.again.append(compared(wanted, again, truth))


def _alarm(a: Analysis, order: Order, number: int, found: Counts, say: Say) -> None:
    if (made := _simulated(a, order, number, False, found)) is not None:
        again = _explained(made[0], order, found.failures, say)
        found.alarms.append(bool(again.verdict.mismatch) or bool(again.names))


def _simulated(
    a: Analysis, order: Order, number: int, with_effects: bool, found: Counts
) -> tuple[Analysis, dict[str, Effect]] | None:
    """Return a simulated set; None, and the failure noted, where it cannot be simulated."""
    rng = np.random.default_rng((order.seed, number, int(with_effects)))
    try:
        return simulated(a, rng, with_effects)
    except PlantError as fault:
        found.failures.append(described("simulation", fault))
        return None


def _explained(a: Analysis, order: Order, failures: list[str], say: Say) -> Answer:
    """Return the answer for a simulated set; one that fails counts, without an answer."""
    try:
        analyse(a, order.library, say, until=CONCLUDED)
    except (TimeLimitError, KeyboardInterrupt):
        raise
    except Exception as fault:
        if is_interrupt(fault):
            raise KeyboardInterrupt from fault
        failures.append(described(NAMES[a.done], fault))
    return answer_of(a, verdict(a))
