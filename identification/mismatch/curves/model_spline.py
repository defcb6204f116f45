"""In-model spline: a curve evaluated on the simulated regressor, with its values as parameters.

The feedback of the curve on its own regressor is included. Knots are moved to where curvature is
large.
"""

from dataclasses import dataclass, replace

import numpy as np

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.injection import places
from slipbench.identification.mismatch.curves.input_spline import LOOSE, best_spread
from slipbench.identification.mismatch.curves.trace import responses_along, sensors_as_places
from slipbench.identification.mismatch.fit.fitting import Fit, renoised, with_effects
from slipbench.identification.mismatch.fit.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.optimize import at_fixed_noise
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint, at_sensor
from slipbench.identification.mismatch.simulation.regressor import TURN
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.free_curve import KNOTS
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

DIFFERENCE_STEP = 0.02


@dataclass(frozen=True)
class ModelSpline(Hypothesis):
    """A curve as a hypothesis; parameters: see `increments`, over the size of its place, (p,).

    number: index of the curve in the model. spread: prior deviation of the parameters.
    """

    system: System
    injection: InjectionPoint
    curve: Curve
    parameters: tuple[float, ...]
    number: int
    spread: float = LOOSE

    @property
    def name(self) -> str:
        """Injection point and regressor."""
        return f"{self.injection.name} along {self.curve.regressor}"

    @property
    def deviations(self) -> tuple[float, ...]:
        """Prior deviation of each parameter, (p,)."""
        return (self.spread,) * len(self.parameters)

    @property
    def difference_steps(self) -> tuple[float, ...]:
        """Finite-difference step of each parameter, (p,)."""
        return (DIFFERENCE_STEP,) * len(self.parameters)

    def effect(self) -> Effect:
        """Return the curve as an effect of the model."""
        knots, values = self.curve.knots, self.fitted_curve().values
        effect_of_curve = self.system.curve(
            self.injection, self.curve.regressor, knots, values, self.number
        )
        assert effect_of_curve is not None
        return effect_of_curve

    def half_widths(self, reach: Floats) -> dict[str, float]:
        """Return the half widths of its values by key, SI. reach: those of its parameters, (p,).

        They are too wide: errors of neighbouring increments partly cancel.
        """
        owner = getattr(self.effect(), "owner", "")
        halves = self.injection.size * np.sqrt(increments(self.curve) ** 2 @ reach**2)
        return {f"{owner}.{k}": float(h) for k, h in enumerate(halves)} if owner else {}

    def moved(self, step: Floats) -> "ModelSpline":
        """Return it after a step of its parameters, (p,)."""
        return replace(self, parameters=tuple(float(d) for d in np.array(self.parameters) + step))

    def fitted_curve(self) -> Curve:
        """Return the curve with the fitted values."""
        values = self.injection.size * increments(self.curve) @ np.array(self.parameters)
        return replace(self.curve, values=values)


def increments(curve: Curve) -> Floats:
    """Return the matrix from parameters to values, shape (knots, p).

    The parameters are the first value and, up to the root of the distance, the increments from knot
    to knot: a random walk, so that values at knots that no recording visits lie between their
    neighbours (Wahba, "Spline Models for Observational Data" (1990), section 1.4). Around a turn
    they are the values.
    """
    if curve.kind == TURN:
        return np.eye(curve.knots.size)
    far = np.diff(curve.knots)
    return np.tril(np.ones((far.size + 1, far.size + 1))) * np.sqrt([1.0, *(far / far.sum())])


def injection_of(base: Fit, curve: Curve) -> InjectionPoint | None:
    """Return the injection point of a curve; None where no curve can act.

    A curve can act at a sensor if the model supports it, or if the sensor drives no simulation: its
    error would act there as well.
    """
    point = next((p for p in places(base) if p.name == curve.place), None)
    if point is not None:
        return point
    sensor = next((p for p in sensors_as_places(base) if p.name == curve.place), None)
    if sensor is None or not (_supported(base, sensor, curve) or not _drives(base, sensor)):
        return None
    return sensor


def _drives(base: Fit, sensor: InjectionPoint) -> bool:
    """Return whether the recorded values of a sensor drive the simulation of a subsystem."""
    drivers = base.model.partition.subsystems.values()
    return any(sensor.name == at_sensor(source) for pairs in drivers for source, _ in pairs)


def _supported(base: Fit, place: InjectionPoint, curve: Curve) -> bool:
    knots = np.arange(float(KNOTS))
    return base.model.system.curve(place, curve.regressor, knots, knots, 0) is not None


def simulable(base: Fit, curve: Curve) -> bool:
    """Return whether the model supports a curve with this injection point and regressor."""
    place = injection_of(base, curve)
    return place is not None and _supported(base, place, curve)


def simulated(base: Fit, curve: Curve) -> Fit | None:
    """Fit a curve in the model; None where the model does not support it or the run fails."""
    place, system, number = injection_of(base, curve), base.model.system, len(base.candidates)
    if place is None or not simulable(base, curve):
        return None
    steps = np.linalg.solve(increments(curve), curve.values / place.size)
    parameters = tuple(float(v) for v in steps)
    spread = LOOSE if curve.kind == TURN else _spread(base, place, curve)
    spline = ModelSpline(system, place, curve, parameters, number, spread)
    try:
        return renoised(at_fixed_noise(with_effects(base, (*base.candidates, spline)), 3))
    except PlantError:
        return None


def _spread(base: Fit, place: InjectionPoint, curve: Curve) -> float:
    """Return the most likely prior deviation of the parameters of a curve."""
    responses = responses_along(base, place, curve.regressor, curve.knots)
    basis = place.size * increments(curve)
    scaled = [[one @ basis if one.size else one for one in group] for group in responses]
    return best_spread(base, scaled)


def with_many_knots(knots: Floats) -> Floats:
    """Return KNOTS knots, or twice as many as a detailed curve has, spaced like those given.

    knots: SI, (n,). More than KNOTS of them are those of a detailed curve; it gets 2 n - 1 knots.
    """
    count = KNOTS if knots.size <= KNOTS else 2 * knots.size - 1
    return np.interp(np.linspace(0.0, knots.size - 1.0, count), np.arange(knots.size), knots)


def refined_knots(curve: Curve) -> Curve:
    """Return the curve with denser knots where its curvature is large."""
    z, f = curve.knots, curve.values
    curvature = np.abs(np.diff(np.diff(f) / np.diff(z)))
    density = np.convolve(np.pad(curvature, 1), (0.5, 0.5), "valid") + 1e-300
    share = 0.5 * density / density.sum() + 0.5 * np.diff(z) / (z[-1] - z[0])
    cumulative = np.concatenate(([0.0], np.cumsum(share)))
    knots = np.interp(np.linspace(0.0, cumulative[-1], z.size), cumulative, z)
    return replace(curve, knots=knots, values=curve(knots))


def newest(fit: Fit) -> ModelSpline:
    """Return the curve that was added last."""
    spline = fit.candidates[-1]
    assert isinstance(spline, ModelSpline)
    return spline
