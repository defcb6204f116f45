"""Score verdicts against the ground truth.

A hidden effect counts as visible where the ideal observer, who knows it, gains 16 nats: a test of 48
effects at three magnitudes each, at a family-wise level of 5 %, then detects it in 95 % of the cases
(chi2 with two degrees of freedom at 0.05 / 144 is 16, half of it 8 nats; (sqrt(2 * 8) + 1.64)^2 / 2
= 16). Below 8 nats it counts as not visible.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from slipbench.identification.mismatch.thresholds import FORMULA_WIDTH
from slipbench.protocol.errors import InputError
from slipbench.studies.blind_validation.generator.case import ELSE, NOTHING, UNEXCITED
from slipbench.studies.blind_validation.generator.fault_types import BY_NAME

VISIBLE, NOT_VISIBLE = 16.0, 8.0  # nats
NORMAL_95 = 1.959964


@dataclass(frozen=True)
class Estimate:
    """A parameter that generator and library share, with estimate and 95 % interval. SI.

    careless: the vehicle file of the case errs more than it states.
    """

    effect: str
    parameter: str
    truth: float
    low: float
    high: float
    value: float = math.nan
    careless: bool = False

    @property
    def rank(self) -> float:
        """Rank of the truth in the stated posterior, 0 to 1; NaN where no posterior is stated.

        The posterior is normal on either side of the estimate, and its 95 % interval is the stated
        one. Ranks of a calibrated analysis are uniform (Talts et al., arXiv:1804.06788).
        """
        side = self.high if self.truth > self.value else self.low
        if not abs(side - self.value) > 0.0:
            return math.nan
        distance = (self.truth - self.value) / abs(side - self.value)
        return 0.5 * math.erfc(-NORMAL_95 * distance / math.sqrt(2.0))

    @property
    def from_recordings(self) -> bool:
        """Whether the width comes from the recordings, not from the allowance for another formula.

        The allowance is added in quadrature; an interval twice as wide has a seventh of its width
        from it.
        """
        return self.high - self.low > 2.0 * 2.0 * FORMULA_WIDTH * abs(self.value)

    @property
    def holds(self) -> bool:
        """Whether the interval contains the truth."""
        return self.low <= self.truth <= self.high


@dataclass(frozen=True)
class ScoredCase:
    """One scored case. truth: keys of the hidden effects; visible: those that can be detected.

    expected: alarm correct (True), wrong (False), or not scored (None). wrong_names: reported effects
    that do not even describe the hidden one fairly. share: of the gain of the ideal observer, reached
    by the reported effects; curve: of that on held-out recordings, by the free curve. seconds: of
    processor time; recorded: s of all recordings. memory: a hidden effect depends on the past.
    """

    case: int
    category: str
    tyre: str
    truth: tuple[str, ...]
    visible: tuple[str, ...]
    nats: float
    expected: bool | None
    alarm: bool
    unknown: bool
    located: bool
    injection_point: str
    reported: tuple[str, ...]
    named: bool
    numbers: tuple[Estimate, ...]
    share: float
    seconds: float
    curve: float = math.nan
    reported_not_excited: bool = False
    failed: str = ""
    careless: bool = False
    recorded: float = math.nan
    wrong_names: tuple[str, ...] = ()
    memory: bool = False


def scored(
    truths: Sequence[Mapping[str, Any]], results: Iterable[Mapping[str, Any]]
) -> list[ScoredCase]:
    """Scored cases. truths: ground truth by case number; results: of the study.

    Raises InputError where a result lacks a part of what is scored, or has one of another type.
    """
    found = []
    for result in results:
        try:
            found.append(_score(truths[result["case"]], result))
        except (KeyError, IndexError, TypeError, ValueError, AttributeError) as fault:
            raise InputError(
                "the result of a case is damaged or of another version",
                where=f"case {result['case']}",
                found=f"{type(fault).__name__}: {fault}",
                remedy="delete its file in results/ and run the same command without --score-only",
            ) from fault
    return found


def _score(ground_truth: Mapping[str, Any], result: Mapping[str, Any]) -> ScoredCase:
    hidden = ground_truth["hidden"]
    truth = tuple(_key(h["kind"], h["subject"]) for h in hidden)
    if "failed" in result:
        return ScoredCase(
            ground_truth["case"],
            ground_truth["category"],
            ground_truth["tyre"],
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
            careless=ground_truth["careless"],
        )
    verdict, each = result["verdict"], _visible_gains(truth, result)
    visible = tuple(t for t, nats in zip(truth, each, strict=True) if nats >= VISIBLE)
    point = (verdict["location"] or {}).get("injection", "")
    found_in = [h for h, nats in zip(hidden, each, strict=True) if nats >= VISIBLE]
    points = {p for h in found_in for p in h["places"]}
    reported = tuple(_key(e["name"], e["subject"]) for e in verdict["effects"])
    gain = result["ideal"]["gain"]
    return ScoredCase(
        case=ground_truth["case"],
        category=ground_truth["category"],
        tyre=ground_truth["tyre"],
        truth=truth,
        visible=visible,
        nats=gain,
        expected=True if visible else (False if gain < NOT_VISIBLE else None),
        alarm=verdict["mismatch"]["found"],
        unknown=verdict["unknown"]["found"],
        located=point in points,
        injection_point=point,
        reported=reported,
        named=bool(visible) and _exact(truth, visible, reported, verdict["equivalents"]),
        numbers=tuple(_numbers(hidden, verdict["effects"], ground_truth["careless"])),
        share=_share(result),
        seconds=result["seconds"]["analysis"],
        curve=_curve(result),
        reported_not_excited=set(truth) <= set(verdict["not_excited"]),
        careless=ground_truth["careless"],
        recorded=math.fsum(ground_truth["seconds"]),
        wrong_names=_wrong_names(hidden, reported),
        memory=any(BY_NAME[h["kind"]].memory for h in hidden),
    )


def _visible_gains(truth: Sequence[str], result: Mapping[str, Any]) -> list[float]:
    """Gain of each hidden effect in the presence of the others, nats.

    The observer fits the truth without one of its effects from the true parameters, and may end in a
    local minimum. Where the verdict names only other true effects, its fit is another such fit: an
    effect that it leaves out is worth no more than that fit lacks.
    """
    each, effects = list(result["ideal"]["each"]), result["verdict"]["effects"]
    reported = {_key(e["name"], e["subject"]) for e in effects}
    if not reported or not reported < set(truth):
        return each
    lacking = result["ideal"]["gain"] - effects[0]["gain"]
    return [
        nats if thing in reported else min(nats, lacking)
        for thing, nats in zip(truth, each, strict=True)
    ]


def _key(name: str, subject: str) -> str:
    return f"{name}.{subject}" if subject else name


def _exact(
    truth: Sequence[str],
    visible: Sequence[str],
    reported: Sequence[str],
    classes: Sequence[Sequence[str]],
) -> bool:
    """Whether exactly the visible effects were named, each itself or its equivalence class."""
    meant = {name: {name}.union(*(set(c) for c in classes if name in c)) for name in reported}
    all_named = all(any(t in names for names in meant.values()) for t in visible)
    return all_named and all(names & set(truth) for names in meant.values())


def _wrong_names(hidden: Sequence[Mapping[str, Any]], reported: Sequence[str]) -> tuple[str, ...]:
    """Reported effects whose names neither are those of the hidden effects nor describe one fairly.

    A fair name belongs to the same sensor as the hidden effect.
    """
    fair = {(name, h["subject"]) for h in hidden for name in BY_NAME[h["kind"]].near}
    wrong = []
    for key in reported:
        name, _, subject = key.partition(".")
        true = any(key == _key(h["kind"], h["subject"]) for h in hidden)
        near = any(name == n and subject in ("", s) for n, s in fair)
        if not true and not near:
            wrong.append(key)
    return tuple(wrong)


def _numbers(
    hidden: Sequence[Mapping[str, Any]], effects: Sequence[Mapping[str, Any]], careless: bool
) -> Iterable[Estimate]:
    """Every parameter that generator and library share, with its interval."""
    reported = {_key(e["name"], e["subject"]): e["parameters"] for e in effects}
    for h in hidden:
        key = _key(h["kind"], h["subject"])
        for p in reported.get(key, ()):
            name, (low, high) = p["name"], p["interval"]
            comparable = name in BY_NAME[h["kind"]].like and name in h["parameters"]
            if comparable and None not in (low, high):
                true = h["parameters"][name]
                yield Estimate(key, name, true, low, high, p["value"], careless)


def _share(result: Mapping[str, Any]) -> float:
    """Log-likelihood gain of the reported effects as a share of that of the ideal observer."""
    effects, possible = result["verdict"]["effects"], result["ideal"]["gain"]
    return effects[0]["gain"] / possible if effects and possible > VISIBLE else math.nan


def _curve(result: Mapping[str, Any]) -> float:
    """Share of the true effect's held-out log-likelihood gain that the free curve reaches."""
    curve = result.get("curve")
    if not curve or curve["possible"] <= VISIBLE:
        return math.nan
    return float(curve["confirmed"] / curve["possible"])


def misses(cases: Iterable[ScoredCase]) -> list[ScoredCase]:
    """Cases with a wrong or missing statement."""
    return [c for c in cases if what_is_wrong(c)]


def what_is_wrong(c: ScoredCase) -> str:
    """Error of a case in a few words; empty if there is none."""
    if c.failed:
        return "analysis failed"
    if c.expected is False and c.alarm:
        return "false alarm" if c.category == NOTHING else "alarm, effect not visible"
    if not c.visible:
        return ""
    if not c.alarm:
        return "not detected"
    if c.category == ELSE:
        return "wrong name, not in the library" if c.wrong_names else _place_wrong(c)
    if not c.named:
        return "not named" if c.unknown or not c.reported else "wrong name"
    return _place_wrong(c)


def _place_wrong(c: ScoredCase) -> str:
    return "" if c.located or c.category == UNEXCITED else "wrong injection point"
