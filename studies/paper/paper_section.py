"""One section of the reproduction: method and result, figures, claims."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from matplotlib.figure import Figure

from slipbench.identification.report import drawing
from slipbench.identification.report.report import Drawn
from slipbench.studies.paper.claims import Claim

Table = tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Section:
    """A section of the report.

    number      of the step in the paper's order, "5"
    paragraphs  method and result, in sentences
    drawn       figures with captions
    claims      statements that the recordings must confirm
    tables      by caption; the first row of each is its head
    """

    number: str
    title: str
    paragraphs: tuple[str, ...]
    drawn: tuple[Drawn, ...] = ()
    claims: tuple[Claim, ...] = ()
    tables: Mapping[str, Table] = field(default_factory=dict)


def drawn(name: str, caption: str, make: Callable[[], Figure | None]) -> tuple[Drawn, ...]:
    """One figure in the common style, with its caption; empty where it cannot be drawn."""
    with drawing.style():
        figure = make()
    return () if figure is None else (Drawn(name, caption, figure),)
