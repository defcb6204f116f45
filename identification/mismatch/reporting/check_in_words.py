"""The posterior predictive check in sentences."""

from collections.abc import Iterator

from slipbench.identification.mismatch.reporting.check_result import (
    COMPLETE,
    CONFIDENCE,
    FALSE_ALARMS,
    REPEATABLE,
    Check,
    Rate,
)
from slipbench.identification.mismatch.reporting.verdict import Verdict

NO_MODEL = "No accepted model of the mismatch exists that could be simulated again."
NOTHING_DONE = "No simulated recording was analysed."
CONDITION = (
    "The check assumes the accepted model and its noise: it measures how repeatable the verdict is,"
    " not whether the accepted model is the true one."
)


def check_lines(verdict: Verdict) -> Iterator[str]:
    """Yield the result of the check in sentences; nothing without a check."""
    check = verdict.check
    if check is None:
        return
    no_mismatch = not verdict.mismatch
    if not no_mismatch and not check.same.of:
        yield NO_MODEL if check.false_alarms.of else NOTHING_DONE
    elif not no_mismatch:
        yield _same_result(check, verdict.unknown)
        yield from _details(check)
    if check.false_alarms.of:
        yield _false_alarms(check)
        yield _conclusion(check, no_mismatch)
    if check.failures:
        yield f"Simulations or analyses that failed: {len(check.failures)}, first: {check.failures[0]}."
    yield f"{_extent(check)} {CONDITION}"


def _same_result(check: Check, unknown: bool) -> str:
    result = "again no name was sufficient" if unknown else "the same effects were named"
    return (
        f"On {_sets(check.same)} simulated from the accepted model {result} in {_rate(check.same)}."
    )


def _details(check: Check) -> Iterator[str]:
    yield f"Same place: {_rate(check.place)} of {check.place.of}."
    if len(check.effects) > 1:
        rates = "; ".join(f"{n}: {_rate(r)} of {r.of}" for n, r in check.effects.items())
        yield f"Each effect, or one that is indistinguishable from it: {rates}."
    if check.inside.of:
        yield (
            f"Intervals that contain the simulated parameter: {_rate(check.inside)} of"
            f" {check.inside.of}; stated: {100 * CONFIDENCE:.0f} %, where the set of effects is the right one."
        )
    if check.answers:
        other_results = "; ".join(
            f"{', '.join(a.names) or 'no mismatch'} ({a.count})" for a in check.answers
        )
        yield f"Other answers: {other_results}."


def _false_alarms(check: Check) -> str:
    alarms = check.false_alarms
    return (
        f"On {_sets(alarms)} simulated without effects a mismatch was detected in"
        f" {_rate(alarms)}; expected: at most {100 * FALSE_ALARMS:.0f} %."
    )


def _conclusion(check: Check, no_mismatch: bool) -> str:
    conclusion = "" if no_mismatch or not check.same.of else f"{_repeatability(check.same)} "
    low, high = check.false_alarms.interval
    if low > FALSE_ALARMS:
        return f"{conclusion}False alarms are more frequent than stated."
    if high <= FALSE_ALARMS:
        return f"{conclusion}False alarms are as rare as stated."
    return f"{conclusion}The rate of false alarms is compatible with the stated one."


def _repeatability(same: Rate) -> str:
    low, high = same.interval
    if low > REPEATABLE:
        return "Conclusion: the verdict is repeatable on recordings like these."
    if high < REPEATABLE:
        return "Conclusion: the verdict is not repeatable on recordings like these."
    return "Conclusion: undecided whether the verdict is repeatable; more simulations are needed."


def _sets(rate: Rate) -> str:
    return f"{rate.of} set{'' if rate.of == 1 else 's'} of recordings"


def _rate(rate: Rate) -> str:
    low, high = rate.interval
    return f"{rate.count} (95 % interval {100 * low:.0f} to {100 * high:.0f} %)"


def _extent(check: Check) -> str:
    count = check.same.of + check.false_alarms.of
    early_end = "" if check.ended == COMPLETE else f", ended early ({check.ended})"
    return f"{count} analys{'is' if count == 1 else 'es'} in {check.seconds:.0f} s, seed {check.seed}{early_end}."
