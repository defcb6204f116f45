"""Page and figures of a comparison of runs: one self-contained HTML file and comparison.json."""

from importlib.resources import files
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup

from slipbench.identification.models.rational_ml import ACROSS
from slipbench.identification.report import drawing
from slipbench.identification.report.chart import Chart, static
from slipbench.identification.report.chart_script import script, style
from slipbench.identification.report.frequency_charts import bode_chart
from slipbench.identification.report.identification_file import COMPARISON_VERSION
from slipbench.identification.report.words import name
from slipbench.identification.session.comparison import ComparedRun, Comparison, Parameter
from slipbench.identification.session.measures import response_tree
from slipbench.protocol.output_folders import make_folders


def page(of: Comparison) -> str:
    """Comparison as HTML text."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    here = files("slipbench.identification.session")
    template = environment.from_string((here / "comparison.html").read_text(encoding="utf-8"))
    own, chart = _with_response(of), overlay(of)
    with drawing.style():
        printed = drawing.svg(static(chart), "comparison")
    return template.render(
        style=style(),
        headline=of.headline,
        path=f"{name(of.pooled.input)} to {name(of.pooled.output)}",
        runs=of.runs,
        differences=of.differences,
        parameters=[parameter_row(one) for one in of.parameters],
        names=[one.name for one in own],
        matrix=_matrix(of, own),
        printed=Markup(printed),
        script=script({"comparison": chart}),
    )


def overlay(of: Comparison) -> Chart:
    """Responses of the runs and the pooled one, with intervals."""
    own = _with_response(of)
    return bode_chart(
        [*(one.response for one in own if one.response), of.pooled],
        [*(one.name for one in own), f"pooled ({of.pooled.method})"],
    )


def write_figure(of: Comparison, folder: Path) -> Path:
    """Path of the overlay as PNG file. Raises InputError where it cannot be written."""
    make_folders(folder)
    path = folder / "comparison.png"
    with drawing.style():
        drawing.png(static(overlay(of)), path)
    return path


def lines(of: Comparison) -> list[str]:
    """Comparison as lines for a terminal."""
    made = [of.headline, ""]
    made += [f"  {one.name}: {one.verdict}" for one in of.runs]
    made += ["", *(f"  {one.words}" for one in of.differences)]
    made += [f"  {' | '.join(parameter_row(one))}" for one in of.parameters]
    made += [
        f"  model of {model} on {data}: NRMSE fit {checked.fit:.1f} %"
        for (model, data), checked in of.validation.items()
    ]
    return [*made, ""]


def figures(of: Comparison) -> dict[str, Any]:
    """Content of comparison.json."""
    return {
        "schema_version": COMPARISON_VERSION,
        "headline": of.headline,
        "input": of.pooled.input,
        "output": of.pooled.output,
        "runs": [
            {
                "run": one.name,
                "verdict": {"word": one.verdict.word, "reasons": list(one.verdict.reasons)},
                "compared": one.response is not None,
            }
            for one in of.runs
        ],
        "pooled": response_tree(of.pooled),
        "differences": [
            {
                "run": one.run,
                "distance": one.found.distance,
                "expected": one.found.expected,
                "probability": one.adjusted,
                "significant": one.significant,
                "lines": one.found.lines,
            }
            for one in of.differences
        ],
        "parameters": [
            {
                "name": one.name,
                "unit": one.unit,
                "values": list(one.values),
                "deviations": list(one.deviations),
                "probability": one.probability,
            }
            for one in of.parameters
        ],
        "validation": [
            {"model": model, "data": data, "nrmse_fit": checked.fit, "error": checked.error}
            for (model, data), checked in of.validation.items()
        ],
    }


def parameter_row(of: Parameter) -> tuple[str, ...]:
    """Name, value with 95 % interval in each run, and what the test of homogeneity says."""
    cells = [
        f"{value:.4g} ± {ACROSS * deviation:.2g}" if np.isfinite(value) else "–"
        for value, deviation in zip(of.values, of.deviations, strict=True)
    ]
    label = of.name if of.unit == "1" else f"{of.name} / {of.unit}"
    return (label, *cells, of.words)


def _with_response(of: Comparison) -> list[ComparedRun]:
    return [one for one in of.runs if one.response is not None]


def _matrix(of: Comparison, own: list[ComparedRun]) -> list[tuple[str, ...]]:
    """Rows: run of the model, then its NRMSE fit on each run, %."""
    held_out = {
        one.name: next(
            (
                f"{v.fit:.1f} (held-out)"
                for v in one.study.validations
                if one.response and v.input == one.response.input
            ),
            "–",
        )
        for one in own
    }
    return [
        (
            model.name,
            *(
                held_out[data.name] if data is model else _fit(of, model.name, data.name)
                for data in own
            ),
        )
        for model in own
    ]


def _fit(of: Comparison, model: str, data: str) -> str:
    checked = of.validation.get((model, data))
    return f"{checked.fit:.1f}" if checked else "–"
