"""What a search has accepted so far, with what is known of it."""

from dataclasses import dataclass, field, replace

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.held_out import Veto
from slipbench.identification.mismatch.naming.score import Score, Screening

ALIKE = 10.0  # nats within which two names are one class


@dataclass(frozen=True, eq=False)
class Named:
    """What was accepted. base: without any; competing: name -> nats behind, by accepted name.

    first: screening of the whole library on what calibration leaves. screenings: how many there
    were since. p: of the strongest of all that was tried, family-wise over the library and the free
    curves. vetoes: what passed on the training recordings and held-out ones contradict. doubts:
    what speaks against names beforehand (see plausibility.py), by name. found_in: number of the
    screening that found it, by accepted name.
    """

    base: Fit
    fit: Fit
    first: Screening
    screenings: int = 1
    p: float = 1.0
    competing: dict[str, dict[str, float]] = field(default_factory=dict)
    vetoes: tuple[Veto, ...] = ()
    doubts: dict[str, str] = field(default_factory=dict)
    found_in: dict[str, int] = field(default_factory=dict)

    @property
    def scores(self) -> list[Score]:
        """Of every effect the best try on what calibration leaves, greatest gain first."""
        return self.first.scores

    @property
    def names(self) -> list[str]:
        """Names of the accepted effects."""
        return [c.name for c in self.fit.candidates]

    @property
    def log_likelihood_gain(self) -> float:
        """Nats that the accepted effects bring."""
        return self.fit.score - self.base.score


def left(named: Named, fit: Fit) -> Named:
    """Return the names of a fit, and what is known of those that were named before."""
    there = {c.name for c in fit.candidates}

    def stays(names: str) -> bool:
        return set(names.split(" + ")) <= there

    return replace(
        named,
        fit=fit,
        competing={n: r for n, r in named.competing.items() if stays(n)},
        found_in={n: k for n, k in named.found_in.items() if n in there},
    )
