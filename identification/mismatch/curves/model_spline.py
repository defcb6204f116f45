"""In-model spline: a curve evaluated on the simulated regressor, with its values as parameters.

The feedback of the curve on its own regressor is included. Knots are moved to where curvature is
large.
"""

from dataclasses import dataclass, replace

import numpy as np

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.injection import places
from slipbench.identification.mismatch.curves.input_spline import LOOSE
from slipbench.identification.mismatch.fit.fitting import Fit, renoised, with_effects
from slipbench.identification.mismatch.fit.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.optimize import at_fixed_noise
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.free_curve import KNOTS
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

DIFFERENCE_STEP = 0.02


@dataclass(frozen=True)
class ModelSpline(Hypothesis):
    """A curve with its values as parameters, relative to the typical disturbance at its point.

    number: index of the curve in the model.
    """

    system: System
    injection: InjectionPoint
    curve: Curve
    parameters: tuple[float, ...]
    number: int

    @property
    def name(self) -> str:
        """Injection point and regressor."""
        return f"{self.injection.name} along {self.curve.regressor}"

    @property
    def deviations(self) -> tuple[float, ...]:
        """Prior deviation of each parameter, (p,): weak."""
        return (LOOSE,) * len(self.parameters)

    @property
    def difference_steps(self) -> tuple[float, ...]:
        """Finite-difference step of each parameter, (p,)."""
        return (DIFFERENCE_STEP,) * len(self.parameters)

    def effect(self) -> Effect:
        """Return the curve as an effect of the model."""
        values = self.injection.size * np.array(self.parameters)
        effect_of_curve = self.system.curve(
            self.injection, self.curve.regressor, self.curve.knots, values, self.number
        )
        assert effect_of_curve is not None
        return effect_of_curve

    def half_widths(self, reach: Floats) -> dict[str, float]:
        """Return the half widths of its values by key, SI. reach: those of its parameters, (p,)."""
        owner = getattr(self.effect(), "owner", "")
        halves = self.injection.size * reach
        return {f"{owner}.{k}": float(h) for k, h in enumerate(halves)} if owner else {}

    def moved(self, step: Floats) -> "ModelSpline":
        """Return it after a step of its parameters, (p,)."""
        return replace(self, parameters=tuple(float(d) for d in np.array(self.parameters) + step))

    def told(self) -> Curve:
        """Return the curve with the fitted values."""
        return replace(self.curve, values=self.injection.size * np.array(self.parameters))


def injection_of(base: Fit, curve: Curve) -> InjectionPoint | None:
    """Return the injection point of a curve; None where no disturbance can be injected there."""
    return next((p for p in places(base) if p.name == curve.place), None)


def simulable(base: Fit, curve: Curve) -> bool:
    """Return whether the model supports a curve with this injection point and regressor."""
    place, knots = injection_of(base, curve), np.arange(float(KNOTS))
    system = base.model.system
    return place is not None and system.curve(place, curve.regressor, knots, knots, 0) is not None


def simulated(base: Fit, curve: Curve) -> Fit | None:
    """Fit a curve in the model; None where the model does not support it or the run fails."""
    place, system, number = injection_of(base, curve), base.model.system, len(base.candidates)
    if place is None or not simulable(base, curve):
        return None
    spline = ModelSpline(
        system, place, curve, tuple(float(v) for v in curve.values / place.size), number
    )
    try:
        return renoised(at_fixed_noise(with_effects(base, (*base.candidates, spline)), 3))
    except PlantError:
        return None


def with_many_knots(knots: Floats) -> Floats:
    """Return KNOTS knots, the number of a curve in the model, spaced like those given."""
    return np.interp(np.linspace(0.0, knots.size - 1.0, KNOTS), np.arange(knots.size), knots)


def refined_knots(curve: Curve) -> Curve:
    """Return the curve with denser knots where its curvature is large."""
    z, f = curve.knots, curve.values
    curvature = np.abs(np.diff(np.diff(f) / np.diff(z)))
    density = np.convolve(np.pad(curvature, 1), (0.5, 0.5), "valid") + 1e-300
    share = 0.5 * density / density.sum() + 0.5 * np.diff(z) / (z[-1] - z[0])
    cumulative = np.concatenate(([0.0], np.cumsum(share)))
    knots = np.interp(np.linspace(0.0, cumulative[-1], KNOTS), cumulative, z)
    return replace(curve, knots=knots, values=curve(knots))


def newest(fit: Fit) -> ModelSpline:
    """Return the curve that was added last."""
    spline = fit.candidates[-1]
    assert isinstance(spline, ModelSpline)
    return spline
