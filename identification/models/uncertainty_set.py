"""Uncertainty set of a robust design: nominal model, bound of the relative error, members.

    G(jw) = G_0(jw) (1 + Delta(jw)),  |Delta(jw)| <= |W(jw)|

G_0 is a rational function behind a dead time. W is stable and minimum phase, and lies above every
measured response, its 95 % band included, at every frequency that was measured (multiplicative
uncertainty: Doyle, Francis and Tannenbaum, Feedback Control Theory, 1992, chapter 4).

    found = uncertainty_set(nominal, [Member("53 m/s", response), ...])
    found.weight.to_control()                        # python-control, for mu or small gain
    uncertainty_file.write(found, path)              # TOML, and read(path)
    found.survives(loop)                             # |W T| < 1 at every frequency?
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import least_squares

from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.response.response import ComplexArray, FrequencyResponse
from slipbench.protocol.recording.channel import FloatArray

if TYPE_CHECKING:
    import control

FEWEST = 8  # lines
SECTIONS = 2  # of second order in the weight
POINTS = 200  # at which the bound is known
ROUNDS = 8
MARGIN = 1e-6  # by which the weight lies above the bound


@dataclass(frozen=True)
class Member:
    """One measured response, and at which speed, load or amplitude it was."""

    name: str
    response: FrequencyResponse


@dataclass(frozen=True)
class Weight:
    """W = gain prod (s^2 / a^2 + 2 z s / a + 1) / (s^2 / b^2 + 2 y s / b + 1), one row a section.

    sections: (m, 4) rows a (rad/s), z, b (rad/s), y, all positive: stable and minimum phase
    """

    gain: float
    sections: FloatArray

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Complex value at frequencies in Hz."""
        s = 2j * np.pi * np.asarray(frequency)
        value = np.full(s.shape, complex(self.gain))
        for a, z, b, y in self.sections:
            value *= (s * s / a**2 + 2 * z * s / a + 1) / (s * s / b**2 + 2 * y * s / b + 1)
        return value

    def to_control(self) -> "control.TransferFunction":
        """The weight as a python-control object, rad/s."""
        import control

        whole = control.tf([self.gain], [1.0])
        for a, z, b, y in self.sections:
            whole *= control.tf([1 / a**2, 2 * z / a, 1.0], [1 / b**2, 2 * y / b, 1.0])
        return whole


@dataclass(frozen=True)
class UncertaintySet:
    """Nominal model, weight, and the members that were measured.

    frequency  (n,) Hz at which the bound is known; nothing is said beyond
    bound      (n,) largest relative distance of a member from the nominal model, band included
    members    name -> complex response at `frequency`, NaN where a member was not measured
    """

    nominal: RationalModel
    weight: Weight
    frequency: FloatArray
    bound: FloatArray
    members: dict[str, ComplexArray]

    def survives(self, loop: ComplexArray) -> bool:
        """Whether a stable nominal loop stays stable for all of the set: |W T| < 1.

        loop: (n,) loop gain C G_0 at `frequency`; T = L / (1 + L).
        """
        complementary = loop / (1 + loop)
        return bool(np.all(np.abs(self.weight.response(self.frequency) * complementary) < 1))

    def to_control(self) -> tuple["control.StateSpace", float, "control.TransferFunction"]:
        """Nominal model without delay, its delay in s, and the weight."""
        return self.nominal.to_state_space(), self.nominal.delay, self.weight.to_control()


@dataclass(frozen=True)
class NoSet:
    """Why there is no uncertainty set."""

    reason: str


def uncertainty_set(nominal: RationalModel, members: Sequence[Member]) -> UncertaintySet | NoSet:
    """Bound the distance of measured responses from a nominal model, and fit a weight above it."""
    if not nominal.stable:
        return NoSet("the nominal model is not stable")
    if not members:
        return NoSet("no measured response")
    known = [member.response.frequency[member.response.reliable] for member in members]
    for member, frequency in zip(members, known, strict=True):
        if frequency.size < FEWEST:
            return NoSet(f"{member.name}: {frequency.size} lines are reliable, {FEWEST} are needed")
    low, high = min(f[0] for f in known), max(f[-1] for f in known)
    frequency = np.geomspace(low, high, POINTS)
    bound = np.nanmax([_distance(nominal, m.response, frequency) for m in members], axis=0)
    values = {m.name: _on(frequency, m.response) for m in members}
    return UncertaintySet(nominal, fit_weight(frequency, bound), frequency, bound, values)


def fit_weight(frequency: FloatArray, bound: FloatArray, sections: int = SECTIONS) -> Weight:
    """Fit a weight that follows a bound and lies above it everywhere.

    frequency: Hz, (n,); bound: (n,), positive. Least squares on logarithms, repeated with more
    weight on what lies above (Lawson), then lifted until nothing does.
    """
    target, share = np.log(np.maximum(bound, 1e-4)), np.ones(bound.size)
    p = _start(frequency, bound, sections)
    for _ in range(ROUNDS):
        p = _followed(frequency, target, share, p)
        share = share * np.exp(2 * np.clip(target - _logarithm(p, frequency), -1, 1))
        share = share / share.mean()
    lift = float(np.max(target - _logarithm(p, frequency)))
    return Weight(float(np.exp(p[0] + lift)) * (1 + MARGIN), np.exp(p[1:]).reshape(-1, 4))


def _followed(
    frequency: FloatArray, target: FloatArray, share: FloatArray, start: FloatArray
) -> FloatArray:
    def error(p: FloatArray) -> FloatArray:
        return np.asarray(np.sqrt(share) * (_logarithm(p, frequency) - target))

    found = least_squares(error, start, bounds=_limits(frequency, start.size // 4))
    return np.asarray(found.x)


def _logarithm(p: FloatArray, frequency: FloatArray) -> FloatArray:
    """Logarithm of the gain. p: logarithms of gain and sections."""
    shape = Weight(1.0, np.exp(p[1:]).reshape(-1, 4))
    return np.asarray(p[0] + np.log(np.abs(shape.response(frequency))))


def _start(frequency: FloatArray, bound: FloatArray, sections: int) -> FloatArray:
    """Flat, with a hump where the bound is highest; further sections do nothing yet."""
    centres = 2 * np.pi * np.geomspace(frequency[0], frequency[-1], sections + 1)[1:]
    centres[0] = 2 * np.pi * frequency[int(np.argmax(bound))]
    rows = [[np.log(c), 0.0, np.log(c), -0.5 if i == 0 else 0.1] for i, c in enumerate(centres)]
    return np.concatenate(([float(np.mean(np.log(np.maximum(bound, 1e-4))))], *rows))


def _limits(frequency: FloatArray, sections: int) -> tuple[FloatArray, FloatArray]:
    low, high = np.log(0.2 * np.pi * frequency[0]), np.log(20 * np.pi * frequency[-1])
    row = [(low, high), (np.log(0.05), np.log(5.0))] * 2
    lower, upper = np.array([(-20.0, 20.0), *row * sections]).T
    return lower, upper


def _distance(
    nominal: RationalModel, response: FrequencyResponse, frequency: FloatArray
) -> FloatArray:
    """|G - G_0| / |G_0| with the 95 % band; the greater of the lines beside each frequency."""
    lines = response.reliable
    f, at = response.frequency[lines], nominal.response(response.frequency[lines])
    far = np.abs(response.value[lines] - at) + response.gain_band[lines]
    relative = far / np.abs(at)
    right = np.clip(np.searchsorted(f, frequency), 1, f.size - 1)
    near = np.maximum(relative[right - 1], relative[right])
    return np.where((frequency >= f[0]) & (frequency <= f[-1]), near, np.nan)


def _on(frequency: FloatArray, response: FrequencyResponse) -> ComplexArray:
    lines = response.reliable
    f, value = response.frequency[lines], response.value[lines]
    inside = (frequency >= f[0]) & (frequency <= f[-1])
    return np.where(inside, np.interp(frequency, f, value), np.nan + 0j)
