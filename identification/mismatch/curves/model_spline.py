"""A curve that the simulation knows: evaluated on its own motion, its values fitted as dials.

What the curve does acts back on what drives it. Knots move to where it bends.
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
    """A curve with its values as dials, in pushes worth trying at its place. number: of several."""

    system: System
    injection: InjectionPoint
    curve: Curve
    parameters: tuple[float, ...]
    number: int

    @property
    def name(self) -> str:
        """Where it acts and along what."""
        return f"{self.injection.name} along {self.curve.regressor}"

    @property
    def deviations(self) -> tuple[float, ...]:
        """Loose."""
        return (LOOSE,) * len(self.parameters)

    @property
    def difference_steps(self) -> tuple[float, ...]:
        """Small beside a push worth trying."""
        return (DIFFERENCE_STEP,) * len(self.parameters)

    def effect(self) -> Effect:
        """Return the effect of the simulation."""
        values = self.injection.size * np.array(self.parameters)
        found = self.system.curve(
            self.injection, self.curve.regressor, self.curve.knots, values, self.number
        )
        assert found is not None
        return found

    def half_widths(self, reach: Floats) -> dict[str, float]:
        """Return the half widths of its values by key, SI. reach: those of its dials."""
        owner = getattr(self.effect(), "owner", "")
        halves = self.injection.size * reach
        return {f"{owner}.{k}": float(h) for k, h in enumerate(halves)} if owner else {}

    def moved(self, step: Floats) -> "ModelSpline":
        """Return it with other values."""
        return replace(self, parameters=tuple(float(d) for d in np.array(self.parameters) + step))

    def told(self) -> Curve:
        """Return the curve with its values."""
        return replace(self.curve, values=self.injection.size * np.array(self.parameters))


def injection_of(base: Fit, curve: Curve) -> InjectionPoint | None:
    """Return where a curve acts; None where nothing can be pushed there."""
    return next((p for p in places(base) if p.name == curve.place), None)


def simulable(base: Fit, curve: Curve) -> bool:
    """Tell whether the simulation knows a curve at this place along this quantity."""
    place, knots = injection_of(base, curve), np.arange(float(KNOTS))
    system = base.model.system
    return place is not None and system.curve(place, curve.regressor, knots, knots, 0) is not None


def simulated(base: Fit, curve: Curve) -> Fit | None:
    """Fit a curve in the simulation; None where it does not know such a curve."""
    place, system, number = injection_of(base, curve), base.model.system, len(base.candidates)
    if place is None or not simulable(base, curve):
        return None
    bent = ModelSpline(
        system, place, curve, tuple(float(v) for v in curve.values / place.size), number
    )
    try:
        return renoised(at_fixed_noise(with_effects(base, (*base.candidates, bent)), 3))
    except PlantError:
        return None


def with_many_knots(knots: Floats) -> Floats:
    """As many knots as a curve in the simulation has, spread like those given."""
    return np.interp(np.linspace(0.0, knots.size - 1.0, KNOTS), np.arange(knots.size), knots)


def refined_knots(curve: Curve) -> Curve:
    """Return the curve with knots nearer to each other where it bends."""
    z, f = curve.knots, curve.values
    bend = np.abs(np.diff(np.diff(f) / np.diff(z)))
    mass = np.convolve(np.pad(bend, 1), (0.5, 0.5), "valid") + 1e-300
    share = 0.5 * mass / mass.sum() + 0.5 * np.diff(z) / (z[-1] - z[0])
    reached = np.concatenate(([0.0], np.cumsum(share)))
    knots = np.interp(np.linspace(0.0, reached[-1], KNOTS), reached, z)
    return replace(curve, knots=knots, values=curve(knots))


def newest(fit: Fit) -> ModelSpline:
    """Return the curve that was put in last."""
    bent = fit.candidates[-1]
    assert isinstance(bent, ModelSpline)
    return bent
