"""One section of the paper's reproduction: what was done, its figures, its claims."""

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
    paragraphs  what was done and what came out, in sentences
    drawn       figures with captions
    claims      what the recordings must bear out
    tables      by caption; the first row of each is its head
    """

    number: str
    title: str
    paragraphs: tuple[str, ...]
    drawn: tuple[Drawn, ...] = ()
    claims: tuple[Claim, ...] = ()
    tables: Mapping[str, Table] = field(default_factory=dict)


def drawn(name: str, caption: str, make: Callable[[], Figure | None]) -> tuple[Drawn, ...]:
    """Draw one figure in the project's hand; nothing where it cannot be drawn."""
    with drawing.style():
        figure = make()
    return () if figure is None else (Drawn(name, caption, figure),)
