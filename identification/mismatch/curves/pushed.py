"""A free curve fitted as a course of pushes, where the simulation has no curve of that kind.

Its quantity is taken from the simulation once; what the curve does to its own quantity comes in
when it is taken again. The slopes are those of located curves, the simulation itself decides.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from slipbench.identification.mismatch.curves.trace import answers_along, regressors
from slipbench.identification.mismatch.fit.dialled import Dialled
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.simulation.along import TURN, course, kind_of, sway
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.identification.mismatch.simulation.place import Injection
from slipbench.identification.mismatch.simulation.push import Push
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.signals import Floats

DIFFERENCE_STEP = 0.1
LOOSE = 5.0
"""Prior deviation of a value, in pushes worth trying at its place."""
SPREADS = (0.03, 0.1, 0.3, 1.0, 3.0, LOOSE)
"""Prior deviations among which the recordings choose."""


@dataclass(frozen=True, eq=False)
class Pushed(Dialled):
    """A curve with its values as dials, in pushes worth trying at its place.

    along: its quantity in every record, (rows,) each; unit: of each value, in the place's unit
    over the quantity's, so that a dial of one pushes as much as is worth trying; answers: see
    `Dialled`. spread: prior deviation of the dials.
    """

    system: System
    records: tuple[Record, ...]
    place: Injection
    regressor: str
    knots: Floats
    along: tuple[Floats, ...]
    unit: Floats
    dials: tuple[float, ...]
    answers: Series | None
    spread: float = LOOSE

    @classmethod
    def beside(cls, fit: Fit, place: Injection, regressor: str, knots: Floats) -> "Pushed":
        """Let it act along its quantity as a fit shows it.

        What repeats every turn is too quick for answers to pushes in whole bins, and shows in the
        pattern of a wheel's teeth, which they do not cover.
        """
        along = _along(fit, place, regressor)
        unit = place.size / np.maximum(sway(regressor, np.concatenate(along, -1), knots), 1e-300)
        model, dials = fit.model, (0.0,) * knots.size
        system = model.at(fit.point)
        new = cls(system, model.records, place, regressor, knots, along, unit, dials, None)
        new = replace(new, answers=new._answers(fit))
        return replace(
            new, spread=new.spread if new.answers is None else _most_likely(fit, new.answers)
        )

    def again(self, fit: Fit) -> "Pushed":
        """Return it along its quantity as another fit shows it."""
        along = _along(fit, self.place, self.regressor)
        return replace(self, along=along, answers=self._answers(fit))

    def along_that_of(self, fit: Fit) -> "Pushed":
        """Return it along its quantity as another fit shows it, its answers kept."""
        return replace(self, along=_along(fit, self.place, self.regressor))

    def towards(self, other: "Pushed", share: float) -> "Pushed":
        """Return it with its values moved a share of the way to another's."""
        return self.moved(share * (np.array(other.dials) - np.array(self.dials)))

    def _answers(self, fit: Fit) -> Series | None:
        if kind_of(self.regressor) == TURN:
            return None
        told = answers_along(fit, self.place, self.regressor, self.knots)
        return [[one * self.unit if one.size else one for one in block] for block in told]

    @property
    def name(self) -> str:
        """Where it acts and along what."""
        return f"{self.place.name} along {self.regressor}"

    @property
    def deviations(self) -> tuple[float, ...]:
        """As wide as the recordings speak for."""
        return (self.spread,) * len(self.dials)

    @property
    def difference_steps(self) -> tuple[float, ...]:
        """Of the size worth trying."""
        return (DIFFERENCE_STEP,) * len(self.dials)

    @property
    def values(self) -> Floats:
        """The curve at its knots, in the place's unit."""
        return np.asarray(self.unit * np.array(self.dials))

    def effect(self) -> Push:
        """Return its pushes, row by row."""
        courses = tuple(map(self._columns, self.records, self.along))
        return Push(self.place.drive, courses)

    def _columns(self, record: Record, along: Floats) -> Mapping[str, Floats]:
        pushes = course(self.regressor, along, self.knots, self.values, record.grid.step)
        return self.system.push(self.place, record, pushes)

    def moved(self, step: Floats) -> "Pushed":
        """Return it with other values."""
        return replace(self, dials=tuple(float(d) for d in np.array(self.dials) + step))


def _along(fit: Fit, place: Injection, regressor: str) -> tuple[Floats, ...]:
    records = range(len(fit.model.records))
    return tuple(regressors(fit, place.drive, r)[regressor] for r in records)


def _most_likely(fit: Fit, answers: Series) -> float:
    """Return the prior deviation of many dials for which the recordings speak most.

    The evidence of a linear model with normal values (MacKay, Neural Computation 4 (1992) 415):
    values that the recordings hardly tell stay small, and are not fitted to noise.
    """
    linear = Linearization.of(fit)
    off = linear.nuisances.off(whiten_and_stack(fit.model, fit.noise, answers))
    normal, aim = off.T @ off, off.T @ linear.left
    return max(SPREADS, key=lambda spread: _evidence(normal, aim, spread))


def _evidence(normal: Floats, aim: Floats, spread: float) -> float:
    held = normal + np.eye(aim.size) / spread**2
    _, size = np.linalg.slogdet(held * spread**2)
    return 0.5 * float(aim @ np.linalg.solve(held, aim)) - 0.5 * float(size)
