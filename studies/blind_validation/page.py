"""The page of the proof: the table, the figures, what fell short, and how to repeat it."""

import math
import textwrap
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipbench.studies.blind_validation.counting import Figure, figures
from slipbench.studies.blind_validation.generator.fault_types import LIBRARY, OUTSIDE
from slipbench.studies.blind_validation.score import NOBODY_SEES, VISIBLE, Judged, misses
from slipbench.studies.blind_validation.shortfalls import every_curve, every_interval, every_miss

METHOD = """
Every motorcycle is drawn anew from the range of its class. Its vehicle file errs in every number by
a normal error whose 95 % half width it tells. Four trials to learn from and three held out, of 12 s
each: sweeps, multisines, blips, coasting, spark. Wind, undulation, bumps, scatter of combustion,
noise, quanta, jitter and tolerance of the teeth, drifting clocks and a bus with arbitration are in
every recording and in no model. What is missing follows formulas of its own where the literature
has others: LuGre's bristles for stiction, a tyre that relaxes in its slip, a gap that cannot pull,
Dahl's friction. Recordings go over the database into run folders, which are read as any others are.
The answers are drawn first, and their SHA-256 is written before the first analysis. Of a miss it is
said how much of the true gain the library's formula reaches, started at the truth, where that is
less than 70 %: there the library means another physics by that name, or calibration has gone where
no fit finds back from.
"""


@dataclass(frozen=True)
class Made:
    """How the study was made.

    figures: folder of the figures, as the page links them. observed: source text with which what
    there was to see was judged anew after the study; empty where it was not.
    """

    command: str
    fingerprint: str
    source: str
    wanted: int
    figures: str
    observed: str = ""


def page(cases: Sequence[Judged], made: Made) -> str:
    """Return the text of docs/blind_validation.md."""
    counted = figures(cases)
    return "\n".join(
        [
            "# The proof",
            "",
            *_opening(cases, made),
            "",
            "## Goals",
            "",
            *_goals(counted),
            "",
            f"![Every share with its interval]({made.figures}/validation_rates.png)",
            "",
            "## What there was to see",
            "",
            *_visible(cases),
            "",
            f"![Outcome over visibility]({made.figures}/validation_visibility.png)",
            "",
            "## Kind by kind",
            "",
            *_kinds(cases),
            "",
            "## Confusion",
            "",
            *_confusion(cases),
            "",
            "## Every miss",
            "",
            *every_miss(cases),
            "",
            "## Every interval that misses the truth",
            "",
            *every_interval(cases),
            "",
            "## Every free curve below its goal",
            "",
            *every_curve(cases),
            "",
            "## How it is made",
            "",
            *_method(),
            "",
            "## Repeat it",
            "",
            *_repeat(made),
            "",
        ]
    )


def _opening(cases: Sequence[Judged], made: Made) -> list[str]:
    sorts = Counter(c.sort for c in cases)
    told = ", ".join(f"{count} {sort}" for sort, count in sorts.most_common())
    tyres = sum(c.tyre != "magic formula" for c in cases)
    left = made.wanted - len(cases)
    lines = textwrap.wrap(
        "Sealed cases out of a generator with its own equations, step, integrator and disturbances,"
        f" analysed by `slipbench explain`: {len(cases)} cases ({told}); in {tyres} of them the"
        " tyre follows another formula than the simulation's. This page is made by the command at"
        " its end.",
        95,
    )
    if failed := [c for c in cases if c.failed]:
        lines += ["", f"**In {len(failed)} cases the engine failed; they count as missed.**"]
    if left:
        lines += ["", f"**The study is not complete: {left} of {made.wanted} cases are open.**"]
    return lines


def _goals(counted: Iterable[Figure]) -> list[str]:
    lines = ["| | counted | 95 % interval | goal | |", "|---|---|---|---|---|"]
    for r in counted:
        low, high = r.interval
        interval = f"{low:.1f} to {high:.1f} %" if r.total else ""
        lines.append(f"| {r.text} | {r.shown} | {interval} | {_goal(r)} | {_met(r)} |")
    return lines


def _goal(rate: Figure) -> str:
    if not rate.wanted:
        return "none set"
    if rate.low and math.isfinite(rate.high):
        return f"{rate.low:g} to {rate.high:g} %"
    return f"at least {rate.low:g} %" if rate.low else f"at most {rate.high:g} %"


def _met(rate: Figure) -> str:
    return {True: "met", False: "**not met**", None: "open" if rate.wanted else ""}[rate.met]


def _visible(cases: Iterable[Judged]) -> list[str]:
    with_truth = [c for c in cases if c.truth and not c.failed]
    seen = sum(c.expected is True for c in with_truth)
    nobody = sum(c.expected is False for c in with_truth)
    return textwrap.wrap(
        f"Of {len(with_truth)} cases in which something is missing, somebody who knows it gains"
        f" {VISIBLE:g} nats and more in {seen}, and less than {NOBODY_SEES:g} in {nobody}: there"
        " calibration hides it, or the trials do not excite it. The former count in the table"
        " above; to claim the latter counts as a false alarm. Between the two nothing is counted.",
        95,
    )


def _kinds(cases: Sequence[Judged]) -> list[str]:
    lines = [
        "| missing | cases | visible | alarm | place right | named |",
        "|---|---|---|---|---|---|",
    ]
    for kind in (*LIBRARY, *OUTSIDE):
        chosen = [c for c in cases if len(c.truth) == 1 and c.truth[0].split(".")[0] == kind.name]
        if not chosen:
            continue
        seen = [c for c in chosen if c.seen]
        named = f"{sum(c.named for c in seen)}" if kind.inside else "in no library"
        lines.append(
            f"| {kind.name.replace('_', ' ')} | {len(chosen)} | {len(seen)} |"
            f" {sum(c.alarm for c in seen)} | {sum(c.located for c in seen)} | {named} |"
        )
    return lines


def _confusion(cases: Sequence[Judged]) -> list[str]:
    """What was said of every visible single effect that was not named rightly."""
    said: dict[str, Counter[str]] = {}
    for c in cases:
        if len(c.truth) == 1 and c.seen and not c.named:
            claim = " + ".join(c.said) or ("no name, a free curve" if c.unknown else "nothing")
            said.setdefault(c.truth[0], Counter())[claim] += 1
    if not said:
        return ["Every visible single effect was named."]
    lines = ["| missing | said instead |", "|---|---|"]
    for truth, claims in sorted(said.items()):
        told = "; ".join(f"{claim} ({n})" for claim, n in claims.most_common())
        lines.append(f"| {truth} | {told} |".replace("_", " "))
    return lines


def _method() -> list[str]:
    return textwrap.wrap(METHOD.strip(), 95)


def _repeat(made: Made) -> list[str]:
    return [
        "```",
        made.command,
        "```",
        "",
        f"Sealed answers: `{made.fingerprint}` (SHA-256).",
        f"Source text that decides the results: `{made.source[:16]}`.",
        "The table is the same for any number of workers, and after any interruption: the same",
        "command goes on where it stopped.",
        *_observed(made),
    ]


def _observed(made: Made) -> list[str]:
    if not made.observed:
        return []
    told = textwrap.wrap(
        "What there was to see was judged anew after the study, with a corrected observer (source"
        f" text `{made.observed[:16]}`), by the same command with `--observe-again`. No verdict"
        " changed by it.",
        95,
    )
    return ["", *told]


def seconds(cases: Iterable[Judged]) -> str:
    """Tell how long an analysis took here; that is the machine's, and not on the page."""
    found = np.array([c.seconds for c in cases if not c.failed])
    if not found.size:
        return "no analysis"
    middle, most = np.median(found), found.max()
    return f"{middle:.1f} s of processor time an analysis (median), {most:.1f} at most"


def headline(results: Sequence[Mapping[str, Any]], cases: Sequence[Judged]) -> str:
    """Say it in a line."""
    return f"{len(results)} cases, {len(misses(cases))} misses; {seconds(cases)}"
