"""Ways from samples to a model: ours, and those of packages, each used as its manual says.

Each gives the response at f (Hz) and the natural frequency of its resonance (Hz), from throttle u
and slip y at `rate`. State-space, ARX and NARX packages get the samples at 100 Hz without their
means, and enough order to stand for the delay.
"""

import numpy as np
from rides import estimated
from scipy import optimize, signal

from slipbench.identification.models.model_order import all_pole, choose_order
from slipbench.identification.response.independent_lines import independent_lines
from slipbench.identification.response.local_polynomial import sweep_response

SLOW = 100.0  # Hz
STATES = 6
LAGS = 6


def whole(one, f):
    """Ours as in the report: corrected for reference-sensor noise."""
    return _chain(estimated(one), f)


def slipbench(u, y, rate, f):
    """Ours: local polynomial and maximum likelihood, nothing taken as known."""
    return _chain(sweep_response(u, y, rate, (0.5, 12.0)), f)


def _chain(response, f):
    fit = choose_order(independent_lines(response), all_pole()).best_by_mdl.fit
    return fit.response(f), min(fit.modes, key=lambda m: m.damping).frequency


def arx(u, y, rate, f):
    """python-control and least squares: ARX, then its discrete transfer function."""
    import control

    u, y = _slow(u, y, rate)
    rows = [
        np.concatenate((-y[k - LAGS : k][::-1], u[k - LAGS : k][::-1])) for k in range(LAGS, y.size)
    ]
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
        order_selection=True,
        n_info_values=2 * LAGS,
        ylag=LAGS,
        xlag=LAGS,
        estimator=LeastSquares(),
        basis_function=Polynomial(degree=1),
        info_criteria="bic",
    )
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
