"""Unsealed: what was claimed beside what was true, counted with exact intervals.

A thing that is missing counts as visible where somebody who knows it gains 16 nats from it: then an
observer who tests 48 effects at three sizes each, with 5 % for the whole family, sees it 19 times
in 20 (chi2 of two numbers at 0.05 / 144 is 16, half of it 8 nats; (sqrt(2 * 8) + 1.64)^2 / 2 = 16).
Below 8 nats nobody can see it, and to claim it is luck at best.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from slipbench.studies.blind_validation.generator.case import ELSE, NOTHING, UNEXCITED
from slipbench.studies.blind_validation.generator.fault_types import BY_NAME

VISIBLE, NOBODY_SEES = 16.0, 8.0  # nats
FAITHFUL = 0.7  # share of the true gain below which the library means something else


@dataclass(frozen=True)
class Told:
    """A number that both formulas mean, with its 95 % interval. SI."""

    effect: str
    parameter: str
    truth: float
    low: float
    high: float

    @property
    def holds(self) -> bool:
        """Whether the interval holds the truth."""
        return self.low <= self.truth <= self.high


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
    numbers: tuple[Told, ...]
    share: float
    seconds: float
    curve: float = math.nan
    said_hidden: bool = False
    formula: float = math.nan
    failed: str = ""


def judged(
    answers: Sequence[Mapping[str, Any]], results: Iterable[Mapping[str, Any]]
) -> list[Judged]:
    """Put results beside answers."""
    return [_judge(answers[result["case"]], result) for result in results]


def _judge(answer: Mapping[str, Any], result: Mapping[str, Any]) -> Judged:
    hidden = answer["hidden"]
    truth = tuple(_key(h["kind"], h["subject"]) for h in hidden)
    if "failed" in result:
        return Judged(
            answer["case"],
            answer["sort"],
            answer["tyre"],
            truth,
            truth,
            math.nan,
            None,
            False,
            False,
            False,
            "",
            (),
            False,
            (),
            math.nan,
            math.nan,
            failed=result["failed"],
        )
    verdict, each = result["verdict"], _beyond_what_was_said(truth, result)
    seen = tuple(t for t, nats in zip(truth, each, strict=True) if nats >= VISIBLE)
    place = (verdict["location"] or {}).get("injection", "")
    visible = [h for h, nats in zip(hidden, each, strict=True) if nats >= VISIBLE]
    places = {p for h in visible for p in h["places"]}
    said = tuple(_key(e["name"], e["subject"]) for e in verdict["effects"])
    gain = result["ideal"]["gain"]
    return Judged(
        case=answer["case"],
        sort=answer["sort"],
        tyre=answer["tyre"],
        truth=truth,
        seen=seen,
        nats=gain,
        expected=True if seen else (False if gain < NOBODY_SEES else None),
        alarm=verdict["mismatch"]["found"],
        unknown=verdict["unknown"]["found"],
        located=place in places,
        place=place,
        said=said,
        named=bool(seen) and _exact(truth, seen, said, verdict["equivalents"]),
        numbers=tuple(_numbers(hidden, verdict["effects"])),
        share=_share(result),
        seconds=result["seconds"]["analysis"],
        curve=_curve(result),
        formula=_formula(result),
        said_hidden=set(truth) <= set(verdict["not_excited"]),
    )


def _beyond_what_was_said(truth: Sequence[str], result: Mapping[str, Any]) -> list[float]:
    """Nats of each missing thing, in the presence of the others.

    The observer fits the truth without one of its things from where the truth is, and may end in a
    worse point than need be. Where other things of the truth were named and nothing else, their fit
    is another such point: what is not said there is worth no more than that fit lacks.
    """
    each, effects = list(result["ideal"]["each"]), result["verdict"]["effects"]
    said = {_key(e["name"], e["subject"]) for e in effects}
    if not said or not said < set(truth):
        return each
    lacking = result["ideal"]["gain"] - effects[0]["gain"]
    return [
        nats if thing in said else min(nats, lacking)
        for thing, nats in zip(truth, each, strict=True)
    ]


def _key(name: str, subject: str) -> str:
    return f"{name}.{subject}" if subject else name


def _exact(
    truth: Sequence[str], seen: Sequence[str], said: Sequence[str], classes: Sequence[Sequence[str]]
) -> bool:
    """Whether all that is visible was named, itself or in its class, and nothing else."""
    meant = {name: {name}.union(*(set(c) for c in classes if name in c)) for name in said}
    all_named = all(any(t in names for names in meant.values()) for t in seen)
    return all_named and all(names & set(truth) for names in meant.values())


def _numbers(
    hidden: Sequence[Mapping[str, Any]], effects: Sequence[Mapping[str, Any]]
) -> Iterable[Told]:
    """Every number that both formulas mean, with its interval."""
    told = {_key(e["name"], e["subject"]): e["parameters"] for e in effects}
    for h in hidden:
        key = _key(h["kind"], h["subject"])
        for p in told.get(key, ()):
            name, (low, high) = p["name"], p["interval"]
            comparable = name in BY_NAME[h["kind"]].like and name in h["parameters"]
            if comparable and None not in (low, high):
                yield Told(key, name, h["parameters"][name], low, high)


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


def _formula(result: Mapping[str, Any]) -> float:
    """Share of what the true physics gains that the library's formula reaches."""
    possible = result["ideal"].get("difference")
    return result["ideal"]["gain"] / possible if possible and possible > VISIBLE else math.nan


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
        wrong = "not named" if c.unknown or not c.said else "wrong name"
        short = c.formula < FAITHFUL
        return f"{wrong}; its formula reaches {100 * c.formula:.0f} %" if short else wrong
    return _place_wrong(c)


def _place_wrong(c: Judged) -> str:
    return "" if c.located or c.sort == UNEXCITED else "wrong injection point"
