"""The report of a recording: one file that needs nothing but a browser."""

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import jinja2
from markupsafe import Markup
from matplotlib.figure import Figure

from slipbench.identification.models.study import Study
from slipbench.identification.report import drawing, model_tables, operation, slip_control, tables
from slipbench.identification.report import operating_region as circumstances
from slipbench.identification.report.bode import bode
from slipbench.identification.report.close_ups import close_ups
from slipbench.identification.report.distributions import slip_statistics, spectra
from slipbench.identification.report.headline import headline
from slipbench.identification.report.model_figure import harmonics_figure, model_figure
from slipbench.identification.report.overview import overview
from slipbench.identification.report.tiles import tiles
from slipbench.identification.response.identify import Identification


@dataclass(frozen=True)
class Drawn:
    """A figure with its place in the report and the sentence beneath it."""

    name: str
    caption: str
    figure: Figure


def draw(found: Identification, study: Study) -> list[Drawn]:
    """Draw every figure that the recording carries."""
    with drawing.hand():
        to_slip = [r for r in found.responses if r.output == "slip"]
        servo = [r for r in found.responses if r.output != "slip"]
        made = [
            ("overview", OVERVIEW, overview(found)),
            ("close_ups", CLOSE_UPS, close_ups(found)),
            ("following", FOLLOWING, slip_control.figure(found)),
            ("response", BODE, bode(to_slip, found.resonance) if to_slip else None),
            ("servo", SERVO, bode(servo) if servo else None),
            ("model", MODEL, model_figure(study.models)),
            ("harmonics", HARMONICS, harmonics_figure(study.harmonics)),
            ("statistics", STATISTICS, slip_statistics(found) if not to_slip else None),
            ("spectra", SPECTRA, spectra(found)),
            ("bus_load", BUS_LOAD, operation.bus_load(found.recording)),
            ("lateness", LATENESS, operation.lateness(found.recording)),
        ]
        return [Drawn(name, text, figure) for name, text, figure in made if figure is not None]


def report(found: Identification, study: Study, drawn: list[Drawn]) -> str:
    """Compose the report as HTML."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    here = files("slipbench.identification.report")
    template = environment.from_string((here / "report.html").read_text(encoding="utf-8"))
    return template.render(
        style=Markup((here / "report.css").read_text(encoding="utf-8")),
        title=found.recording.folder.name,
        headline=headline(found),
        tiles=tiles(found, study),
        figures={d.name: _inline(d) for d in drawn},
        captions={d.name: d.caption for d in drawn},
        point=circumstances.operating_point(found),
        how=circumstances.how(found),
        following=slip_control.rows(found.following),
        clocks=tables.clocks(found),
        faults=tables.faults(found.recording),
        unknown=tables.unknown_identifiers(found.recording),
        load=tables.bus_load(found.recording),
        lateness=tables.lateness(found.recording),
        models=[(model_tables.title(m), model_tables.told(m)) for m in study.models],
        left_out=(*found.left_out, *study.left_out),
        roles=tables.roles(found),
        provenance=tables.provenance(found.recording),
    )


def write_figures(drawn: list[Drawn], folder: Path) -> list[Path]:
    """Write the figures as PNG files."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{item.name}.png" for item in drawn]
    for item, path in zip(drawn, paths, strict=True):
        drawing.png(item.figure, path)
    return paths


def _inline(drawn: Drawn) -> Markup:
    return Markup(drawing.svg(drawn.figure, drawn.name))


OVERVIEW = (
    "Shaded: the bench excites. The commanded value is what the ECU says that it applied; it is "
    "the input of every response below."
)
FOLLOWING = "Slip as measured afterwards, and what the controller was asked for."
CLOSE_UPS = "The same, close up, at three frequencies of the sweep."
BODE = (
    "First harmonic with its 95 % band. Pale stretches are not believed: their coherence is below "
    "the dashed limit, or their band is wider than half the gain."
)
MODEL = (
    "Lines that share no noise, and the model fitted to them with its 95 % band; what drifts below "
    "the band is drawn with it."
)
HARMONICS = "Higher harmonics of the slip beside the first; pale: not known to within themselves."
SERVO = "From what the servo was told to what it measured."
STATISTICS = "Slip wherever it is defined; the colour of the right panel counts samples."
SPECTRA = "Amplitude of a sine of that height. Marked: orders of the driven wheel (1X is one turn)."
BUS_LOAD = "Share of the bus taken by frames."
LATENESS = "How long after it was due each late tick began."
