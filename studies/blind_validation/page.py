"""Page of the blind validation: rates, figures, misses, method and command."""

import math
import textwrap
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipbench.identification.mismatch.thresholds import FORMULA_WIDTH
from slipbench.studies.blind_validation.counting import Figure, figures
from slipbench.studies.blind_validation.generator.fault_types import LIBRARY
from slipbench.studies.blind_validation.generator.outside import OUTSIDE
from slipbench.studies.blind_validation.posterior import ranks_of, uniformity
from slipbench.studies.blind_validation.score import NOT_VISIBLE, VISIBLE, ScoredCase, misses
from slipbench.studies.blind_validation.shortfalls import every_curve, every_interval, every_miss

METHOD = """
Every motorcycle is drawn at random from the range of its class. Every parameter of its vehicle file
has a normally distributed error, whose 95 % half width the file states. Each case has four training
trials and three held-out trials of 8 to 20 s: sweeps, multisines, blips, coasting, spark. In a tenth
of the cases the errors of the vehicle file are uniform up to three of the stated standard deviations.
Half of the tyres follow another formula (brush, Dugoff, Burckhardt). Wind and grade have correlation
times of 1 to 12 s, drawn for each case, as slow as what an analysis takes for slow. Bumps, combustion variation, sensor noise, quantization, jitter, tooth-pitch tolerance,
clock drift and a bus with arbitration are in every recording and in no model. The bus repeats up to
0.2 % of the frames, and the logger loses up to 0.4 % of them in bursts, both at random times. About half
of the sensors have a filter (low-pass of first order, moving mean) whose time the vehicle file states;
a filter of unstated time is a hidden effect. Effects outside the library act over the whole record (cold
oil, drifting torque, drifting scale of a sensor, crouching rider, retracting brake pads), at places, or
in shapes that no effect of the library has. A name that describes such an effect fairly (a scale for a
drifting scale of the same sensor) is no wrong name. Hidden effects have
their own formulas where the literature has several: LuGre bristles for stiction, a tyre with
relaxation in slip, a backlash that cannot pull, Dahl friction. The recordings pass through the
database into run folders, which are read as any others. The ground truth is generated first, and its
SHA-256 is stored before the first analysis. The
ideal observer subtracts the difference that the hidden effects make, taken from the generator without
noise, and calibrates again. The rank of the truth is taken in a normal posterior whose 95 % interval is
the stated one.
"""


@dataclass(frozen=True)
class Provenance:
    """Provenance of a study.

    figures: folder of the figures relative to the page. observed: fingerprint of the source code with
    which the ideal observer was recomputed after the study; empty where it was not.
    """

    command: str
    fingerprint: str
    source: str
    requested: int
    figures: str
    observed: str = ""


def page(cases: Sequence[ScoredCase], made: Provenance) -> str:
    """Text of docs/blind_validation.md."""
    counted = figures(cases)
    return "\n".join(
        [
            "# Blind validation",
            "",
            *_opening(cases, made),
            "",
            "## Goals",
            "",
            *_goals(counted),
            "",
            f"![Every rate with its 95 % interval]({made.figures}/validation_rates.png)",
            "",
            "## Visibility of the hidden effects",
            "",
            *_visible(cases),
            "",
            f"![Outcome over visibility]({made.figures}/validation_visibility.png)",
            "",
            "## Results by effect",
            "",
            *_kinds(cases),
            "",
            "## Confusion",
            "",
            *_confusion(cases),
            "",
            "## Misses",
            "",
            *every_miss(cases),
            "",
            "## Calibration of the intervals",
            "",
            *_calibration(cases, made),
            "",
            "## Intervals that do not contain the truth",
            "",
            *every_interval(cases),
            "",
            "## Free curves below their goal",
            "",
            *every_curve(cases),
            "",
            "## Processor time",
            "",
            *_times(cases),
            "",
            "## Method",
            "",
            *_method(),
            "",
            "## Command",
            "",
            *_repeat(made),
            "",
        ]
    )


def _opening(cases: Sequence[ScoredCase], made: Provenance) -> list[str]:
    categories = Counter(c.category for c in cases)
    counts = ", ".join(f"{count} {name}" for name, count in categories.most_common())
    tyres = sum(c.tyre != "magic formula" for c in cases)
    remaining = made.requested - len(cases)
    lines = textwrap.wrap(
        "Hidden cases from a generator with its own equations, step size, integrator and disturbances,"
        f" analysed by `slipbench explain`: {len(cases)} cases ({counts}); in {tyres} of them the"
        " tyre formula differs from that of the simulation. The command at the end of this page"
        " creates it.",
        95,
    )
    if failed := [c for c in cases if c.failed]:
        lines += ["", f"**In {len(failed)} cases the analysis failed; they count as missed.**"]
    if remaining:
        lines += [
            "",
            f"**The study is not complete: {remaining} of {made.requested} cases are open.**",
        ]
    return lines


def _goals(counted: Iterable[Figure]) -> list[str]:
    lines = ["| | result | 95 % interval | goal | |", "|---|---|---|---|---|"]
    for r in counted:
        low, high = r.interval
        interval = f"{low:.1f} to {high:.1f} %" if r.total else ""
        lines.append(f"| {r.text} | {r.shown} | {interval} | {_goal(r)} | {_met(r)} |")
    return lines


def _goal(rate: Figure) -> str:
    if not rate.has_goal:
        return "no goal"
    if rate.low and math.isfinite(rate.high):
        return f"{rate.low:g} to {rate.high:g} %"
    return f"at least {rate.low:g} %" if rate.low else f"at most {rate.high:g} %"


def _met(rate: Figure) -> str:
    return {True: "met", False: "**not met**", None: "open" if rate.has_goal else ""}[rate.met]


def _visible(cases: Iterable[ScoredCase]) -> list[str]:
    with_truth = [c for c in cases if c.truth and not c.failed]
    visible = sum(c.expected is True for c in with_truth)
    not_visible = sum(c.expected is False for c in with_truth)
    return textwrap.wrap(
        f"Of {len(with_truth)} cases with a hidden effect, the ideal observer, who knows the ground"
        f" truth, gains at least {VISIBLE:g} nats in {visible} (visible) and less than"
        f" {NOT_VISIBLE:g} nats in {not_visible} (not visible: calibration compensates the effect, or"
        " the trials do not excite it). Visible cases count in the table above; an alarm in a case"
        " that is not visible counts as a false alarm. Cases in between are not scored.",
        95,
    )


def _kinds(cases: Sequence[ScoredCase]) -> list[str]:
    lines = [
        "| hidden effect | cases | visible | detected | injection point correct | named |",
        "|---|---|---|---|---|---|",
    ]
    for kind in (*LIBRARY, *OUTSIDE):
        chosen = [c for c in cases if len(c.truth) == 1 and c.truth[0].split(".")[0] == kind.name]
        if not chosen:
            continue
        visible = [c for c in chosen if c.visible]
        named = f"{sum(c.named for c in visible)}" if kind.inside else "not in the library"
        lines.append(
            f"| {kind.name.replace('_', ' ')} | {len(chosen)} | {len(visible)} |"
            f" {sum(c.alarm for c in visible)} | {sum(c.located for c in visible)} | {named} |"
        )
    return lines


def _confusion(cases: Sequence[ScoredCase]) -> list[str]:
    """Table of the verdicts for visible single effects that were not named correctly."""
    verdicts: dict[str, Counter[str]] = {}
    for c in cases:
        if len(c.truth) == 1 and c.visible and not c.named:
            claim = " + ".join(c.reported) or (
                "no name, free curve" if c.unknown else "no mismatch"
            )
            verdicts.setdefault(c.truth[0], Counter())[claim] += 1
    if not verdicts:
        return ["Every visible single effect was named correctly."]
    lines = ["| hidden effect | verdict |", "|---|---|"]
    for truth, claims in sorted(verdicts.items()):
        row = "; ".join(f"{claim} ({n})" for claim, n in claims.most_common())
        lines.append(f"| {truth} | {row} |".replace("_", " "))
    return lines


def _calibration(cases: Sequence[ScoredCase], made: Provenance) -> list[str]:
    found = uniformity(ranks_of(cases))
    if found is None:
        return ["Too few numbers for a test of their ranks."]
    low, high = found.band
    lines = textwrap.wrap(
        f"Ranks of the truth in {len(found.ranks)} stated posteriors, in vehicle files that err as much"
        f" as they say. Intervals below {200 * FORMULA_WIDTH:g} % of their value are left out: most of"
        f" their width is the allowance for another formula of the same physics ({100 * FORMULA_WIDTH:g}"
        " %), and where the formula is the same, the truth is in their middle. Ranks of a calibrated"
        " analysis are uniform: many low and high ones show intervals"
        f" that are too narrow. Kolmogorov-Smirnov: distance {found.distance:.3f}, p = {found.ks:.2g};"
        f" chi-square over {len(found.counts)} bins: p = {found.chi_square:.2g}. Counts:"
        f" {', '.join(map(str, found.counts))}; 99 % of the bins of uniform ranks hold {low} to {high}.",
        95,
    )
    return [*lines, "", f"![Ranks of the truth]({made.figures}/validation_ranks.png)"]


def _times(cases: Sequence[ScoredCase]) -> list[str]:
    """Table of processor times of an analysis, which depend on the machine."""
    rows = [
        ("all cases", [c for c in cases if not c.failed]),
        ("nothing missing", [c for c in cases if not c.failed and not c.truth]),
        ("two or three effects", [c for c in cases if not c.failed and len(c.truth) > 1]),
    ]
    lines = [
        "Seconds of processor time, which depend on the machine, for seven recordings.",
        "",
        "| | cases | median | most | median per second of recording |",
        "|---|---|---|---|---|",
    ]
    for text, chosen in rows:
        if chosen:
            spent = np.array([c.seconds for c in chosen])
            rate = np.median(spent / np.array([c.recorded for c in chosen]))
            lines.append(
                f"| {text} | {len(chosen)} | {np.median(spent):.1f} s | {spent.max():.1f} s |"
                f" {rate:.2f} s |"
            )
    return lines


def _method() -> list[str]:
    return textwrap.wrap(METHOD.strip(), 95)


def _repeat(made: Provenance) -> list[str]:
    return [
        "```",
        made.command,
        "```",
        "",
        f"Ground truth: `{made.fingerprint}` (SHA-256).",
        f"Source code that determines the results: `{made.source[:16]}`.",
        "The results do not depend on the number of workers. After an interruption the same command",
        "continues the study.",
        *_observed(made),
    ]


def _observed(made: Provenance) -> list[str]:
    if not made.observed:
        return []
    lines = textwrap.wrap(
        "The ideal observer was recomputed after the study with corrected source code"
        f" (`{made.observed[:16]}`), by the same command with `--observe-again`. No verdict changed.",
        95,
    )
    return ["", *lines]


def seconds(cases: Iterable[ScoredCase]) -> str:
    """Processor time of an analysis as text; it depends on the machine."""
    found = np.array([c.seconds for c in cases if not c.failed])
    if not found.size:
        return "no analysis"
    middle, most = np.median(found), found.max()
    return f"processor time per analysis: median {middle:.1f} s, maximum {most:.1f} s"


def headline(results: Sequence[Mapping[str, Any]], cases: Sequence[ScoredCase]) -> str:
    """Summary in a line."""
    return f"{len(results)} cases, {len(misses(cases))} misses; {seconds(cases)}"
