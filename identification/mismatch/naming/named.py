"""Effects accepted by a search so far, with their evidence."""

from dataclasses import dataclass, field, replace

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.held_out import Veto
from slipbench.identification.mismatch.naming.score import Score, Screening


@dataclass(frozen=True, eq=False)
class Named:
    """Accepted effects. base: fit without any; competing: name -> deficit, nats, by accepted name.

    first: screening of the whole library on the residual of calibration. screenings: number of
    screenings so far. p: smallest p of all tests, family-wise over the library and the free curves.
    vetoes: effects that passed on the training recordings and are contradicted by held-out ones.
    doubts: prior reasons against effects (see plausibility.py), by name. found_in: index of the
    screening that found an accepted effect, by name.
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
        """Best candidate of every effect on the residual of calibration, largest gain first."""
        return self.first.scores

    @property
    def names(self) -> list[str]:
        """Names of the accepted effects."""
        return [c.name for c in self.fit.candidates]

    @property
    def rivals(self) -> dict[str, dict[str, float]]:
        """Competing effects that are not accepted themselves: name -> deficit, by accepted name.

        In nats. Of two effects that are both found, each competes with the other at first.
        """
        return {
            name: {other: nats for other, nats in behind.items() if other not in self.names}
            for name, behind in self.competing.items()
        }

    @property
    def log_likelihood_gain(self) -> float:
        """Log-likelihood gain of the accepted effects, nats."""
        return self.fit.score - self.base.score


def restricted_to(named: Named, fit: Fit) -> Named:
    """Return the state reduced to the effects of a fit."""
    remaining = {c.name for c in fit.candidates}

    def is_accepted(names: str) -> bool:
        return set(names.split(" + ")) <= remaining

    return replace(
        named,
        fit=fit,
        competing={n: r for n, r in named.competing.items() if is_accepted(n)},
        found_in={n: k for n, k in named.found_in.items() if n in remaining},
    )
