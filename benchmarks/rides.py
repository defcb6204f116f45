"""Rides of motorcycles whose truth is known: the plant's own equations through its sensors.

In arrays, without a bus and without clocks that drift. `linear` removes the effects of a motorcycle
except the displaced tooth, so that one linear function is nearly the truth; `drawn` draws numbers
from the intervals of a vehicle file.

The truth of the first harmonic is what single sines of the same amplitude give without noise; the
driveline's is `plant.linear`. Where the optical sensor lags, the truth includes its lag.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from slipbench.identification.response.local_polynomial import sweep_response
from slipbench.identification.response.quiet_reference import with_quiet_reference
from slipbench.identification.response.response import FrequencyResponse
from slipbench.identification.signals.filters import low_pass, notch, wheel_frequency
from slipbench.identification.signals.samples import onto, sampled, smoothly
from slipbench.identification.signals.slip import slip
from slipbench.identification.signals.teeth import speed_from_teeth
from slipbench.plant.encoder import begin, passing_teeth, toothed_disc
from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.linear import linearise
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Inputs
from slipbench.plant.simulation import Simulation
from slipbench.plant.vehicle_file import Vehicle, load_vehicle
from slipbench.plant.vehicles import builtin_vehicle

GEAR, SPEED = 2, 14000 * np.pi / 30
FASTER = 1.01  # of the speed, for how the truth changes with it
RATE, BEFORE, BAND = 1000.0, 2.0, (0.5, 12.0)
AMPLITUDE = 0.02
COMBUSTION, WIND, WIND_TIME = 0.8, 12.0, 3.0  # N m, N, s, as on the virtual road
KEPT = {"tooth_misplacement"}  # effects of the linear motorcycle: this one leaves it linear
BLOCKS = ("throttle_servo", "driveline", "tyre", "body", "engine", "intake")  # that are drawn


@dataclass(frozen=True)
class Ride:
    """One sweep on the time base, (n,) each: throttle, and peripheral and reference speed, m/s."""

    throttle: np.ndarray
    driven: np.ndarray
    reference: np.ndarray

    @property
    def slip(self) -> np.ndarray:
        """As measured, (n,)."""
        return slip(self.driven, self.reference).ratio

    @property
    def speed(self) -> float:
        """Mean over ground during the sweep, m/s."""
        edge = round(BEFORE * RATE)
        return float(np.mean(self.reference[edge:-edge]))


@cache
def vehicle(name: str) -> Vehicle:
    """Load a vehicle of the project by its name."""
    return load_vehicle(builtin_vehicle(name))


@cache
def linear(name: str) -> Motorcycle:
    """Remove the effects that are nonlinear or lag."""
    whole = vehicle(name).motorcycle
    return replace(whole, effects=tuple(e for e in whole.effects if e.name in KEPT))


@cache
def drawn(name: str, seed: int) -> Motorcycle:
    """Draw a motorcycle from the intervals of a vehicle file: normal, 95 % within plus_minus."""
    rng, of = np.random.default_rng(seed), vehicle(name)
    made = linear(name)
    for key, half in sorted(of.plus_minus.items()):
        block, _, parameter = key.partition(".")
        if block not in BLOCKS:
            continue
        old = getattr(made, block)
        value = getattr(old, parameter)
        shift = float(np.clip(rng.normal(0, half / 1.96), -half, half))
        made = replace(
            made, **{block: replace(old, **{parameter: max(value + shift, 0.2 * value)})}
        )
    return made


def ride(motorcycle: Motorcycle, noise: float, seed: int, lasts: float = 30.0) -> Ride:
    """Ride a throttle sweep; `noise` scales sensors' and road's noise, 1 is the virtual bench's."""
    rng = np.random.default_rng(seed)
    simulation = Simulation(motorcycle)
    state, opening = equilibrium(simulation, GEAR, SPEED)
    t = np.arange(0, lasts + 2 * BEFORE, 1 / RATE)
    x = t - BEFORE
    turns = BAND[0] * x + (BAND[1] - BAND[0]) * x**2 / (2 * lasts)
    wave = np.where((x >= 0) & (x < lasts), np.sin(2 * np.pi * turns), 0.0)
    inputs = Inputs.held(
        t.size,
        gear=float(GEAR),
        throttle_command=opening + AMPLITUDE * wave,
        engine_disturbance=noise * COMBUSTION * rng.standard_normal(t.size),
        road_force=noise * gusts(t.size, rng),
    )
    _, out = simulation.advance(state, inputs)
    grid = t + 0.5 / RATE
    wheel = rear_speed(motorcycle, out, grid)
    stamps = np.arange(4e-3 * rng.random(), grid[-1], 4e-3)
    measured = np.interp(stamps, out.time, out.optical_speed)
    measured = measured + noise * 0.02 * rng.standard_normal(stamps.size)
    reference = low_pass(onto(sampled(stamps, np.round(measured / 0.01) * 0.01), grid), RATE, 60.0)
    position = np.interp(grid, out.time, out.throttle)
    position = position + noise * 3e-4 * rng.standard_normal(grid.size)
    inside = np.isfinite(wheel) & np.isfinite(reference)
    return Ride(position[inside], wheel[inside], reference[inside])


@cache
def still_speed(motorcycle: Motorcycle, lasts: float) -> float:
    """Mean speed over ground of a ride without noise and wind, m/s."""
    return ride(motorcycle, 0.0, 0, lasts).speed


def gusts(n: int, rng) -> np.ndarray:
    """Wind with correlation time WIND_TIME. Returns N, (n,)."""
    from scipy.signal import lfilter

    keep = np.exp(-1 / RATE / WIND_TIME)
    return lfilter([WIND * np.sqrt(1 - keep**2)], [1, -keep], rng.standard_normal(n))


def rear_speed(motorcycle, out, grid: np.ndarray) -> np.ndarray:
    """Peripheral speed from the encoder, filtered as identification does. m/s."""
    disc = toothed_disc(motorcycle.rear_encoder, motorcycle.effects, "rear_encoder")
    first = begin(float(out.time[0]), float(out.rear_angle[0]), float(out.rear_speed[0]))
    passed = passing_teeth(disc, first, out.time[1:], out.rear_angle[1:], out.rear_speed[1:])[1]
    teeth = speed_from_teeth(passed.ticks * disc.resolution, passed.numbers * 1.0, disc.angles.size)
    radius = motorcycle.rear_wheel.radius
    raw = smoothly(teeth, grid) * radius
    driven = low_pass(raw, RATE, 60.0)
    turning = wheel_frequency(raw, RATE, radius)
    for order in (1, 2, 3):
        driven = notch(driven, turning, RATE, order)
    return driven


@cache
def truth(motorcycle: Motorcycle) -> Callable[..., np.ndarray]:
    """Response from throttle position to measured slip at this amplitude, the delay included.

    The plant's linearisation, times what single sines of the sweep's amplitude give beyond it,
    without noise and without instruments but the optical sensor. Of (f, faster): wind gives every
    ride a mean speed of its own, faster (m/s) than in still air, and the gain falls by some 3 %
    per m/s.
    """
    (here, small), (there, quick) = (_small(motorcycle, x) for x in (SPEED, FASTER * SPEED))
    at = np.geomspace(0.7, 12.0, 24)
    ratio = np.array([stepped(motorcycle, f) for f in at]) / small(at)

    def at_speed(f: np.ndarray, faster: float = 0.0) -> np.ndarray:
        beyond = np.interp(f, at, ratio.real) + 1j * np.interp(f, at, ratio.imag)
        share = faster / (there - here)
        return small(f) * beyond * (1 + share * (quick(f) / small(f) - 1))

    return at_speed


def _small(motorcycle: Motorcycle, speed: float):
    """Speed over ground (m/s) and the linear response at an engine speed (rad/s)."""
    names = ("throttle", "rear_speed", "optical_speed")
    linear = linearise(motorcycle, GEAR, speed, ("throttle_command",), names)
    v, w, r = linear.at["speed"], linear.at["rear_speed"], motorcycle.rear_wheel.radius

    def small(f: np.ndarray) -> np.ndarray:
        s = 2j * np.pi * f
        position, wheel, measured = (linear.system(s)[k, 0] for k in range(3))
        return (
            (r * wheel / v - measured * r * w / v**2) / position * np.exp(-s * linear.delays["air"])
        )

    return v, small


def stepped(motorcycle, f: float) -> complex:
    """First harmonic of slip per throttle position at one frequency (Hz), after 3 s."""
    simulation = Simulation(motorcycle)
    state, opening = equilibrium(simulation, GEAR, SPEED)
    t = np.arange(0, 3 + np.ceil(6 * f) / f, 1 / RATE)
    wave = opening + AMPLITUDE * np.sin(2 * np.pi * f * t)
    inputs = Inputs.held(t.size, gear=float(GEAR), throttle_command=wave)
    _, out = simulation.advance(state, inputs)
    late = out.time > 3
    x = out.time[late]
    measured = out.optical_speed[late]
    y = motorcycle.rear_wheel.radius * out.rear_speed[late] / measured - 1
    turn = 2 * np.pi * f * x
    drift = np.stack((np.ones(x.size), x - 4, (x - 4) ** 2), axis=1)
    harmonics = [g(k * turn) for k in (1, 2, 3) for g in (np.cos, np.sin)]
    basis = np.column_stack((*harmonics, drift))
    a, b = (np.linalg.lstsq(basis, z, rcond=None)[0][:2] for z in (out.throttle[late], y))
    return complex((b[0] - 1j * b[1]) / (a[0] - 1j * a[1]))


def driveline(motorcycle: Motorcycle, faster: float = 0.0) -> tuple[float, float]:
    """Natural frequency (Hz) and damping of the driveline, faster (m/s) than in still air.

    NaN where it is not oscillatory.
    """
    here, there = (_swing(motorcycle, x) for x in (SPEED, FASTER * SPEED))
    share = faster / (there[0] - here[0])
    frequency, damping = (a + share * (b - a) for a, b in zip(here[1:], there[1:], strict=True))
    return frequency, damping


@cache
def _swing(motorcycle: Motorcycle, speed: float) -> tuple[float, float, float]:
    """Speed over ground, natural frequency and damping of the driveline at an engine speed."""
    linear = linearise(motorcycle, GEAR, speed)
    poles = linear.system.poles()
    servo = motorcycle.throttle_servo
    own = servo.natural_frequency * (-servo.damping + 1j * np.sqrt(1 - servo.damping**2))
    oscillatory = sorted((p for p in poles if p.imag > 0), key=lambda p: abs(p - own))
    if len(oscillatory) < 2:
        return float(linear.at["speed"]), float("nan"), float("nan")
    pair = oscillatory[1]
    natural = float(abs(pair) / (2 * np.pi))
    return float(linear.at["speed"]), natural, float(-pair.real / abs(pair))


def estimated(of: Ride) -> FrequencyResponse:
    """First harmonic from measured throttle to slip, as identification gives it."""
    raw = sweep_response(of.throttle, of.slip, RATE, BAND, ("throttle_position", "slip"))
    speeds = of.driven, of.reference
    return with_quiet_reference(raw, of.throttle, of.slip, *speeds, RATE, BAND)
