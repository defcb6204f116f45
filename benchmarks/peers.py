"""What a user would take from PyPI for the step from samples to a model, beside ours.

`python benchmarks/peers.py [seeds]` rides the linear motorcycle and prints errors and times of all
on the same samples, each used as its manual says. Each gives the response at f (Hz) and the natural
frequency of its resonance (Hz), from throttle and slip at `rate`. State-space, ARX and NARX
packages get the samples at 100 Hz without their means, and enough order to stand for the delay.
"""

import sys
import time
from importlib.util import find_spec

import numpy as np
from rides import RATE, driveline, linear, ride, truth
from scipy import optimize, signal

from identification.models.model_order import all_pole, choose_order
from identification.response.independent_lines import independent_lines
from identification.response.local_polynomial import sweep_response

SLOW = 100.0  # Hz
STATES = 6
LAGS = 6


def slipbench(u, y, rate, f):
    """Ours: local polynomial and maximum likelihood, nothing taken as known."""
    response = sweep_response(u, y, rate, (0.5, 12.0))
    fit = choose_order(independent_lines(response), all_pole()).best_by_mdl.fit
    return fit.response(f), min(fit.modes, key=lambda m: m.damping).frequency


def arx(u, y, rate, f):
    """python-control and least squares: ARX, then its discrete transfer function."""
    import control

    u, y = _slow(u, y, rate)
    rows = [np.concatenate((-y[k - LAGS : k][::-1], u[k - LAGS : k][::-1]))
            for k in range(LAGS, y.size)]  # fmt: skip
    found = np.linalg.lstsq(np.array(rows), y[LAGS:], rcond=None)[0]
    below = np.concatenate(([1.0], found[:LAGS]))
    system = control.tf(found[LAGS:], below, 1 / SLOW)
    return np.asarray(system(np.exp(2j * np.pi * f / SLOW))), _resonance(np.roots(below))


def welch(u, y, rate, f):
    """scipy.signal.csd over welch, 4 s segments; the resonance by a rational fit of it."""
    at, cross = signal.csd(u, y, rate, nperseg=int(4 * rate))
    _, power = signal.welch(u, rate, nperseg=int(4 * rate))
    G = cross / power
    value = np.interp(f, at, G.real) + 1j * np.interp(f, at, G.imag)
    return value, _fitted(f, value)[1]


def curve_fit(u, y, rate, f):
    """scipy.optimize.least_squares on Welch's response: two poles and a delay."""
    value, _ = welch(u, y, rate, f)
    return _fitted(f, value)


def n4sid(u, y, rate, f):
    """nfoursid: subspace identification."""
    import pandas as pd
    from nfoursid.nfoursid import NFourSID

    u, y = _slow(u, y, rate)
    table = pd.DataFrame({"u": u / u.std(), "y": y / y.std()})
    found = NFourSID(table, output_columns=["y"], input_columns=["u"], num_block_rows=20)
    found.subspace_identification()
    model, _ = found.system_identification(rank=STATES)
    return _state_space(model.a, model.b, model.c, model.d, f, y.std() / u.std())


def jax_sysid(u, y, rate, f):
    """jax-sysid: linear state space by Adam, then L-BFGS."""
    from jax_sysid.models import LinearModel

    u, y = _slow(u, y, rate)
    model = LinearModel(STATES, 1, 1, feedthrough=False)
    model.loss(rho_x0=1e-3, rho_th=1e-6)
    model.optimization(adam_epochs=500, lbfgs_epochs=1000, iprint=-1)
    model.fit((y / y.std())[:, None], (u / u.std())[:, None])
    A, B, C, D = model.ssdata()
    return _state_space(A, B, C, D, f, y.std() / u.std())


def sysidentpy(u, y, rate, f):
    """sysidentpy: linear ARX by FROLS."""
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    u, y = _slow(u, y, rate)
    model = FROLS(
        order_selection=True, n_info_values=2 * LAGS, ylag=LAGS, xlag=LAGS,
        estimator=LeastSquares(), basis_function=Polynomial(degree=1), info_criteria="bic",
    )  # fmt: skip
    model.fit(X=(u / u.std())[:, None], y=(y / y.std())[:, None])
    above, below = np.zeros(LAGS + 1), np.eye(1, LAGS + 1).ravel()
    for term, weight in zip(model.final_model[:, 0], np.ravel(model.theta), strict=True):
        if term // 1000 == 1:
            below[term % 1000] -= weight
        elif term // 1000 == 2:
            above[term % 1000] += weight
    z = np.exp(2j * np.pi * f / SLOW)
    G = np.polyval(above[::-1], 1 / z) / np.polyval(below[::-1], 1 / z) * y.std() / u.std()
    return G, _resonance(np.roots(below))


def _slow(u, y, rate):
    step = round(rate / SLOW)
    u, y = (signal.decimate(x - x.mean(), step, ftype="fir") for x in (u, y))
    return u, signal.detrend(y)


def _state_space(A, B, C, D, f, scale):
    z = np.exp(2j * np.pi * f / SLOW)
    eye = np.eye(len(A))
    G = np.array([(C @ np.linalg.solve(k * eye - A, B) + D).item() for k in z])
    return G * scale, _resonance(np.linalg.eigvals(A))


def _resonance(poles):
    """Natural frequency of the most lightly damped pair between 4 and 15 Hz; NaN where none is."""
    s = np.log(poles[np.abs(poles) > 1e-6].astype(complex)) * SLOW
    near = [p for p in s if p.imag > 0 and 4 < abs(p) / (2 * np.pi) < 15]
    best = min(near, key=lambda p: -p.real / abs(p), default=np.nan + 0j)
    return abs(best) / (2 * np.pi)


def _fitted(f, value):
    s = 2j * np.pi * f

    def model(x):
        w = 2 * np.pi * x[1]
        return x[0] * w**2 / (s**2 + 2 * x[2] * w * s + w**2) * np.exp(-s * x[3])

    def error(x):
        e = (model(x) - value) / np.abs(value).mean()
        return np.concatenate((e.real, e.imag))

    found = optimize.least_squares(error, [abs(value[0]), 8.0, 0.5, 0.01])
    return model(found.x), found.x[1]


PEERS = {
    "slipbench, nothing known": ("", slipbench),
    "python-control, ARX": ("control", arx),
    "scipy csd / welch": ("", welch),
    "scipy least_squares on welch": ("", curve_fit),
    "nfoursid, 6 states": ("nfoursid", n4sid),
    "sysidentpy, ARX by FROLS": ("sysidentpy", sysidentpy),
    "jax-sysid, 6 states": ("jax_sysid", jax_sysid),
}
"""name: (package that must be installed, estimate)."""
SEEDS, FIRST = 3, 310_000
AT = np.linspace(1.0, 11.5, 40)  # Hz


def judged(estimate, rides, motorcycle) -> tuple[float, float, float, float, float]:
    """Median and greatest error of gain (%), of phase (degrees), of the resonance (%); s a ride."""
    at, true = truth(motorcycle)(AT), driveline(motorcycle)[0]
    gain, phase, off, begun = [], [], [], time.perf_counter()
    for one in rides:
        value, resonance = estimate(one.throttle, one.slip, RATE, AT)
        gain.append(100 * np.abs(np.abs(value / at) - 1))
        phase.append(np.degrees(np.abs(np.angle(value / at))))
        off.append(100 * abs(resonance / true - 1))
    took = (time.perf_counter() - begun) / len(rides)
    return (float(np.median(gain)), float(np.max(gain)), float(np.max(phase)),
            float(np.median(off)), took)  # fmt: skip


def main(seeds: int) -> None:
    """Print the table; times are also told as ratios to ours."""
    motorcycle = linear("demonstration")
    rides = [ride(motorcycle, 1.0, FIRST + k) for k in range(seeds)]
    print(f"{seeds} rides of the linear motorcycle, noise 1; response from 1 to 11.5 Hz, resonance")
    head = f"{'':34}{'gain p50 %':>11}{'max %':>8}{'phase max °':>12}"
    print(f"{head}{'f p50 %':>9}{'s':>8}{'ratio':>8}")
    ours = None
    for name, (package, estimate) in PEERS.items():
        if package and find_spec(package) is None:
            print(f"{name:34}  absent: {package.replace('_', '-')} (benchmarks/peers.txt)")
            continue
        try:
            *errors, took = judged(estimate, rides, motorcycle)
        except Exception as fault:  # a peer's own trouble is its row of the table
            print(f"{name:34}  {type(fault).__name__}: {str(fault)[:60]}")
            continue
        ours = ours or took
        print(f"{name:34}{errors[0]:11.2f}{errors[1]:8.1f}{errors[2]:12.1f}{errors[3]:9.2f}"
              f"{took:8.2f}{took / ours:8.1f}")  # fmt: skip


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS)
