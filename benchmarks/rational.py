"""How close identification comes to a motorcycle whose truth is known, and how fast.

`python benchmarks/rational.py [seeds] [recording ...]` prints three tables:

1. Rides of the plant's own equations through its sensors, in arrays, without a bus: errors of first
   harmonic, delay and driveline, and how often 95 % intervals hold the truth, at several noises.
   The linear motorcycle is the demonstration's without optical lag and the effects that
   bend, so that one linear function is nearly the truth; the demonstration's own rows hold what
   those effects cost.
2. What is taken from PyPI for the same step, on the same samples, where it is installed.
3. The same of run folders that came over CAN, if any are named.

The truth of the first harmonic is what single sines of the same amplitude give without noise; the
driveline's is `plant.linear`. Where the optical sensor lags, the truth is seen through it. The
filling time and the driveline's c / k are taken as known from the vehicle file; nothing else is.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from rational_peers import PEERS

from identification.models.delay_profile import DelayProfile, delay_profile
from identification.models.model_order import all_pole, choose_order
from identification.models.rational_ml import RationalFit, fit_order
from identification.models.stable_rational import Order
from identification.paper.rational_trial import known_path
from identification.response.identify import identify
from identification.response.independent_lines import Lines, independent_lines, without
from identification.response.local_polynomial import sweep_response
from identification.response.response import FrequencyResponse
from identification.signals.filters import low_pass, notch, wheel_frequency
from identification.signals.samples import onto, sampled, smoothly
from identification.signals.slip import slip
from identification.signals.teeth import speed_from_teeth
from plant.encoder import begin, passing_teeth, toothed_disc
from plant.equilibrium import equilibrium
from plant.linear import linearise
from plant.signals import Inputs
from plant.simulation import Simulation
from plant.vehicle_file import builtin_vehicle, load_vehicle
from protocol import run_folder

GEAR, SPEED = 2, 14000 * np.pi / 30
RATE, BEFORE, LASTS, BAND = 1000.0, 2.0, 30.0, (0.5, 12.0)
AMPLITUDE = 0.02
COMBUSTION, WIND, WIND_TIME = 0.8, 12.0, 3.0  # N m, N, s, as on the virtual road
KEPT = {"tooth_misplacement"}  # effects of the linear motorcycle: this one leaves it linear
SEEDS, PROFILES = 200, 10
ORDER = Order(3, 0)


@dataclass(frozen=True)
class Ride:
    """One sweep: measured throttle and slip on the time base, (n,) each."""

    throttle: np.ndarray
    slip: np.ndarray


@cache
def vehicles():
    """Give the linear motorcycle and the demonstration."""
    whole = load_vehicle(builtin_vehicle("demonstration")).motorcycle
    kept = tuple(effect for effect in whole.effects if effect.name in KEPT)
    return {"linear": replace(whole, effects=kept), "demonstration": whole}


def ride(motorcycle, noise: float, seed: int) -> Ride:
    """Ride a throttle sweep; `noise` scales sensors' and road's noise, 1 is the virtual bench's."""
    rng = np.random.default_rng(seed)
    simulation = Simulation(motorcycle)
    state, opening = equilibrium(simulation, GEAR, SPEED)
    t = np.arange(0, LASTS + 2 * BEFORE, 1 / RATE)
    x = t - BEFORE
    turns = BAND[0] * x + (BAND[1] - BAND[0]) * x**2 / (2 * LASTS)
    wave = np.where((x >= 0) & (x < LASTS), np.sin(2 * np.pi * turns), 0.0)
    inputs = Inputs.held(
        t.size, gear=float(GEAR), throttle_command=opening + AMPLITUDE * wave,
        engine_disturbance=noise * COMBUSTION * rng.standard_normal(t.size),
        road_force=noise * gusts(t.size, rng),
    )  # fmt: skip
    _, out = simulation.advance(state, inputs)
    grid = t + 0.5 / RATE
    wheel = rear_speed(motorcycle, out, grid)
    stamps = np.arange(4e-3 * rng.random(), grid[-1], 4e-3)
    seen = np.interp(stamps, out.time, out.optical_speed)
    seen = seen + noise * 0.02 * rng.standard_normal(stamps.size)
    reference = low_pass(onto(sampled(stamps, np.round(seen / 0.01) * 0.01), grid), RATE, 60.0)
    position = np.interp(grid, out.time, out.throttle)
    position = position + noise * 3e-4 * rng.standard_normal(grid.size)
    inside = np.isfinite(wheel) & np.isfinite(reference)
    return Ride(position[inside], slip(wheel, reference).ratio[inside])


def gusts(n: int, rng) -> np.ndarray:
    """Wind that remembers itself for WIND_TIME. Returns N, (n,)."""
    from scipy.signal import lfilter

    keep = np.exp(-1 / RATE / WIND_TIME)
    return lfilter([WIND * np.sqrt(1 - keep**2)], [1, -keep], rng.standard_normal(n))


def rear_speed(motorcycle, out, grid: np.ndarray) -> np.ndarray:
    """Peripheral speed as the encoder tells it, filtered as identification does. m/s."""
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
def truth(motorcycle) -> Callable[[np.ndarray], np.ndarray]:
    """Response from throttle position to measured slip at this amplitude, the delay included.

    The plant's linearisation, times what single sines of the sweep's amplitude give beyond it,
    without noise and without instruments but the optical sensor.
    """
    names = ("throttle", "rear_speed", "optical_speed")
    linear = linearise(motorcycle, GEAR, SPEED, ("throttle_command",), names)
    v, w, r = linear.at["speed"], linear.at["rear_speed"], motorcycle.rear_wheel.radius

    def small(f: np.ndarray) -> np.ndarray:
        s = 2j * np.pi * f
        position, wheel, seen = (linear.system(s)[k, 0] for k in range(3))
        return (r * wheel / v - seen * r * w / v**2) / position * np.exp(-s * linear.delays["air"])

    at = np.geomspace(0.7, 12.0, 24)
    ratio = np.array([stepped(motorcycle, f) for f in at]) / small(at)
    return lambda f: small(f) * (np.interp(f, at, ratio.real) + 1j * np.interp(f, at, ratio.imag))


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
    seen = out.optical_speed[late]
    y = motorcycle.rear_wheel.radius * out.rear_speed[late] / seen - 1
    turn = 2 * np.pi * f * x
    drift = np.stack((np.ones(x.size), x - 4, (x - 4) ** 2), axis=1)
    harmonics = [g(k * turn) for k in (1, 2, 3) for g in (np.cos, np.sin)]
    basis = np.column_stack((*harmonics, drift))
    a, b = (np.linalg.lstsq(basis, z, rcond=None)[0][:2] for z in (out.throttle[late], y))
    return complex((b[0] - 1j * b[1]) / (a[0] - 1j * a[1]))


def driveline(motorcycle) -> tuple[float, float]:
    """Natural frequency (Hz) and damping of the driveline."""
    poles = linearise(motorcycle, GEAR, SPEED).system.poles()
    servo = motorcycle.throttle_servo.natural_frequency
    pair = next(p for p in poles if p.imag > 0 and abs(abs(p) - servo) > 1.0)
    return abs(pair) / (2 * np.pi), -pair.real / abs(pair)


@dataclass(frozen=True)
class Errors:
    """What one recording gave against the truth."""

    gain: np.ndarray  # %, of lines with coherence above 0.95
    phase: np.ndarray  # degrees
    model_gain: float  # %, greatest of the model over those lines
    model_phase: float  # degrees
    frequency: float  # %, of the driveline
    damping: float
    covered: tuple[float, ...]  # lines; model's gain; frequency; damping
    ratio: float  # chi-square
    seconds: float
    delay: tuple[float, float, float] | None  # estimate, low, high; ms


def judge(response: FrequencyResponse, motorcycle, profiled: bool) -> Errors:
    """Fit and compare. The order of the linear chain is given; the profile doubts it."""
    at = truth(motorcycle)
    true_frequency, true_damping = driveline(motorcycle)
    path = known_path(motorcycle)
    lines = independent_lines(response)
    assert isinstance(lines, Lines), lines
    rest = without(lines, path)
    begun = time.perf_counter()
    fit = fit_order(rest, ORDER)
    seconds = time.perf_counter() - begun
    good = response.coherence > 0.95
    good &= (response.frequency >= lines.frequency[0]) & (response.frequency <= lines.frequency[-1])
    f = response.frequency[good]
    off = response.value[good] / at(f)
    model = fit.response(f) * path.response(f) / at(f)
    mode = min(fit.modes, key=lambda m: m.damping)
    delay = None
    if profiled:
        p = delay_profile(choose_order(rest, all_pole()))
        delay = (1e3 * p.delay, 1e3 * p.low, 1e3 * p.high) if isinstance(p, DelayProfile) else None
    return Errors(
        100 * np.abs(np.abs(off) - 1), np.degrees(np.abs(np.angle(off))),
        100 * float(np.max(np.abs(np.abs(model) - 1))),
        float(np.degrees(np.max(np.abs(np.angle(model))))),
        100 * abs(mode.frequency / true_frequency - 1), 100 * abs(mode.damping / true_damping - 1),
        coverage(response, lines, fit, path, at, (true_frequency, true_damping)),
        fit.chi_square_ratio, seconds, delay,
    )  # fmt: skip


def coverage(response, lines, fit: RationalFit, path, at, true) -> tuple[float, ...]:
    """Share of 95 % intervals that hold the truth: lines, model, frequency, damping."""
    f = lines.frequency
    inside = np.isin(response.frequency, f)
    gain = np.abs(np.abs(lines.value) - np.abs(at(f))) < response.gain_band[inside]
    known = np.abs(path.response(f))
    model = np.abs(fit.response(f)) * known - np.abs(at(f))
    mode = min(fit.modes, key=lambda m: m.damping)
    return (
        float(np.mean(gain)), float(np.mean(np.abs(model) < fit.band(f) * known)),
        float(abs(mode.frequency - true[0]) < 1.96 * mode.frequency_deviation),
        float(abs(mode.damping - true[1]) < 1.96 * mode.damping_deviation),
    )  # fmt: skip


def estimated(of: Ride) -> FrequencyResponse:
    """First harmonic from measured throttle to slip."""
    return sweep_response(of.throttle, of.slip, RATE, BAND, ("throttle_position", "slip"))


def row(name: str, all_errors: list[Errors]) -> str:
    """Lay the errors of many recordings out in one line."""
    gain = np.concatenate([e.gain for e in all_errors])
    phase = np.concatenate([e.phase for e in all_errors])
    covered = 100 * np.mean([e.covered for e in all_errors], axis=0)
    told = [e.delay for e in all_errors if e.delay]
    off = np.array([abs(d - 10) for d, _, _ in told])
    held = np.mean([low <= 10 <= high for _, low, high in told])
    median = [np.median([getattr(e, k) for e in all_errors]) for k in (
        "model_gain", "model_phase", "frequency", "damping", "ratio", "seconds")]  # fmt: skip
    return (
        f"{name:24}{len(all_errors):5}{np.median(gain):6.2f}{np.percentile(gain, 95):6.2f}"
        f"{np.median(phase):6.2f}{np.percentile(phase, 95):6.2f}{median[0]:7.2f}{median[1]:6.2f}"
        f"{median[2]:7.2f}{median[3]:6.2f}{np.median(off):7.2f}{np.max(off):6.2f}{100 * held:5.0f}"
        f"{covered[0]:7.1f}{covered[1]:6.1f}{covered[2]:6.1f}{covered[3]:6.1f}"
        f"{median[4]:6.2f}{1e3 * median[5]:6.0f}"
    )


HEAD = (
    f"{'':24}{'n':>5}{'lines':>12}{'lines':>12}{'model':>13}{'driveline':>13}{'delay':>18}"
    f"{'95 % intervals hold, %':>25}{'chi2':>6}{'fit':>6}\n"
    f"{'':29}{'gain p50,95 %':>12}{'phase, °':>11}{'max %':>8}{'°':>6}{'f %':>7}{'z %':>6}"
    f"{'p50':>7}{'max':>6}{'in %':>5}"
    f"{'lines':>7}{'model':>6}{'f':>6}{'z':>6}{'/dof':>6}{'ms':>6}"
)


def rides_table(seeds: int) -> None:
    """Print the first table."""
    print(f"one throttle sweep, {LASTS:g} s, {BAND[0]:g} to {BAND[1]:g} Hz, {AMPLITUDE:.0%}")
    print(HEAD)
    few = max(seeds // 10, 4)
    plan = (
        ("linear", 0.1, few), ("linear", 0.3, few), ("linear", 1.0, seeds), ("linear", 3.0, few),
        ("demonstration", 1.0, few),
    )  # fmt: skip
    for name, noise, count in plan:
        motorcycle = vehicles()[name]
        errors = [
            judge(estimated(ride(motorcycle, noise, seed)), motorcycle, seed < PROFILES)
            for seed in range(count)
        ]
        print(row(f"{name}, noise {noise:g}", errors))


def recordings_table(paths: list[str]) -> None:
    """Print what run folders of the demonstration motorcycle give, from their raw frames."""
    motorcycle = vehicles()["demonstration"]
    print("\nrun folders that came over CAN")
    print(HEAD)
    for path in paths:
        found = identify(run_folder.read(Path(path)))
        response = next(r for r in found.responses if r.input == "throttle_position")
        print(row(Path(path).name, [judge(response, motorcycle, profiled=True)]))


def peers_table() -> None:
    """Print errors and times of others on the same samples."""
    motorcycle = vehicles()["linear"]
    at = truth(motorcycle)
    data = ride(motorcycle, 1.0, 1)
    f = np.linspace(1.0, 11.5, 40)
    true_frequency = driveline(motorcycle)[0]
    print("\none ride of the linear motorcycle, noise 1; response from 1 to 11.5 Hz and resonance")
    print(f"{'':34}{'gain p50 %':>12}{'max %':>9}{'phase max °':>13}{'f %':>8}{'s':>9}")
    for name, (package, estimate) in PEERS.items():
        if package and find_spec(package) is None:
            print(f"{name:34}  not installed: pip install {package.replace('_', '-')}")
            continue
        begun = time.perf_counter()
        try:
            found, resonance = estimate(data.throttle, data.slip, RATE, f)
        except Exception as fault:  # a peer's own trouble is its row of the table
            print(f"{name:34}  {type(fault).__name__}: {str(fault)[:60]}")
            continue
        took = time.perf_counter() - begun
        off = found / at(f)
        gain = 100 * np.abs(np.abs(off) - 1)
        print(
            f"{name:34}{np.median(gain):12.2f}{gain.max():9.2f}"
            f"{np.degrees(np.max(np.abs(np.angle(off)))):13.2f}"
            f"{100 * abs(resonance / true_frequency - 1):8.2f}{took:9.2f}"
        )


def main(seeds: int = SEEDS, paths: tuple[str, ...] = ()) -> None:
    """Print all tables."""
    rides_table(seeds)
    peers_table()
    if paths:
        recordings_table(list(paths))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS, tuple(sys.argv[2:]))
