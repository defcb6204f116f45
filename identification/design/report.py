"""The page about a designed controller."""

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path as File

import jinja2
import numpy as np
from markupsafe import Markup

from slipbench.identification.design.figures import nyquist, sensitivities, steps
from slipbench.identification.design.from_runs import Path
from slipbench.identification.design.gains import Gains
from slipbench.identification.design.mixed import Joint
from slipbench.identification.design.mixed_sensitivity import Synthesis
from slipbench.identification.design.widest import Designed, NoDesign
from slipbench.identification.report import drawing as d

HEAD = ("loop", "|T| to / Hz", "|S| held to / Hz", "gain margin / dB", "phase margin / deg", "M_s")
LAWS = (
    "law",
    "target followed to / Hz",
    "|T| to / Hz",
    "|S| held to / Hz",
    "gain margin / dB",
    "phase margin / deg",
    "M_s",
    "M_t",
    "|W T|",
    "noise of the command",
)
FIGURES = (
    ("Nyquist plot", "Loop gain of every member; the disc is what M_s keeps free.", nyquist),
    (
        "Sensitivity",
        "|S| below 1 holds disturbances off; |T| near 1 follows the target.",
        sensitivities,
    ),
    ("Steps of the target", "Slip over the set after a step of its target.", steps),
)


def write_report(
    path: Path, designed: Designed, out: File, beside: Mapping[str, Designed | NoDesign]
) -> File:
    """Write design.html into `out`. beside: what other laws reach. Returns the page's path."""
    out.mkdir(parents=True, exist_ok=True)
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    here, style = (
        files("slipbench.identification.design"),
        files("slipbench.identification.report") / "report.css",
    )
    template = environment.from_string((here / "design.html").read_text(encoding="utf-8"))
    page = out / "design.html"
    page.write_text(
        template.render(
            title=f"{path.actuator} slip controller",
            headline=_headline(path, designed),
            style=Markup(style.read_text(encoding="utf-8")),
            head=HEAD,
            rows=_rows(designed),
            robust=_robust(designed),
            pairs=_pairs(path, designed),
            laws_head=LAWS,
            laws=[_law_row(f"{_name(designed)}, this one", designed)]
            + [_law_row(name.replace("_", " "), d) for name, d in beside.items()],
            figures=[(n, c, Markup(d.svg(f(path, designed), n))) for n, c, f in FIGURES],
        ),
        encoding="utf-8",
    )
    return page


def _headline(path: Path, designed: Designed) -> str:
    worst = max(m.sensitivity for m in designed.margins.values())
    through = "throttle and the spark" if isinstance(designed.controller, Joint) else path.actuator
    return (
        f"Through the {through}, slip follows its target up to {designed.bandwidth:.1f} Hz, "
        f"with a sensitivity peak of {worst:.2f} over {len(designed.margins)} loops."
    )


def _rows(designed: Designed) -> list[tuple[str, ...]]:
    return [
        (
            name,
            _hertz(m.bandwidth),
            _hertz(m.rejection),
            f"{20 * np.log10(m.gain):.1f}",
            f"{np.degrees(m.phase):.0f}",
            f"{m.sensitivity:.2f}",
        )
        for name, m in designed.margins.items()
    ]


def _law_row(name: str, found: Designed | NoDesign) -> tuple[str, ...]:
    """Say the worst over all members, and where the nominal loop reaches."""
    if isinstance(found, NoDesign):
        return (name, found.reason, *("" for _ in LAWS[2:]))
    every, nominal = found.margins.values(), found.margins["nominal"]
    return (
        name,
        f"{found.bandwidth:.2f}",
        _hertz(nominal.bandwidth),
        _hertz(nominal.rejection),
        f"{20 * np.log10(min(m.gain for m in every)):.1f}",
        f"{np.degrees(min(m.phase for m in every)):.0f}",
        f"{max(m.sensitivity for m in every):.2f}",
        f"{nominal.complementary:.2f}",
        f"{found.robust:.2f}",
        f"{found.noise:.2g}",
    )


def _name(designed: Designed) -> str:
    law = designed.controller
    if isinstance(law, Joint):
        return "internal models of throttle and spark"
    if isinstance(law, Synthesis):
        return f"H-infinity of order {law.order}"
    return "PID" if isinstance(law, Gains) else "internal model"


def _hertz(frequency: float) -> str:
    return f"{frequency:.2f}" if np.isfinite(frequency) else "beyond what was measured"


def _robust(designed: Designed) -> str:
    return (
        f"Greatest |W T| over the set: {designed.robust:.2f}; below 1 the loop is stable for "
        "every motorcycle inside the weight."
    )


def _pairs(path: Path, designed: Designed) -> list[tuple[str, str]]:
    problem = path.problem
    return [
        ("Runs", ", ".join(path.names)),
        ("Speed", f"{path.speed:.1f} m/s"),
        ("Law", _name(designed)),
        ("Delay of the model", f"{1e3 * problem.model.delay:.1f} ms"),
        ("Delay that the loop adds", f"{1e3 * problem.extra:.1f} ms: teeth, frames, half a tick"),
        ("Noise of a slip sample", f"{1e2 * problem.noise:.4f} %"),
        ("Noise of the command", f"{designed.noise:.2g} of {problem.swing:.2g}"),
    ]
