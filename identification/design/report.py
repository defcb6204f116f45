"""Report of a designed controller: design.html."""

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

HEAD = (
    "loop",
    "bandwidth |T| / Hz",
    "bandwidth |S| / Hz",
    "gain margin / dB",
    "phase margin / deg",
    "M_s",
)
LAWS = (
    "law",
    "tracking bandwidth / Hz",
    "bandwidth |T| / Hz",
    "bandwidth |S| / Hz",
    "gain margin / dB",
    "phase margin / deg",
    "M_s",
    "M_t",
    "|W T|",
    "command noise",
)
FIGURES = (
    (
        "Nyquist plot",
        "Loop gain of every member of the uncertainty set; shaded: disc excluded by the limit of M_s.",
        nyquist,
    ),
    (
        "Sensitivity",
        "|S| below 1: disturbances are attenuated; |T| near 1: the setpoint is tracked.",
        sensitivities,
    ),
    (
        "Setpoint step",
        "Slip after a setpoint step, for every member of the uncertainty set.",
        steps,
    ),
)


def write_report(
    path: Path, designed: Designed, out: File, alternatives: Mapping[str, Designed | NoDesign]
) -> File:
    """Path of the report design.html, written into `out`. alternatives: designs with other laws."""
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
            laws=[_law_row(f"{_name(designed)} (this design)", designed)]
            + [_law_row(name.replace("_", " "), d) for name, d in alternatives.items()],
            figures=[(n, c, Markup(d.svg(f(path, designed), n))) for n, c, f in FIGURES],
        ),
        encoding="utf-8",
    )
    return page


def _headline(path: Path, designed: Designed) -> str:
    worst = max(m.sensitivity for m in designed.margins.values())
    actuators = (
        "throttle and the spark" if isinstance(designed.controller, Joint) else path.actuator
    )
    return (
        f"Slip control with the {actuators}: tracking bandwidth {designed.bandwidth:.1f} Hz, "
        f"largest sensitivity peak M_s {worst:.2f} over {len(designed.margins)} loops."
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
    """Row of worst margins over all members and bandwidths of the nominal loop."""
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
    return f"{frequency:.2f}" if np.isfinite(frequency) else "above the measured band"


def _robust(designed: Designed) -> str:
    return (
        f"Robust stability: max |W T| = {designed.robust:.2f}; below 1 the loop is stable for the "
        "whole uncertainty set."
    )


def _pairs(path: Path, designed: Designed) -> list[tuple[str, str]]:
    problem = path.problem
    return [
        ("Runs", ", ".join(path.names)),
        ("Speed", f"{path.speed:.1f} m/s"),
        ("Law", _name(designed)),
        ("Dead time of the model", f"{1e3 * problem.model.delay:.1f} ms"),
        ("Additional loop delay", f"{1e3 * problem.extra:.1f} ms: encoder, frames, half a tick"),
        ("Slip noise, standard deviation", f"{1e2 * problem.noise:.4f} %"),
        (
            "Command noise, standard deviation",
            f"{designed.noise:.2g} (half range: {problem.half_range:.2g})",
        ),
    ]
