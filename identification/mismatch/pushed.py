"""A free curve fitted as a course of pushes, where the simulation has no curve of that kind.

Its quantity is taken from the simulation once; what the curve does to its own quantity comes in
when it is taken again. The slopes are those of located curves, the simulation itself decides.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch.along import course
from identification.mismatch.candidate import Dialled
from identification.mismatch.fitting import Fit
from identification.mismatch.locate import answers_along, regressors
from identification.mismatch.model import Series
from identification.mismatch.place import Injection
from identification.mismatch.push import Push
from identification.mismatch.record import Record
from identification.mismatch.system import System
from identification.mismatch.tooth_curve import ANGLE
from plant.signals import Floats

NUDGE = 0.1
LOOSE = 5.0
"""Prior deviation of a value, in pushes worth trying at its place."""


@dataclass(frozen=True, eq=False)
class Pushed(Dialled):
    """A curve with its values as dials, in pushes worth trying at its place.

    along: its quantity in every record, (rows,) each; answers: see `Dialled`.
    """

    system: System
    records: tuple[Record, ...]
    place: Injection
    regressor: str
    knots: Floats
    along: tuple[Floats, ...]
    dials: tuple[float, ...]
    answers: Series | None

    @classmethod
    def beside(
        cls, fit: Fit, place: Injection, regressor: str, knots: Floats, dials: tuple[float, ...]
    ) -> "Pushed":
        """Let it act along its quantity as a fit shows it.

        What goes round with a wheel shows in the pattern of its teeth, which answers do not cover.
        """
        model = fit.model
        records = range(len(model.records))
        along = tuple(regressors(fit, place.drive, r)[regressor] for r in records)
        system = model.at(fit.point)
        new = cls(system, model.records, place, regressor, knots, along, dials, None)
        if regressor == ANGLE:
            return new
        answered = answers_along(fit, place, regressor, knots)
        return replace(new, answers=[[place.size * one for one in block] for block in answered])

    @property
    def name(self) -> str:
        """Where it acts and along what."""
        return f"{self.place.name} along {self.regressor}"

    @property
    def deviations(self) -> tuple[float, ...]:
        """Loose."""
        return (LOOSE,) * len(self.dials)

    @property
    def nudges(self) -> tuple[float, ...]:
        """Of the size worth trying."""
        return (NUDGE,) * len(self.dials)

    @property
    def values(self) -> Floats:
        """The curve at its knots, in the place's unit."""
        return self.place.size * np.array(self.dials)

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
