"""H-infinity: the controller that keeps weighted sensitivities smallest, then made small itself.

    min_C max_w | W_S S ; W_u C S ; W T |,   S = 1 / (1 + C G), T = 1 - S

W_S asks for rejection up to a corner and S below M_s beyond it; W_u grows where sensor noise would
shake the command; W bounds the uncertainty set, so that the synthesis sees what the loop must be
stable for. G is the nominal model, its delay, the loop's and half a hold as an all-pass.
Corners are raised until a measured member's margin, the set's |W T| or the noise says no: the same
conditions as for every other law, on the controller that will run (Skogestad and Postlethwaite
2005, sections 2.8, 9.3 and 11.5).

What the synthesis gives has the order of all of these together. Its integrator is set apart (the
weight's pole beside 0 is taken for one), the rest reduced by balanced residualisation to the least
order that costs nothing, and discretised by Tustin's rule. python-control calls SLICOT through
slycot for both; `available` tells whether it is installed.
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
from slipbench.identification.design.sampled import answer, sections
from slipbench.identification.models.uncertainty_set import UncertaintySet
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

if TYPE_CHECKING:
    import control

PADE = 4  # order of the all-pass
AT_REST = 1e-3  # pole of W_S over its corner: the integrator that the synthesis may not have
FADE = 8.0  # Hz, beyond which nobody asks for T
FORGETS = 5.0  # 1/s: whatever a limit left in the controller is a third of it after 0.2 s
FALL = 20.0  # weights that rise are flat again so many times beyond their corner


@dataclass(frozen=True)
class Synthesis:
    """integral: K_i, 1/s; shaping: sections of the rest, at steps of `period` s; order: of both."""

    integral: float
    shaping: tuple[tuple[float, ...], ...]
    period: float
    order: int

    def response(self, frequency: FloatArray) -> ComplexArray:
        """From error to command, complex, at frequencies in Hz, as `Compensator` computes it."""
        z = np.exp(2j * np.pi * np.asarray(frequency) * self.period)
        return np.asarray(answer(self.shaping, z) + self.integral * self.period / (z - 1))

    def reference_response(self, frequency: FloatArray) -> ComplexArray:
        """From reference to command, the loop open: the same as from the error."""
        return self.response(frequency)

    def controller(self, limits: Range) -> Compensator:
        """Return the controller, its command inside limits."""
        shaping = in_series(self.shaping)
        return Compensator(self.integral, shaping, self.period, limits, self.tracking_time)

    @property
    def tracking_time(self) -> float:
        """Time in which the integral does what the rest does at once, s, as a PI's T_i."""
        steady = float(np.real(answer(self.shaping, np.ones(1, complex))[0]))
        return max(abs(steady / self.integral), 0.02)


def available() -> bool:
    """Tell whether python-control finds SLICOT."""
    import control

    return bool(control.slycot_check())


@dataclass(frozen=True)
class Wishes:
    """corner: of W_S, Hz; peak: what S may rise to; effort: |C S| over its steady value at low
    frequency that costs as much as that peak; quiet: corner of W_u, Hz."""

    corner: float
    peak: float
    effort: float
    quiet: float


def synthesis(problem: Problem, wishes: Wishes) -> "control.StateSpace | None":
    """Return the optimal controller of full order in continuous time; None where SLICOT finds none.

    Needs slycot, see `available`.
    """
    import control

    plant, steady = _plant(problem)
    try:
        with warnings.catch_warnings():  # of python-control's own calls
            warnings.simplefilter("ignore", FutureWarning)
            found, _, _ = control.mixsyn(plant, *_weights(problem, wishes))
    except (control.ControlArgument, ValueError, ArithmeticError, linalg.LinAlgError):
        return None
    return found / steady


def _plant(problem: Problem) -> "tuple[control.StateSpace, float]":
    """Return the path with gain 1 at rest, and that gain."""
    import control

    model = problem.model
    steady = float(model.response(np.zeros(1))[0].real)
    late = control.pade(model.delay + problem.extra + 0.5 * problem.period, PADE)
    return model.to_state_space() * control.tf2ss(*late) / steady, steady


def _weights(problem: Problem, wishes: Wishes) -> "tuple[Any, Any, Any]":
    import control

    w = 2 * np.pi * wishes.corner
    sensitivity = control.tf([1 / wishes.peak, w], [1.0, AT_REST * w])
    n = 2 * np.pi * wishes.quiet
    effort = wishes.effort * control.tf([1 / n, 1.0], [1 / (FALL * n), 1.0])
    level, w = _envelope(problem.around)
    closed = level * control.tf([1 / w, 1.0], [1 / (FALL * w), 1.0])
    return control.tf2ss(sensitivity), control.tf2ss(effort), control.tf2ss(closed)


def _envelope(around: UncertaintySet | None) -> tuple[float, float]:
    """Bound the set's weight by one of first order that rises, the nearest above; level, rad/s.

    The humps of the weight itself are what a wide band at a slow line makes of it: a synthesis
    that is shown them puts a nearly undamped pair of poles of its own there, or an unstable one.
    T must fall beyond `FADE` in any case: for a narrow set it would be held up there by a pair of
    poles that rings for a second after every limit.
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
    """Set the integrator apart, reduce the rest to an order, discretise.

    corner: of W_S, Hz. None where the rest would run away at a limit, or ring long after it.
    """
    import control

    parted = _parted(full, AT_REST * 2 * np.pi * corner)
    if parted is None:
        return None
    integral, rest = parted
    if np.any(rest.poles().real > -FORGETS):
        return None
    with warnings.catch_warnings():  # an order above the least is taken for the least
        warnings.simplefilter("ignore")
        small = control.balred(rest, min(order - 1, rest.nstates), method="matchdc")
    held = control.sample_system(small, period, "tustin")
    zeros, poles = held.zeros().astype(complex), held.poles().astype(complex)
    if np.any(np.abs(poles) > np.exp(-FORGETS * period)):
        return None
    at = np.exp(2j * np.pi * 5.0 * period)  # 5 Hz: a rest may be 0 at rest
    ratio = np.prod(at - zeros) / np.prod(at - poles)
    gain = float(np.real(held(at) / ratio))
    return Synthesis(integral, sections(zeros, poles, gain), period, poles.size + 1)


def _parted(
    full: "control.StateSpace", slowest: float
) -> "tuple[float, control.StateSpace] | None":
    """Part a system at its pole beside -slowest (rad/s): its residue, and what is left."""
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
