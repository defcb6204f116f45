"""The memo as a page that needs nothing but a browser."""

from collections.abc import Callable, Iterator
from importlib.resources import files

import jinja2
from markupsafe import Markup

from slipbench.identification.mismatch.analysis import Analysis, accepted, described
from slipbench.identification.mismatch.reporting.check_in_words import check_lines
from slipbench.identification.mismatch.reporting.evidence_figure import Residuals, evidence_svg
from slipbench.identification.mismatch.reporting.hypotheses import hypotheses
from slipbench.identification.mismatch.reporting.improvement_in_words import ratio, shown_by
from slipbench.identification.mismatch.reporting.memo import (
    along,
    chance,
    circumstances,
    early_end,
    far_in_words,
    left_out,
    sentence,
    shown,
    shown_error,
    tied,
)
from slipbench.identification.mismatch.reporting.pictures import curve_svg
from slipbench.identification.mismatch.reporting.verdict import INTERVALS, Verdict
from slipbench.identification.mismatch.simulation.written_units import WrittenUnits

RESIDUAL_TEST = 3  # steps before it
NOT_IN_THE_FILE = (
    "acts along a quantity that no file can hold: the improved file has the calibrated parameters"
    " without it"
)


def memo_page(a: Analysis, verdict: Verdict) -> str:
    """HTML page: the finding, the figure that shows it, hypotheses, what stays open, the numbers."""
    certain = [c for c in a.before if c.certain]
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {
        "words": lambda s: s.replace("_", " "),
        "short": lambda x: f"{x:.4g}",
        "along": along,
        "nats": lambda x: "" if x is None else f"{x:.0f}",
        "ratio": lambda c: ratio(c).removeprefix("ratio "),
        "in_file_unit": lambda p, e: shown(p, e, verdict),
        "error_in_file_unit": lambda e: shown_error(e, verdict),
    }
    style = files("slipbench.identification.report") / "report.css"
    page = files("slipbench.identification.mismatch.reporting") / "memo.html"
    return environment.from_string(page.read_text(encoding="utf-8")).render(
        name=a.system.name,
        style=Markup(style.read_text(encoding="utf-8")),
        training=[r.name for r in a.training.records],
        held_out=[r.name for r in a.held_out.records] if a.held_out else [],
        sentence=sentence(verdict),
        verdict=verdict,
        when=circumstances(verdict.location, verdict.written) if verdict.location else "",
        early=early_end(verdict),
        p_value=chance(verdict),
        curve=_figure(lambda: curve_svg(certain[0], a.free.curve if a.free else None, a.system))
        if certain and verdict.location
        else "",
        evidence=_figure(lambda: evidence_svg(*_evidence(a, verdict)))
        if verdict.improvement
        else "",
        shown=_shown(verdict),
        around=_around_a_turn(verdict),
        hypotheses=hypotheses(a, verdict),
        intervals=INTERVALS,
        undecided=list(_undecided(verdict)),
        unexcited=list(_unexcited(verdict)),
        check=list(check_lines(verdict)),
        open=list(_open(a, verdict)),
    )


def _shown(verdict: Verdict) -> str:
    found = verdict.improvement
    return shown_by(found, verdict.headline).output if found else verdict.headline


def _around_a_turn(verdict: Verdict) -> bool:
    """Tell whether the figure is around a turn of a wheel."""
    found = verdict.improvement
    return found is not None and shown_by(found, verdict.headline).band is None


def _evidence(a: Analysis, verdict: Verdict) -> tuple[Residuals, str, WrittenUnits]:
    """Return what the figure shows: residuals, the regressor and the units of the file."""
    assert verdict.improvement is not None
    shown = shown_by(verdict.improvement, verdict.headline)
    along = verdict.effects[0].regressor if verdict.effects else ""
    along = a.free.curve.regressor if a.free and not along else along
    residuals = Residuals.of(a.proof[1:], shown, verdict.written)
    return residuals, along, verdict.written


def _figure(draw: Callable[[], str]) -> Markup:
    """Figure, or the reason why it could not be drawn: the page is written all the same."""
    try:
        return Markup(draw())
    except Exception as fault:
        return Markup('<p class="note">Not drawn: {}</p>').format(described("figure", fault))


def in_the_file(a: Analysis) -> bool:
    """Tell whether the free curve that stands is one that a file can hold."""
    return a.free is None or len(accepted(a).candidates) > len(a.free.beside)


def _undecided(verdict: Verdict) -> Iterator[tuple[str, str]]:
    """Yield what cannot be told apart, and the trial that would tell."""
    for names in verdict.equivalents:
        yield "indistinguishable", tied(names, verdict).replace("_", " ")
    if verdict.next_trial:
        yield "next trial", str(verdict.next_trial["why"])


def _unexcited(verdict: Verdict) -> Iterator[tuple[str, str]]:
    """Yield effects and parameters of which these recordings say nothing."""
    if verdict.not_excited:
        yield "effects", ", ".join(verdict.not_excited).replace("_", " ")
    if verdict.not_told:
        yield "parameters", ", ".join(verdict.not_told)


def _open(a: Analysis, verdict: Verdict) -> Iterator[tuple[str, str]]:
    """Yield what limits the result: heading and text."""
    left = [c for c in a.after if c.certain]
    if left:
        yield (
            "residual",
            f"{left[0].place}{along(left[0].regressor)}, {left[0].log_likelihood_gain:.0f} nats",
        )
    elif a.done > RESIDUAL_TEST:
        yield "residual", "no significant unmodelled dynamics"
    for when, test in zip(("calibrated", "improved"), verdict.lack_of_fit, strict=False):
        yield f"lack of fit, {when}", f"F = {test.f:.3g}, p = {test.p_value:.2g} (repeated trials)"
    if not in_the_file(a):
        yield "the curve", NOT_IN_THE_FILE
    if verdict.far:
        yield "far from the file", far_in_words(verdict.far)
    for told in left_out(verdict):
        yield "left out", told
