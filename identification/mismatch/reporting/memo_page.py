"""Render the memo as a self-contained HTML page."""

from collections.abc import Callable, Iterator
from importlib.resources import files

import jinja2
from markupsafe import Markup

from slipbench.identification.mismatch.analysis import Analysis, accepted, failure_message
from slipbench.identification.mismatch.reporting.check_in_words import check_lines
from slipbench.identification.mismatch.reporting.evidence_figure import Residuals, evidence_svg
from slipbench.identification.mismatch.reporting.hypotheses import hypotheses
from slipbench.identification.mismatch.reporting.improvement_in_words import ratio, shown_by
from slipbench.identification.mismatch.reporting.memo import (
    chance,
    circumstances,
    early_end,
    far_in_words,
    left_out,
    regressor_in_words,
    sentence,
    shown,
    shown_error,
    tied,
)
from slipbench.identification.mismatch.reporting.pictures import curve_svg
from slipbench.identification.mismatch.reporting.verdict import INTERVALS, Verdict
from slipbench.identification.mismatch.simulation.written_units import WrittenUnits

RESIDUAL_TEST = 3  # number of steps before the residual test
NOT_IN_THE_FILE = (
    "acts along a quantity that no file can hold: the improved file has the calibrated parameters"
    " without it"
)


def memo_page(a: Analysis, verdict: Verdict) -> str:
    """Return the HTML page: finding, figures, hypotheses, limitations and numbers."""
    significant = [c for c in a.before if c.significant]
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {
        "words": lambda s: s.replace("_", " "),
        "short": lambda x: f"{x:.4g}",
        "along": regressor_in_words,
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
        curve=_figure(lambda: curve_svg(significant[0], a.free.curve if a.free else None, a.system))
        if significant and verdict.location
        else "",
        evidence=_figure(lambda: evidence_svg(*_evidence(a, verdict)))
        if verdict.improvement
        else "",
        shown=_shown_output(verdict),
        around=_is_tooth_pattern(verdict),
        hypotheses=hypotheses(a, verdict),
        intervals=INTERVALS,
        undecided=list(_indistinguishable(verdict)),
        unexcited=list(_not_excited(verdict)),
        check=list(check_lines(verdict)),
        open=list(_limitations(a, verdict)),
    )


def _shown_output(verdict: Verdict) -> str:
    improvement = verdict.improvement
    return shown_by(improvement, verdict.headline).output if improvement else verdict.headline


def _is_tooth_pattern(verdict: Verdict) -> bool:
    """Return whether the figure shows a tooth pattern over one turn of a wheel."""
    improvement = verdict.improvement
    return improvement is not None and shown_by(improvement, verdict.headline).band is None


def _evidence(a: Analysis, verdict: Verdict) -> tuple[Residuals, str, WrittenUnits]:
    """Return the content of the figure: residuals, the regressor and the units of the file."""
    assert verdict.improvement is not None
    shown = shown_by(verdict.improvement, verdict.headline)
    regressor = verdict.effects[0].regressor if verdict.effects else ""
    regressor = a.free.curve.regressor if a.free and not regressor else regressor
    residuals = Residuals.of(a.held_out_runs[1:], shown, verdict.written)
    return residuals, regressor, verdict.written


def _figure(draw: Callable[[], str]) -> Markup:
    """Return the figure, or a note with the error, so that the page is written in any case."""
    try:
        return Markup(draw())
    except Exception as error:
        return Markup('<p class="note">Not drawn: {}</p>').format(failure_message("figure", error))


def in_the_file(a: Analysis) -> bool:
    """Return whether the file can hold the accepted free curve, if there is one."""
    return a.free is None or len(accepted(a).candidates) > len(a.free.beside)


def _indistinguishable(verdict: Verdict) -> Iterator[tuple[str, str]]:
    """Yield the indistinguishable names, and the trial that would distinguish them."""
    for names in verdict.equivalents:
        yield "indistinguishable", tied(names, verdict).replace("_", " ")
    if verdict.next_trial:
        yield "next trial", str(verdict.next_trial["why"])


def _not_excited(verdict: Verdict) -> Iterator[tuple[str, str]]:
    """Yield effects and parameters that are not identifiable from these recordings."""
    if verdict.not_excited:
        yield "effects", ", ".join(verdict.not_excited).replace("_", " ")
    if verdict.not_told:
        yield "parameters", ", ".join(verdict.not_told)


def _limitations(a: Analysis, verdict: Verdict) -> Iterator[tuple[str, str]]:
    """Yield the limitations of the result: heading and text."""
    residual_curves = [c for c in a.after if c.significant]
    if residual_curves:
        yield (
            "residual",
            f"{residual_curves[0].place}{regressor_in_words(residual_curves[0].regressor)},"
            f" {residual_curves[0].log_likelihood_gain:.0f} nats",
        )
    elif a.done > RESIDUAL_TEST:
        yield "residual", "no significant unmodelled dynamics"
    for system, test in zip(("calibrated", "improved"), verdict.lack_of_fit, strict=False):
        yield (
            f"lack of fit, {system}",
            f"F = {test.f:.3g}, p = {test.p_value:.2g} (repeated trials)",
        )
    if not in_the_file(a):
        yield "the curve", NOT_IN_THE_FILE
    if verdict.far:
        yield "far from the file", far_in_words(verdict.far)
    for message in left_out(verdict):
        yield "left out", message
