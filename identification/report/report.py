"""Report of a recording: one self-contained HTML file."""

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import jinja2
from markupsafe import Markup
from matplotlib.figure import Figure

from slipbench.identification.models.study import Study
from slipbench.identification.report import (
    drawing,
    model_tables,
    operating_region,
    operation,
    slip_control,
    tables,
    validation_tables,
)
from slipbench.identification.report.bode import bode
from slipbench.identification.report.captions import caption
from slipbench.identification.report.chart import Chart, static
from slipbench.identification.report.chart_script import script, style
from slipbench.identification.report.close_ups import close_ups
from slipbench.identification.report.distributions import slip_statistics, spectra
from slipbench.identification.report.frequency_charts import bode_chart, model_chart, nichols_chart
from slipbench.identification.report.headline import headline
from slipbench.identification.report.model_charts import (
    residual_chart,
    roots_chart,
    step_chart,
    validation_chart,
)
from slipbench.identification.report.model_figure import harmonics_figure, model_figure
from slipbench.identification.report.overview import overview
from slipbench.identification.report.run_verdict import RunVerdict
from slipbench.identification.report.tiles import tiles
from slipbench.identification.report.time_charts import time_chart
from slipbench.identification.report.words import name
from slipbench.identification.response.identify import Identification


@dataclass(frozen=True)
class Drawn:
    """A figure, its name in the report, its caption and its interactive form, if it has one."""

    name: str
    caption: str
    figure: Figure
    chart: Chart | None = None


def draw(found: Identification, study: Study) -> list[Drawn]:
    """All figures for which the recording has the data."""
    with drawing.style():
        output = found.main.output if found.main else "slip"
        to_slip = [r for r in found.responses if r.output == output]
        servo = [r for r in found.responses if r.output != output]
        made = [
            ("overview", overview(found)),
            ("close_ups", close_ups(found)),
            ("following", slip_control.figure(found)),
            ("response", bode(to_slip, found.resonance) if to_slip else None),
            ("servo", bode(servo) if servo else None),
            ("model", model_figure(study.models)),
            ("harmonics", harmonics_figure(study.harmonics)),
            ("statistics", slip_statistics(found) if not to_slip else None),
            ("spectra", spectra(found)),
            ("bus_load", operation.bus_load(found.recording)),
            ("lateness", operation.lateness(found.recording)),
        ]
        charts = interactive(found, study)
        drawn = [Drawn(n, caption(n, found), f, charts.get(n)) for n, f in made if f is not None]
        return [
            *drawn,
            *(
                Drawn(name, caption(name, found), static(chart), chart)
                for name, chart in charts.items()
                if name not in {one.name for one in drawn}
            ),
        ]


def interactive(found: Identification, study: Study) -> dict[str, Chart]:
    """Charts by the name of their figure, for which the recording has the data."""
    output = found.main.output if found.main else "slip"
    to_slip = [r for r in found.responses if r.output == output]
    known = [r for r in to_slip if r.reliable.any()]
    servo = [r for r in found.responses if r.output != output]
    made = {
        "overview": time_chart(found),
        "response": bode_chart(to_slip) if to_slip else None,
        "nichols": nichols_chart(known, study.models) if known else None,
        "servo": bode_chart(servo) if servo else None,
        "model": model_chart(study.models) if study.models else None,
        "roots": roots_chart(study.models) if study.models else None,
        "step": step_chart(study.models) if study.models else None,
    }
    for k, checked in enumerate(study.validations):
        made[f"validation-{k}"] = validation_chart(checked)
        made[f"residual-{k}"] = residual_chart(checked)
    return {name: chart for name, chart in made.items() if chart is not None}


def report(
    found: Identification, study: Study, drawn: list[Drawn], verdict: RunVerdict | None = None
) -> str:
    """Report as HTML text. verdict: on the run, at the head of the page; None where nobody judged it."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    here = files("slipbench.identification.report")
    template = environment.from_string((here / "report.html").read_text(encoding="utf-8"))
    return template.render(
        style=style(),
        title=found.recording.folder.name,
        headline=headline(found),
        verdict=verdict,
        tiles=tiles(found, study),
        figures={d.name: _inline(d) for d in drawn},
        script=script({d.name: d.chart for d in drawn if d.chart is not None}),
        output=name(found.main.output if found.main else "slip"),
        captions={d.name: d.caption for d in drawn},
        point_title=operating_region.title(found),
        time_title="Signals over time" if found.without_slip else "Input and slip over time",
        point=operating_region.operating_point(found),
        processing=operating_region.processing(found),
        following=slip_control.rows(found.following),
        clocks=tables.clocks(found),
        faults=tables.faults(found.recording),
        unknown=tables.unknown_identifiers(found.recording),
        on_bus=tables.on_bus(found.recording),
        load=tables.bus_load(found.recording),
        lateness=tables.lateness(found.recording),
        models=[(model_tables.title(m), model_tables.rows(m)) for m in study.models],
        validations=[
            (validation_tables.title(v), validation_tables.rows(v), k)
            for k, v in enumerate(study.validations)
        ],
        left_out=(*found.left_out, *study.left_out),
        warnings=found.recording.description.get("warnings", []),
        channels=tables.channels(found),
        provenance=tables.provenance(found.recording),
    )


def write_figures(drawn: list[Drawn], folder: Path) -> list[Path]:
    """Paths of the figures, written as PNG files into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{item.name}.png" for item in drawn]
    for item, path in zip(drawn, paths, strict=True):
        drawing.png(item.figure, path)
    return paths


def _inline(drawn: Drawn) -> Markup:
    return Markup(drawing.svg(drawn.figure, drawn.name))
