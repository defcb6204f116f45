"""Unsealed: what was claimed beside what was true, counted with exact intervals.

A thing that is missing counts as visible where somebody who knows it gains 16 nats from it: then an
observer who tests 48 effects at three sizes each, with 5 % for the whole family, sees it 19 times
in 20 (chi2 of two numbers at 0.05 / 144 is 16, half of it 8 nats; (sqrt(2 * 8) + 1.64)^2 / 2 = 16).
Below 8 nats nobody can see it, and to claim it is luck at best.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from identification.proof.generator.case import (
    ELSE,
    MODERATE,
    NOTHING,
    PAIR,
    SMALL,
    TRIPLE,
    UNEXCITED,
)
from identification.proof.generator.kinds import BY_NAME

VISIBLE, NOBODY_SEES = 16.0, 8.0  # nats
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Judged:
    """One case. truth: keys of what is missing; seen: those of it that are visible.

    expected: whether an alarm is due (True), wrong (False), or either may be (None).
    """

    case: int
    sort: str
    tyre: str
    truth: tuple[str, ...]
    seen: tuple[str, ...]
    nats: float
    expected: bool | None
    alarm: bool
    unknown: bool
    located: bool
    place: str
    said: tuple[str, ...]
    named: bool
    covered: tuple[bool, ...]
    share: float
    seconds: float
    curve: float = math.nan
    said_hidden: bool = False
    failed: str = ""


@dataclass(frozen=True)
class Figure:
    """Something counted over cases, %. low, high: what is wanted of it; 0 and inf: nothing."""

    text: str
    total: int
    percent: float
    interval: tuple[float, float]
    shown: str
    low: float = 0.0
    high: float = math.inf

    @property
    def wanted(self) -> bool:
        """Whether there is a goal."""
        return self.low > 0.0 or self.high < math.inf

    @property
    def met(self) -> bool | None:
        """Whether it is what is wanted; None where nothing was counted or wanted."""
        counts = bool(self.total) and self.wanted
        return self.low <= self.percent <= self.high if counts else None


def share(text: str, count: int, total: int, low: float = 0.0, high: float = math.inf) -> Figure:
    """So many of so many, with Clopper and Pearson's exact 95 % interval."""
    if not total:
        return Figure(text, 0, math.nan, (0.0, 100.0), "none counted", low, high)
    found = stats.binomtest(count, total).proportion_ci(CONFIDENCE, "exact")
    percent = 100.0 * count / total
    interval = 100.0 * float(found.low), 100.0 * float(found.high)
    return Figure(text, total, percent, interval, f"{count}/{total} = {percent:.1f} %", low, high)


def middle(text: str, shares: Sequence[float], low: float = 0.0) -> Figure:
    """Median of shares, with the 95 % interval that their order alone gives."""
    if not shares:
        return Figure(text, 0, math.nan, (0.0, 100.0), "none counted", low)
    ordered, n = np.sort(shares) * 100.0, len(shares)
    first = max(int(stats.binom.ppf(0.5 - CONFIDENCE / 2, n, 0.5)) - 1, 0)
    percent = float(np.median(ordered))
    interval = float(ordered[first]), float(ordered[n - 1 - first])
    return Figure(text, n, percent, interval, f"{percent:.1f} %, median of {n}", low)


def judged(
    answers: Sequence[Mapping[str, Any]], results: Iterable[Mapping[str, Any]]
) -> list[Judged]:
    """Put results beside answers."""
    return [_judge(answers[result["case"]], result) for result in results]


def _judge(answer: Mapping[str, Any], result: Mapping[str, Any]) -> Judged:
    hidden = answer["hidden"]
    truth = tuple(_key(h["kind"], h["subject"]) for h in hidden)
    if "failed" in result:
        return Judged(answer["case"], answer["sort"], answer["tyre"], truth, truth, math.nan, None,
                      False, False, False, "", (), False, (), math.nan, math.nan,
                      failed=result["failed"])  # fmt: skip
    verdict, each = result["verdict"], result["ideal"]["each"]
    seen = tuple(t for t, nats in zip(truth, each, strict=True) if nats >= VISIBLE)
    place = (verdict["location"] or {}).get("injection", "")
    visible = [h for h, nats in zip(hidden, each, strict=True) if nats >= VISIBLE]
    places = {p for h in visible for p in h["places"]}
    said = tuple(_key(e["name"], e["subject"]) for e in verdict["effects"])
    gain = result["ideal"]["gain"]
    return Judged(
        case=answer["case"], sort=answer["sort"], tyre=answer["tyre"], truth=truth, seen=seen,
        nats=gain, expected=True if seen else (False if gain < NOBODY_SEES else None),
        alarm=verdict["mismatch"]["found"], unknown=verdict["unknown"]["found"],
        located=place in places, place=place, said=said,
        named=bool(seen) and _exact(truth, seen, said, verdict["equivalents"]),
        covered=tuple(_coverage(hidden, verdict["effects"])),
        share=_share(result), seconds=result["seconds"]["analysis"], curve=_curve(result),
        said_hidden=set(truth) <= set(verdict["not_excited"]),
    )  # fmt: skip


def _key(name: str, subject: str) -> str:
    return f"{name}.{subject}" if subject else name


def _exact(
    truth: Sequence[str], seen: Sequence[str], said: Sequence[str], classes: Sequence[Sequence[str]]
) -> bool:
    """Whether all that is visible was named, itself or in its class, and nothing else."""
    meant = {name: {name}.union(*(set(c) for c in classes if name in c)) for name in said}
    all_named = all(any(t in names for names in meant.values()) for t in seen)
    return all_named and all(names & set(truth) for names in meant.values())


def _coverage(
    hidden: Sequence[Mapping[str, Any]], effects: Sequence[Mapping[str, Any]]
) -> Iterable[bool]:
    """Whether the interval of each number that both formulas mean holds the truth."""
    told = {_key(e["name"], e["subject"]): e["parameters"] for e in effects}
    for h in hidden:
        for p in told.get(_key(h["kind"], h["subject"]), ()):
            low, high = p["interval"]
            comparable = p["name"] in BY_NAME[h["kind"]].like and p["name"] in h["parameters"]
            if comparable and None not in (low, high):
                yield low <= h["parameters"][p["name"]] <= high


def _share(result: Mapping[str, Any]) -> float:
    """Share of the held-out gain that the truth has: logarithms of errors, summed over outputs."""
    true = {e["output"]: e for e in result["truth"]}
    if not true or not result["verdict"]["held_out"]:
        return math.nan
    reached = possible = 0.0
    for told in result["verdict"]["held_out"]:
        best = true[told["output"]]
        possible += math.log(best["calibrated"] / best["improved"])
        reached += math.log(best["calibrated"] / told["improved"])
    return reached / possible if possible > 0.05 else math.nan


def _curve(result: Mapping[str, Any]) -> float:
    """Share of the true physics' held-out gain, in nats, that the free curve has."""
    told = result.get("curve")
    return told["confirmed"] / told["possible"] if told and told["possible"] > VISIBLE else math.nan


def figures(cases: Sequence[Judged]) -> list[Figure]:
    """Return all that is counted, with the goals that there are."""
    single = (MODERATE, SMALL)

    def of(text: str, among: Callable[[Judged], bool], what: Callable[[Judged], bool],
           low: float = 0.0, high: float = math.inf) -> Figure:  # fmt: skip
        chosen = [c for c in cases if among(c)]
        return share(text, sum(map(what, chosen)), len(chosen), low, high)

    def visible(*sorts: str) -> Callable[[Judged], bool]:
        return lambda c: c.sort in sorts and bool(c.seen)

    def unseen(c: Judged) -> bool:
        return c.sort != NOTHING and c.expected is False

    numbers = [x for c in cases for x in c.covered]
    return [
        of("False alarms, nothing missing", lambda c: c.sort == NOTHING, lambda c: c.alarm,
           high=5.0),
        of("Alarms where nobody can see anything", unseen, lambda c: c.alarm, high=5.0),
        of("Alarm, one effect, moderate", visible(MODERATE), lambda c: c.alarm),
        of("Alarm, one effect, small", visible(SMALL), lambda c: c.alarm),
        of("Injection point right, moderate", visible(MODERATE), lambda c: c.located, low=95.0),
        of("Injection point right, small", visible(SMALL), lambda c: c.located, low=90.0),
        of("Name or its class right, moderate", visible(MODERATE), lambda c: c.named, low=95.0),
        of("Name or its class right, small", visible(SMALL), lambda c: c.named, low=85.0),
        of("Pairs exact", visible(PAIR), lambda c: c.named, low=85.0),
        of("Triples exact", visible(TRIPLE), lambda c: c.named, low=85.0),
        of("Alarm, effect outside the library", visible(ELSE), lambda c: c.alarm, low=95.0),
        of("No name given, outside the library", visible(ELSE), lambda c: not c.said),
        of("Injection point right, outside the library", visible(ELSE), lambda c: c.located),
        of("Not excited, and said so", lambda c: c.sort == UNEXCITED and c.expected is False,
           lambda c: c.said_hidden),
        share("95 % intervals that hold the truth", sum(numbers), len(numbers), 90.0, 98.0),
        middle("Share of the true effect's held-out gain, where named",
               [c.share for c in cases if c.sort in single and c.named
                and math.isfinite(c.share)]),
        middle("Share of the true physics' held-out gain, free curve",
               [c.curve for c in cases if c.seen and math.isfinite(c.curve)], low=90.0),
    ]  # fmt: skip


def misses(cases: Iterable[Judged]) -> list[Judged]:
    """Every case in which something was claimed wrongly or not at all."""
    return [c for c in cases if what_is_wrong(c)]


def what_is_wrong(c: Judged) -> str:
    """Say it in a few words; empty where all is well."""
    if c.failed:
        return "the engine failed"
    if c.expected is False and c.alarm:
        return "false alarm" if c.sort == NOTHING else "alarm on what nobody can see"
    if not c.seen:
        return ""
    if not c.alarm:
        return "not noticed"
    if c.sort == ELSE:
        return "named, but it is in no library" if c.said else _place_wrong(c)
    if not c.named:
        return "not named" if c.unknown or not c.said else "wrong name"
    return _place_wrong(c)


def _place_wrong(c: Judged) -> str:
    return "" if c.located or c.sort == UNEXCITED else "wrong injection point"
