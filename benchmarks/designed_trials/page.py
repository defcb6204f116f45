"""The page of the study: runs and seconds of riding until one hypothesis stands, by policy."""

import statistics
from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.designed_trials.case import VISIBLE
from benchmarks.designed_trials.day import MOST, Day, Result
from benchmarks.designed_trials.policies import STRAIGHT
from slipbench.identification.experiments.sequential_test import LEVEL
from slipbench.identification.mismatch.thresholds import EXCITED, INDISTINGUISHABLE, REQUIRED_GAIN

POLICIES = ("designed", "menu", "fixed plan")
RESAMPLED = 10_000

INTRODUCTION = """# Designed trials against a fixed plan and a menu

Made by `python -m benchmarks.designed_trials.run --cases {cases} --seed {seed} --out docs/designed_trials.md`.

A case is a motorcycle whose parameters are drawn within what its file states, a plan of two sweeps (throttle and spark, 10 s, at a random
operating point), and hypotheses that the plan leaves open. In even cases the plan shows an effect ({least:.0f} to {largest:.0f} nats are expected)
and does not tell it from others (less than {alike:.0f} nats). In odd cases the plan would not show an effect of typical size (less than
{shown:.0f} nats), and the effect, 0.5 to 1.5 times as large, is there or nothing is. After the plan, each policy rides up to {most} trials on
the virtual motorcycle, over CAN, inside the same limits and on a straight of {straight:.0f} m. After each trial the hypotheses are compared
by e-values from all of them ([how](decisions/sequential-stop.md)). A policy ends when one hypothesis stands.

- **designed**: the trial with the most expected evidence for what is still open, as `slipbench next` offers it;
- **menu**: the best of the fixed menu of 18 trials, by the same expected evidence, with the amplitude that the limits permit;
- **fixed plan**: the two planned sweeps again, in turn.

A policy that has not settled a case counts with the {most} trials that it rode, or with {most} if it found no trial.
"""


def page(found: Sequence[Result], seed: int) -> str:
    """Return the page."""
    whole = [r for r in found if not r.why]
    least, largest = (REQUIRED_GAIN * share for share in VISIBLE)
    numbers = {
        "cases": len(found),
        "seed": seed,
        "alike": INDISTINGUISHABLE,
        "shown": EXCITED,
        "most": MOST,
    }
    lines = [
        INTRODUCTION.format(**numbers, least=least, largest=largest, straight=STRAIGHT),
        "| | " + " | ".join(POLICIES) + " |",
        "|---|" + "---|" * len(POLICIES),
        _line("settled", whole, lambda r, d: f"{sum(map(_settled, d))} of {len(d)}"),
        _line("the true hypothesis stands alone", whole, _right),
        _line(f"the true one was rejected (goal: at most {LEVEL:.0%})", whole, _wrong),
        _line("trials, mean", whole, lambda _, d: f"{statistics.fmean(map(_runs, d)):.2f}"),
        _line("riding, mean", whole, lambda _, d: f"{statistics.fmean(map(_seconds, d)):.0f} s"),
        _line("tripped by a limit", whole, lambda _, d: f"{sum(x.trips for x in d)}"),
        "",
        *(f"- {_compared(whole, other)}" for other in POLICIES[1:]),
        "",
        "## Cases",
        "",
        "Trials ridden; *right* where the true hypothesis alone stands, *wrong* where it was rejected, *open* elsewhere.",
        "",
        "| case | hypotheses, the true one first | " + " | ".join(POLICIES) + " |",
        "|---|---|" + "---|" * len(POLICIES),
        *map(row, found),
        "",
    ]
    return "\n".join(lines)


def row(r: Result) -> str:
    """A case as a row of the table."""
    names = ", ".join([r.truth, *(n for n in r.names if n != r.truth)]).replace("_", " ")
    if r.why:
        return f"| {r.number} | not ridden: {r.why} | | | |"
    cells = " | ".join(f"{d.runs} {_outcome(r, d)}" for d in r.days)
    return f"| {r.number} | {names} | {cells} |"


def _outcome(r: Result, d: Day) -> str:
    if r.truth not in d.left:
        return "wrong"
    return "right" if len(d.left) == 1 else "open" + (", no trial" if d.why else "")


def _line(
    head: str, found: Sequence[Result], figure: Callable[[Sequence[Result], Sequence[Day]], str]
) -> str:
    columns = [figure(found, [r.days[i] for r in found]) for i in range(len(POLICIES))]
    return f"| {head} | {' | '.join(columns)} |"


def _settled(d: Day) -> bool:
    return len(d.left) <= 1


def _right(found: Sequence[Result], days: Sequence[Day]) -> str:
    right = sum(d.left == (r.truth,) for r, d in zip(found, days, strict=True))
    return f"{right} of {len(days)}"


def _wrong(found: Sequence[Result], days: Sequence[Day]) -> str:
    wrong = sum(r.truth not in d.left for r, d in zip(found, days, strict=True))
    return f"{wrong} of {len(days)}"


def _runs(d: Day) -> int:
    return d.runs if _settled(d) else MOST


def _seconds(d: Day) -> float:
    if _settled(d) or d.runs == MOST or not d.runs:
        return d.seconds
    return d.seconds * MOST / d.runs


def _compared(found: Sequence[Result], other: str) -> str:
    """A sentence: how many trials fewer than another policy, with a bootstrap interval."""
    which = POLICIES.index(other)
    pairs = np.array([[_runs(r.days[0]), _runs(r.days[which])] for r in found], float)
    rng = np.random.default_rng(1)
    drawn = pairs[rng.integers(len(pairs), size=(RESAMPLED, len(pairs)))].sum(axis=1)
    low, high = np.percentile(100.0 * (1.0 - drawn[:, 0] / drawn[:, 1]), (2.5, 97.5))
    less = 100.0 * (1.0 - pairs[:, 0].sum() / pairs[:, 1].sum())
    return (
        f"Designed trials take {less:.0f} % fewer runs than the {other} "
        f"(95 % of resampled sets of cases: {low:.0f} to {high:.0f} %)."
    )
