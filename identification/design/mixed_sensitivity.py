"""H-infinity mixed-sensitivity synthesis with order reduction.

    min_C max_w | W_S S ; W_u C S ; W T |,   S = 1 / (1 + C G), T = 1 - S

W_S requires rejection up to a corner frequency and |S| below M_s above it; W_u limits the command
noise; W bounds the uncertainty set. G is the nominal model with its dead time, the loop delay and
half a sample as an all-pass. The corner is raised until a margin of a measured member, the robust
stability of the set or the command noise reaches its limit: the same conditions as for every other
law, checked on the discrete controller (Skogestad and Postlethwaite 2005, sections 2.8, 9.3, 11.5).

The synthesis returns the order of plant and weights together. Its integrator is separated (the pole
of the weight near 0 counts as one), the remainder is reduced by balanced residualisation to the
lowest sufficient order and discretised by Tustin's rule. python-control calls SLICOT through slycot
for both; `available` returns whether it is installed.
"""

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import linalg

from slipbench.controllers.compensator import Compensator
from slipbench.controllers.limits import Range
from slipbench.controllers.linear import in_series
from slipbench.identification.design.problem import Problem
from slipbench.identification.design.sampled import sections, sections_response
from slipbench.identification.models.uncertainty_set import UncertaintySet
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

if TYPE_CHECKING:
    import control

PADE = 4  # order of the all-pass
AT_REST = 1e-3  # pole of W_S over its corner: the integrator that the synthesis may not have
FADE = 8.0  # Hz, above which |T| is not required
FORGETS = 5.0  # 1/s, slowest allowed pole of the remainder: its state decays to a third in 0.2 s
FALL = 20.0  # ratio of the upper to the lower corner of a rising weight


@dataclass(frozen=True)
class Synthesis:
    """integral: K_i, 1/s; shaping: sections of the remainder, at steps of `period` s; order: of both."""

    integral: float
    shaping: tuple[tuple[float, ...], ...]
    period: float
    order: int

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Frequency response from error to command, complex, of `Compensator`. frequency: Hz, (n,)."""
        z = np.exp(2j * np.pi * np.asarray(frequency) * self.period)
        return np.asarray(
            sections_response(self.shaping, z) + self.integral * self.period / (z - 1)
        )

    def reference_response(self, frequency: FloatArray) -> ComplexArray:
        """Open-loop response from reference to command, the same as from the error. Hz, shape (n,)."""
        return self.response(frequency)

    def controller(self, limits: Range) -> Compensator:
        """Controller with its command limited."""
        shaping = in_series(self.shaping)
        return Compensator(self.integral, shaping, self.period, limits, self.tracking_time)

    @property
    def tracking_time(self) -> float:
        """Tracking time of the anti-windup, s: integral time T_i of the equivalent PI."""
        steady = float(np.real(sections_response(self.shaping, np.ones(1, complex))[0]))
        return max(abs(steady / self.integral), 0.02)


def available() -> bool:
    """Whether python-control finds SLICOT."""
    import control

    return bool(control.slycot_check())


@dataclass(frozen=True)
class WeightParameters:
    """corner: of W_S, Hz; peak: limit of |S|; effort: weight of |C S| relative to its steady value at
    low frequency; quiet: corner of W_u, Hz."""

    corner: float
    peak: float
    effort: float
    quiet: float


def synthesis(problem: Problem, weights: WeightParameters) -> "control.StateSpace | None":
    """Optimal continuous-time controller of full order; None where SLICOT finds none.

    Needs slycot, see `available`.
    """
    import control

    plant, steady = _plant(problem)
    try:
        with warnings.catch_warnings():  # of python-control's own calls
            warnings.simplefilter("ignore", FutureWarning)
            found, _, _ = control.mixsyn(plant, *_weights(problem, weights))
    except (control.ControlArgument, ValueError, ArithmeticError, linalg.LinAlgError):
        return None
    return found / steady


def _plant(problem: Problem) -> "tuple[control.StateSpace, float]":
    """Path normalised to DC gain 1, and its DC gain."""
    import control

    model = problem.model
    steady = float(model.response(np.zeros(1))[0].real)
    late = control.pade(model.delay + problem.extra + 0.5 * problem.period, PADE)
    return model.to_state_space() * control.tf2ss(*late) / steady, steady


def _weights(problem: Problem, weights: WeightParameters) -> "tuple[Any, Any, Any]":
    import control

    w = 2 * np.pi * weights.corner
    sensitivity = control.tf([1 / weights.peak, w], [1.0, AT_REST * w])
    n = 2 * np.pi * weights.quiet
    effort = weights.effort * control.tf([1 / n, 1.0], [1 / (FALL * n), 1.0])
    level, w = _envelope(problem.around)
    closed = level * control.tf([1 / w, 1.0], [1 / (FALL * w), 1.0])
    return control.tf2ss(sensitivity), control.tf2ss(effort), control.tf2ss(closed)


def _envelope(around: UncertaintySet | None) -> tuple[float, float]:
    """Level and corner (rad/s) of the nearest first-order rising weight above that of the set.

    The weight of the set has humps where a bin has a wide interval. A synthesis with these humps
    places a nearly undamped or unstable pole pair there. |T| must fall above `FADE` in any case: for
    a narrow set a lightly damped pole pair would otherwise ring for a second after each limit.
    """
    if around is None:
        return 1.0, 2 * np.pi * FADE
    f = around.frequency
    size = np.abs(around.weight.response(f))
    corners = np.geomspace(f[0], f[-1], 40)
    shapes = np.abs((1 + 1j * f / corners[:, None]) / (1 + 1j * f / (FALL * corners[:, None])))
    levels = np.max(size / shapes, axis=1)
    nearest = int(np.argmin(np.mean(np.log(levels[:, None] * shapes), axis=1)))
    return max(float(levels[nearest]), 1.0), 2 * np.pi * min(float(corners[nearest]), FADE)


def reduced(
    full: "control.StateSpace", order: int, corner: float, period: float
) -> Synthesis | None:
    """Discrete controller of reduced order with its integrator separated.

    corner: of W_S, Hz; period: s. None where the remainder is unstable or decays too slowly.
    """
    import control

    separated = _separated(full, AT_REST * 2 * np.pi * corner)
    if separated is None:
        return None
    integral, rest = separated
    if np.any(rest.poles().real > -FORGETS):
        return None
    with warnings.catch_warnings():  # for orders above the minimal one
        warnings.simplefilter("ignore")
        small = control.balred(rest, min(order - 1, rest.nstates), method="matchdc")
    held = control.sample_system(small, period, "tustin")
    zeros, poles = held.zeros().astype(complex), held.poles().astype(complex)
    if np.any(np.abs(poles) > np.exp(-FORGETS * period)):
        return None
    at = np.exp(2j * np.pi * 5.0 * period)  # 5 Hz: the remainder may have DC gain 0
    ratio = np.prod(at - zeros) / np.prod(at - poles)
    gain = float(np.real(held(at) / ratio))
    return Synthesis(integral, sections(zeros, poles, gain), period, poles.size + 1)


def _separated(
    full: "control.StateSpace", slowest: float
) -> "tuple[float, control.StateSpace] | None":
    """Residue of the pole near -slowest (rad/s), and the remaining system; None without it."""
    import control

    near = min(full.poles(), key=lambda p: abs(p + slowest))
    if abs(near + slowest) > 0.5 * slowest or abs(near.imag) > 0.0:
        return None

    def here(re: float, im: float = 0.0) -> bool:
        return bool(abs(complex(re, im) - near) < 1e-6 * slowest)

    A, Z, _ = linalg.schur(full.A, output="real", sort=here)
    B, C = Z.T @ full.B, full.C @ Z
    X = linalg.solve_sylvester(A[:1, :1], -A[1:, 1:], -A[:1, 1:])
    residue = float(((C[:, :1]) @ (B[:1] - X @ B[1:])).item())
    rest = control.ss(A[1:, 1:], B[1:], C[:, 1:] + C[:, :1] @ X, full.D)
    return residue, rest
