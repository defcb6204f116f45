"""Report of a session: one self-contained HTML file."""

from collections.abc import Mapping
from importlib.resources import files
from typing import Any

import jinja2
from markupsafe import Markup

from slipbench.identification.models.actuator_comparison import Comparison, answer
from slipbench.identification.report import drawing
from slipbench.identification.report.bode import bode
from slipbench.identification.session.day import Day, Pooled, Results, explanation, headline
from slipbench.identification.session.margins import OF_THE_MOTORCYCLE

HEAD = ("run", "verdict", "reason", "band / Hz", "coherence", "to earlier repeats", "least margin")


def page(day: Day, found: Results) -> str:
    """Report as HTML text."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.from_string(
        (files("slipbench.identification.session") / "session.html").read_text(encoding="utf-8")
    )
    style = files("slipbench.identification.report") / "report.css"
    with drawing.style():
        drawn = [(one, _caption(one), _figure(one)) for one in found.pooled]
    return template.render(
        style=Markup(style.read_text(encoding="utf-8")),
        title=day.name,
        description=day.description,
        headline=headline(day),
        head=HEAD,
        runs=[_row(run.name, run.look) for run in day.runs],
        incomplete=day.incomplete,
        drawn=drawn,
        against=_against(found),
        explanation=explanation(day),
        memo=day.memo,
        selected=day.selected,
        designed=day.designed,
        next_steps=found.next_steps,
    )


def _figure(one: Pooled) -> Markup:
    return Markup(drawing.svg(bode([one.response]), f"response-{one.trial}"))


def _caption(one: Pooled) -> str:
    several = f"{len(one.runs)} runs" if len(one.runs) > 1 else "1 run"
    return (
        f"First harmonic at {one.point}, {several} ({', '.join(one.runs)}), 95 % interval:"
        f" {one.response.method}. Faded: coherence below 0.8 or 95 % interval wider than half the"
        " gain. A Birge ratio above 1: the runs differ by more than their noise."
    )


def _against(found: Results) -> str:
    if isinstance(found.against, Comparison):
        return answer(found.against)
    return f"Not compared: {found.against.reason}."


def _row(name: str, look: Mapping[str, Any]) -> tuple[str, ...]:
    band, found = look.get("reliable_band"), look.get("repeatability")
    coherence = look.get("coherence")
    return (
        name,
        str(look.get("verdict", "none")),
        str(look.get("reason", "")),
        f"{band[0]:.2g} to {band[1]:.3g}" if band else "",
        "" if coherence is None else f"{coherence:.3f}",
        f"{found['distance']:.1%} ({found['expected']:.1%} noise)" if found else "",
        _margin(look.get("margins", {})),
    )


def _margin(margins: Mapping[str, float]) -> str:
    known = {name: margins[name] for name in OF_THE_MOTORCYCLE if name in margins}
    if not known:
        return ""
    name = min(known, key=known.__getitem__)
    return f"{name.replace('_', ' ')} {known[name]:.0%}"
