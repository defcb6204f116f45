"""A free curve fitted as a course of pushes, where the simulation has no curve of that kind.

Its quantity is taken from the simulation once; what the curve does to its own quantity comes in
when it is taken again. The slopes are those of located curves, the simulation itself decides.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from slipbench.identification.mismatch.curves.trace import regressors, responses_along
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.input_disturbance import InputDisturbance
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.regressor import TURN, course, half_range, kind_of
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.signals import Floats

DIFFERENCE_STEP = 0.1
LOOSE = 5.0
"""Prior deviation of a value, in pushes worth trying at its place."""
SPREADS = (0.03, 0.1, 0.3, 1.0, 3.0, LOOSE)
"""Prior deviations among which the recordings choose."""


@dataclass(frozen=True, eq=False)
class InputSpline(Hypothesis):
    """A curve with its values as dials, in pushes worth trying at its place.

    quantities: its quantity in every record, (rows,) each; unit: of each value, in the place's unit
    over the quantity's, so that a dial of one pushes as much as is worth trying; answers: see
    `Hypothesis`. spread: prior deviation of the dials.
    """

    system: System
    records: tuple[Record, ...]
    injection: InjectionPoint
    regressor: str
    knots: Floats
    quantities: tuple[Floats, ...]
    unit: Floats
    parameters: tuple[float, ...]
    answers: Series | None
    spread: float = LOOSE

    @classmethod
    def beside(
        cls, fit: Fit, place: InjectionPoint, regressor: str, knots: Floats
    ) -> "InputSpline":
        """Let it act along its quantity as a fit shows it.

        What repeats every turn is too quick for answers to pushes in whole bins, and shows in the
        pattern of a wheel's teeth, which they do not cover.
        """
        along = _along(fit, place, regressor)
        unit = place.size / np.maximum(
            half_range(regressor, np.concatenate(along, -1), knots), 1e-300
        )
        model, parameters = fit.model, (0.0,) * knots.size
        system = model.at(fit.point)
        new = cls(system, model.records, place, regressor, knots, along, unit, parameters, None)
        new = replace(new, answers=new._responses(fit))
        return replace(
            new, spread=new.spread if new.answers is None else _most_likely(fit, new.answers)
        )

    def refreshed(self, fit: Fit) -> "InputSpline":
        """Return it along its quantity as another fit shows it."""
        along = _along(fit, self.injection, self.regressor)
        return replace(self, quantities=along, answers=self._responses(fit))

    def with_quantities_of(self, fit: Fit) -> "InputSpline":
        """Return it along its quantity as another fit shows it, its answers kept."""
        return replace(self, quantities=_along(fit, self.injection, self.regressor))

    def towards(self, other: "InputSpline", share: float) -> "InputSpline":
        """Return it with its values moved a share of the way to another's."""
        return self.moved(share * (np.array(other.parameters) - np.array(self.parameters)))

    def _responses(self, fit: Fit) -> Series | None:
        if kind_of(self.regressor) == TURN:
            return None
        told = responses_along(fit, self.injection, self.regressor, self.knots)
        return [[one * self.unit if one.size else one for one in block] for block in told]

    @property
    def name(self) -> str:
        """Where it acts and along what."""
        return f"{self.injection.name} along {self.regressor}"

    @property
    def deviations(self) -> tuple[float, ...]:
        """As wide as the recordings speak for."""
        return (self.spread,) * len(self.parameters)

    @property
    def difference_steps(self) -> tuple[float, ...]:
        """Of the size worth trying."""
        return (DIFFERENCE_STEP,) * len(self.parameters)

    @property
    def values(self) -> Floats:
        """The curve at its knots, in the place's unit."""
        return np.asarray(self.unit * np.array(self.parameters))

    def effect(self) -> InputDisturbance:
        """Return its pushes, row by row."""
        courses = tuple(map(self._columns, self.records, self.quantities))
        return InputDisturbance(self.injection.subsystem, courses)

    def _columns(self, record: Record, along: Floats) -> Mapping[str, Floats]:
        pushes = course(self.regressor, along, self.knots, self.values, record.grid.step)
        return self.system.input_disturbance(self.injection, record, pushes)

    def moved(self, step: Floats) -> "InputSpline":
        """Return it with other values."""
        return replace(self, parameters=tuple(float(d) for d in np.array(self.parameters) + step))


def _along(fit: Fit, place: InjectionPoint, regressor: str) -> tuple[Floats, ...]:
    records = range(len(fit.model.records))
    return tuple(regressors(fit, place.subsystem, r)[regressor] for r in records)


def _most_likely(fit: Fit, answers: Series) -> float:
    """Return the prior deviation of many dials for which the recordings speak most.

    The evidence of a linear model with normal values (MacKay, Neural Computation 4 (1992) 415):
    values that the recordings hardly tell stay small, and are not fitted to noise.
    """
    linear = Linearization.of(fit)
    off = linear.nuisances.project_out(whiten_and_stack(fit.model, fit.noise, answers))
    normal, aim = off.T @ off, off.T @ linear.residuals
    return max(SPREADS, key=lambda spread: _evidence(normal, aim, spread))


def _evidence(normal: Floats, aim: Floats, spread: float) -> float:
    held = normal + np.eye(aim.size) / spread**2
    _, size = np.linalg.slogdet(held * spread**2)
    return 0.5 * float(aim @ np.linalg.solve(held, aim)) - 0.5 * float(size)
