"""Markdown page of the reproduction, with small figures.

write_document(paper, Path("docs/paper.md"))       # figures: docs/figures/paper_*.png
"""

from collections.abc import Iterator
from pathlib import Path

from slipbench.identification.report import drawing
from slipbench.identification.report.report import Drawn
from slipbench.studies.paper.claims import Claim
from slipbench.studies.paper.paper import Paper
from slipbench.studies.paper.paper_report import band_in_words, found_in_words
from slipbench.studies.paper.paper_section import Section, Table

DOTS = 100  # per inch: legible, and small enough to keep
LEFT_OUT = ("delay_", "order_", "filter_phases", "teeth")  # figures shown only in the report
HEAD = """# Reproduction of the paper

Corno and Savaresi, *Experimental Identification of Rear Wheel Slip Dynamics of a Motorbike*, IFAC
SYSID 2009, step by step on CAN recordings of the demonstration motorcycle, whose parameters were
[chosen so that these findings occur](decisions/plant-demonstration.md). `make paper` writes this
page and its figures, and a report with all figures and the evidence for each claim."""


def write_document(made: Paper, path: Path) -> None:
    """Write the page, and its figures into the folder `figures` next to it."""
    (path.parent / "figures").mkdir(parents=True, exist_ok=True)
    for section in made.sections:
        for item in _shown(section):
            drawing.png(item.figure, path.parent / _place(item), DOTS)
    path.write_text("\n\n".join(_blocks(made)) + "\n", encoding="utf-8")


def _blocks(made: Paper) -> Iterator[str]:
    held = sum(claim.holds for claim in made.claims)
    yield HEAD
    yield f"**{made.answer}**"
    yield f"{held} of {len(made.claims)} claims hold. Frequencies are over w_c = 2 pi 10 rad/s."
    for section in made.sections:
        yield f"## {section.number}. {section.title}"
        yield from section.paragraphs[:1]
        for item in _shown(section):
            yield f"![{item.caption}]({_place(item)})"
            yield f"*{item.caption}*"
        for caption, table in section.tables.items():
            yield f"{caption}\n\n{_table(table)}"
        if section.claims:
            yield _table(
                (("", "claim", "result", "required", "source"), *map(_row, section.claims))
            )


def _shown(section: Section) -> list[Drawn]:
    return [item for item in section.drawn if not item.name.startswith(LEFT_OUT)]


def _place(item: Drawn) -> str:
    return f"figures/paper_{item.name}.png"


def _row(claim: Claim) -> tuple[str, ...]:
    mark = "holds" if claim.holds else "**fails**"
    return mark, claim.statement, found_in_words(claim), band_in_words(claim), claim.source


def _table(rows: Table) -> str:
    lines = ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])
