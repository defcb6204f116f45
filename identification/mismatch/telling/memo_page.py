"""The memo as a page that needs nothing but a browser."""

from collections.abc import Callable, Iterator
from importlib.resources import files

import jinja2
from markupsafe import Markup

from slipbench.identification.mismatch.analysis import Analysis, accepted, described
from slipbench.identification.mismatch.telling.memo import (
    along,
    chance,
    circumstances,
    early_end,
    left_out,
    sentence,
    shown,
    shown_error,
)
from slipbench.identification.mismatch.telling.pictures import curve_svg, proof_svg
from slipbench.identification.mismatch.telling.verdict import Verdict

SHOWN = 5  # curves of the table
RESIDUAL_TEST = 3  # steps before it
NOT_IN_THE_FILE = (
    "acts along a quantity that no file can hold: the improved file has the calibrated parameters"
    " without it"
)


def memo_page(a: Analysis, verdict: Verdict) -> str:
    """HTML page: the sentence, the evidence, competing explanations, open questions."""
    certain = [c for c in a.before if c.certain]
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {
        "words": lambda s: s.replace("_", " "),
        "short": lambda x: f"{x:.4g}",
        "along": along,
        "in_file_unit": lambda p, e: shown(p, e, verdict),
        "error_in_file_unit": lambda e: shown_error(e, verdict),
    }
    style = files("slipbench.identification.report") / "report.css"
    page = files("slipbench.identification.mismatch.telling") / "memo.html"
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
        curves=certain[1 : 1 + SHOWN],
        proof=_figure(lambda: proof_svg(a.proof, verdict.headline, verdict.written))
        if a.proof
        else "",
        open=list(_open(a, verdict)),
    )


def _figure(draw: Callable[[], str]) -> Markup:
    """Figure, or the reason why it could not be drawn: the page is written all the same."""
    try:
        return Markup(draw())
    except Exception as fault:
        return Markup('<p class="note">Not drawn: {}</p>').format(described("figure", fault))


def in_the_file(a: Analysis) -> bool:
    """Tell whether the free curve that stands is one that a file can hold."""
    return a.free is None or len(accepted(a).candidates) > len(a.free.beside)


def _open(a: Analysis, verdict: Verdict) -> Iterator[tuple[str, str]]:
    """Yield what these recordings cannot decide: heading and text."""
    left = [c for c in a.after if c.certain]
    if left:
        yield ("residual", f"{left[0].place}{along(left[0].regressor)}, {left[0].gain:.0f} nats")
    elif a.done > RESIDUAL_TEST:
        yield "residual", "no significant unmodelled dynamics"
    for when, test in zip(("calibrated", "improved"), verdict.lack_of_fit, strict=False):
        yield f"lack of fit, {when}", f"F = {test.f:.3g}, p = {test.p_value:.2g} (repeated trials)"
    for names in verdict.equivalents:
        yield "indistinguishable", ", ".join(names).replace("_", " ")
    if verdict.not_excited:
        yield "not excited", ", ".join(verdict.not_excited).replace("_", " ")
    if not in_the_file(a):
        yield "the curve", NOT_IN_THE_FILE
    if verdict.not_told:
        yield "not identifiable", ", ".join(verdict.not_told)
    for told in left_out(verdict):
        yield "left out", told
    if verdict.next_trial:
        yield "next trial", str(verdict.next_trial["why"])
