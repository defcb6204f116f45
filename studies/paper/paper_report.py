"""Page with the paper's steps on our recordings, and claims.json."""

import json
import math
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path

import jinja2
from markupsafe import Markup

from slipbench.identification.report import drawing
from slipbench.identification.report.report import Drawn, write_figures
from slipbench.identification.report.tiles import Tile
from slipbench.protocol.recording.recording import Recording
from slipbench.studies.paper.claims import Claim
from slipbench.studies.paper.paper import Paper


def write_paper(made: Paper, recordings: Mapping[str, Recording], out: Path) -> Path:
    """Write paper.html, claims.json and the figures into `out`. Returns the page's path."""
    out.mkdir(parents=True, exist_ok=True)
    write_figures([item for section in made.sections for item in section.drawn], out / "figures")
    described = {"answer": made.answer, "claims": [claim.described() for claim in made.claims]}
    (out / "claims.json").write_text(json.dumps(described, indent=2, allow_nan=False) + "\n")
    page = out / "paper.html"
    page.write_text(_page(made, recordings), encoding="utf-8")
    return page


def _page(made: Paper, recordings: Mapping[str, Recording]) -> str:
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    here, style = (
        files("slipbench.studies.paper"),
        files("slipbench.identification.report") / "report.css",
    )
    template = environment.from_string((here / "paper.html").read_text(encoding="utf-8"))
    return template.render(
        style=Markup(style.read_text(encoding="utf-8")),
        answer=made.answer,
        sections=made.sections,
        tiles=_tiles(made.claims),
        recordings=[_row(name, recording) for name, recording in recordings.items()],
        inline=_inline,
        found=found_in_words,
        band=band_in_words,
    )


def _tiles(claims: Sequence[Claim]) -> list[Tile]:
    held = sum(claim.holds for claim in claims)
    return [Tile("Claims", f"{held} of {len(claims)}", "hold on these recordings")]


def _row(name: str, recording: Recording) -> tuple[str, ...]:
    described = recording.trial.description if recording.trial else ""
    run = recording.description.get("run", {})
    return name, described, str(recording.frame_count), str(run.get("database_sha256", ""))[:12]


def _inline(drawn: Drawn) -> Markup:
    return Markup(drawing.svg(drawn.figure, drawn.name))


def found_in_words(claim: Claim) -> str:
    """Value of a claim as text with its unit."""
    return "not found" if math.isnan(claim.value) else _quantity(claim.value, claim.unit)


def band_in_words(claim: Claim) -> str:
    """Bounds of a claim as text."""
    low, high = math.isfinite(claim.low), math.isfinite(claim.high)
    if low and high:
        return f"{claim.low:.4g} … {_quantity(claim.high, claim.unit)}"
    if low:
        return f"at least {_quantity(claim.low, claim.unit)}"
    return f"at most {_quantity(claim.high, claim.unit)}" if high else ""


def _quantity(value: float, unit: str) -> str:
    return f"{value:.4g}" if unit in ("", "1") else f"{value:.4g} {unit}"
