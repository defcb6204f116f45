"""External-input spline: a free curve fitted as an input disturbance.

It is used where the model has no curve of that kind. Its regressor is taken from the simulation
once; the effect of the curve on its own regressor enters when the regressor is updated.
Sensitivities are those of located curves; the score is that of the simulation.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from slipbench.identification.mismatch.curves.injection import disturbance
from slipbench.identification.mismatch.curves.trace import regressors, responses_along
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.input_disturbance import InputDisturbance
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.regressor import (
    TURN,
    curve_waveform,
    half_range,
    kind_of,
)
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.signals import Floats

DIFFERENCE_STEP = 0.1
LOOSE = 5.0
"""Prior deviation of a value, relative to the typical disturbance at its injection point."""
SPREADS = (0.03, 0.1, 0.3, 1.0, 3.0, LOOSE)
"""Candidate prior deviations; the one with the largest evidence is selected."""


@dataclass(frozen=True, eq=False)
class InputSpline(Hypothesis):
    """A curve with its values as parameters, relative to the typical disturbance at its point.

    quantities: its regressor in every record, (rows,) each; unit: scale of each value, in the unit
    of the disturbance over that of the regressor, so that 1 is a typical disturbance; responses:
    see `Hypothesis`. spread: prior deviation of the parameters.
    """

    system: System
    records: tuple[Record, ...]
    injection: InjectionPoint
    regressor: str
    knots: Floats
    quantities: tuple[Floats, ...]
    unit: Floats
    parameters: tuple[float, ...]
    responses: Series | None
    spread: float = LOOSE

    @classmethod
    def beside(
        cls, fit: Fit, place: InjectionPoint, regressor: str, knots: Floats
    ) -> "InputSpline":
        """Return a spline of zeros over its regressor as simulated by a fit.

        knots: SI, shape (knots,). A periodic curve of an angle has no linear responses: it is too
        fast for impulse responses in bins, and it affects the tooth pattern of a wheel, which they
        do not include.
        """
        waveforms = _regressor_of(fit, place, regressor)
        unit = place.size / np.maximum(
            half_range(regressor, np.concatenate(waveforms, -1), knots), 1e-300
        )
        model, parameters = fit.model, (0.0,) * knots.size
        system = model.at(fit.point)
        new = cls(system, model.records, place, regressor, knots, waveforms, unit, parameters, None)
        new = replace(new, responses=new._responses(fit))
        return replace(
            new, spread=new.spread if new.responses is None else best_spread(fit, new.responses)
        )

    def refreshed(self, fit: Fit) -> "InputSpline":
        """Return it with the regressor and the responses of another fit."""
        waveforms = _regressor_of(fit, self.injection, self.regressor)
        return replace(self, quantities=waveforms, responses=self._responses(fit))

    def with_quantities_of(self, fit: Fit) -> "InputSpline":
        """Return it with the regressor of another fit, responses unchanged."""
        return replace(self, quantities=_regressor_of(fit, self.injection, self.regressor))

    def towards(self, other: "InputSpline", share: float) -> "InputSpline":
        """Return it with its values moved by a fraction of the difference to another spline."""
        return self.moved(share * (np.array(other.parameters) - np.array(self.parameters)))

    def _responses(self, fit: Fit) -> Series | None:
        if kind_of(self.regressor) == TURN:
            return None
        responses = responses_along(fit, self.injection, self.regressor, self.knots)
        return [[one * self.unit if one.size else one for one in block] for block in responses]

    @property
    def name(self) -> str:
        """Injection point and regressor."""
        return f"{self.injection.name} along {self.regressor}"

    @property
    def deviations(self) -> tuple[float, ...]:
        """Prior deviation of each parameter, (p,): that of the largest evidence."""
        return (self.spread,) * len(self.parameters)

    @property
    def difference_steps(self) -> tuple[float, ...]:
        """Finite-difference step of each parameter, (p,)."""
        return (DIFFERENCE_STEP,) * len(self.parameters)

    @property
    def values(self) -> Floats:
        """Values of the curve at its knots, in the unit of the injection point."""
        return np.asarray(self.unit * np.array(self.parameters))

    def effect(self) -> InputDisturbance:
        """Return its input disturbance, row by row."""
        disturbances = tuple(map(self._columns, self.records, self.quantities))
        return InputDisturbance(self.injection.subsystem, disturbances)

    def _columns(self, record: Record, z: Floats) -> Mapping[str, Floats]:
        waveform = curve_waveform(self.regressor, z, self.knots, self.values, record.grid.step)
        return disturbance(self.system, self.injection, record, waveform)

    def moved(self, step: Floats) -> "InputSpline":
        """Return it after a step of its parameters, (p,)."""
        return replace(self, parameters=tuple(float(d) for d in np.array(self.parameters) + step))


def _regressor_of(fit: Fit, place: InjectionPoint, regressor: str) -> tuple[Floats, ...]:
    records = range(len(fit.model.records))
    return tuple(regressors(fit, place.subsystem, r)[regressor] for r in records)


def best_spread(fit: Fit, responses: Series) -> float:
    """Return the prior deviation of the parameters that maximizes the evidence.

    responses: of the outputs to a unit of each parameter, (T, m, p) by output group and record. The
    evidence is that of a linear model with Gaussian parameters (MacKay, Neural Computation 4 (1992)
    415): poorly determined values stay small and are not fitted to noise.
    """
    linear = Linearization.of(fit)
    projected = linear.nuisances.project_out(whiten_and_stack(fit.model, fit.noise, responses))
    normal, gradient = projected.T @ projected, projected.T @ linear.residuals
    return max(SPREADS, key=lambda spread: _evidence(normal, gradient, spread))


def _evidence(normal: Floats, gradient: Floats, spread: float) -> float:
    posterior = normal + np.eye(gradient.size) / spread**2
    _, log_det = np.linalg.slogdet(posterior * spread**2)
    return 0.5 * float(gradient @ np.linalg.solve(posterior, gradient)) - 0.5 * float(log_det)
