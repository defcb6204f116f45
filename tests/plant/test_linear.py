"""Laws of the linear model, and the findings of the paper on the demonstration motorcycle."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.linear import LinearModel, linearise
from slipbench.plant.signals import Inputs
from slipbench.plant.simulation import Simulation

CRANK_SPEED = 1466.0
CUTOFF = 2 * np.pi * 10  # w_c of the servo with w_s = 2 pi 12.6 rad/s
LOW = 0.1 * CUTOFF  # below the resonance, above the slow drift of the speed


@pytest.fixture(scope="module")
def model(demonstration) -> LinearModel:
    return linearise(demonstration, 2, CRANK_SPEED)


def slip_response(model: LinearModel, frequency: np.ndarray, source: int) -> np.ndarray:
    """Slip per input, its gain and sign at low frequency taken as one."""
    both = model.system(1j * np.append(frequency, LOW))[0, source]
    return both[:-1] / abs(both[-1]) * np.sign(both[-1].real)


def test_operating_point_is_the_papers(model):
    assert model.at["speed"] == pytest.approx(53.0, abs=0.5)
    assert 0.005 < model.at["slip"] < 0.03


@pytest.mark.parametrize(("source", "low", "high"), [(0, 5.6, 6.4), (1, 3.6, 4.4)])
def test_slip_resonates_below_the_cutoff_less_damped_from_the_throttle(model, source, low, high):
    frequency = np.linspace(0.3, 1.2, 901) * CUTOFF
    gain = 20 * np.log10(np.abs(slip_response(model, frequency, source)))
    peak = frequency[gain.argmax()] / CUTOFF
    print(f"peak at {peak:.3f} w_c, {gain.max():.2f} dB")
    assert 0.74 < peak < 0.81
    assert low < gain.max() < high


def test_spark_leads_throttle_by_about_sixty_degrees_at_the_cutoff(model):
    frequency = np.array([0.9, 1.0]) * CUTOFF
    throttle, spark = (slip_response(model, frequency, source) for source in (0, 1))
    lead = np.degrees(np.angle(spark / throttle))
    print(f"lead at 0.9 and 1.0 w_c: {lead}")
    assert (lead > 45).all()
    assert (lead < 75).all()


def test_delay_behind_the_throttle_is_ten_milliseconds(model):
    assert model.delays["air"] == pytest.approx(10e-3)
    assert model.delays["throttle_command"] == pytest.approx(14e-3)
    assert model.delays["spark"] == pytest.approx(4e-3)


def test_the_linear_model_is_stable(model):
    assert model.system.poles().real.max() < 0.0


def harmonic(time: np.ndarray, values: np.ndarray, frequency: float) -> complex:
    """Return Z of Im(Z exp(i w t)), fitted beside a slow drift."""
    phase, slow = frequency * time, time - time.mean()
    basis = np.stack([np.sin(phase), np.cos(phase), *(slow**k for k in range(4))], axis=1)
    sine, cosine, *_ = np.linalg.lstsq(basis, values, rcond=None)[0]
    return complex(sine, cosine)


@pytest.mark.parametrize("source", ["throttle_command", "spark"])
def test_small_motion_of_the_simulation_is_that_of_the_linear_model(nominal, source):
    """At 5 Hz, gain and phase agree once the dead time and the command's hold are put back."""
    model = linearise(nominal, 2, CRANK_SPEED)
    frequency, period, rows = 2 * np.pi * 5, 1e-3, 4000
    simulation = Simulation(nominal, every=4)
    state, throttle = equilibrium(simulation, 2, CRANK_SPEED)
    size = 1e-4
    wave = size * np.sin(frequency * period * np.arange(rows))
    held = {"throttle_command": throttle, "gear": 2.0}
    held[source] = held.get(source, 0.0) + wave
    _, out = simulation.advance(state, Inputs.held(rows, **held))
    seen = harmonic(out.time[-1000:], out.slip[-1000:], frequency) / size
    delay = model.delays[source] + period / 2
    column = ("throttle_command", "spark").index(source)
    linear = model.system(1j * frequency)[0, column] * np.exp(-1j * frequency * delay)
    assert abs(seen / linear - 1) < 0.003


def test_more_stiffness_moves_the_resonance_up(demonstration):
    stiff = replace(demonstration, driveline=replace(demonstration.driveline, stiffness=2 * 3230.0))
    frequency = np.linspace(0.3, 2.0, 400) * CUTOFF
    peaks = [
        np.abs(slip_response(linearise(bike, 2, CRANK_SPEED), frequency, 1)).argmax()
        for bike in (demonstration, stiff)
    ]
    assert peaks[1] > peaks[0]
