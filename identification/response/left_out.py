"""Analyses that a recording does not support: which, why, and the roles that are missing."""

from dataclasses import dataclass

from slipbench.identification.response.response import FrequencyResponse
from slipbench.identification.response.responses import NoResponse
from slipbench.identification.signals.aligned import Aligned
from slipbench.identification.signals.clocks import Unaligned
from slipbench.identification.signals.motion import Motion, NoMotion
from slipbench.identification.signals.spectrum import Spectrum
from slipbench.identification.signals.trial_window import NoExcitation, TrialWindow

Tried = tuple[FrequencyResponse | NoResponse, ...]


@dataclass(frozen=True)
class LeftOut:
    """An analysis that this recording does not support, why, and the roles that it lacks."""

    analysis: str
    reason: str
    roles: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return it as one line."""
        missing = f"; missing: {', '.join(self.roles)}" if self.roles else ""
        return f"{self.analysis} ({self.reason}{missing})"


def left_out(
    data: Aligned,
    moved: Motion | NoMotion,
    window: TrialWindow | NoExcitation,
    responses: Tried,
    spectra: tuple[Spectrum, ...],
    pair: tuple[str, str] | None,
) -> tuple[LeftOut, ...]:
    """List every analysis that was left out. pair: selected input and output.

    A pair without slip asks for its response alone, of any machine.
    """
    clocks = [
        LeftOut(f"everything on the clock of {fit.clock}", fit.reason)
        for fit in data.clocks.values()
        if isinstance(fit, Unaligned)
    ]
    refused = [
        LeftOut(f"response from {r.input} to {r.output}", r.reason, r.roles)
        for r in responses
        if isinstance(r, NoResponse)
    ]
    if pair is not None and "slip" not in pair:
        return (*clocks, *refused)
    without = (*_without_slip(moved), *_without_response(data, moved, window))
    return (*clocks, *without, *refused, *_without_spectrum(data, spectra))


def _without_slip(moved: Motion | NoMotion) -> list[LeftOut]:
    if isinstance(moved, NoMotion):
        return [LeftOut("slip", moved.reason, moved.roles)]
    if moved.slip.kind == "slip speed":
        return [LeftOut("slip as a ratio", moved.slip.statement)]
    return []


def _without_response(
    data: Aligned, moved: Motion | NoMotion, window: TrialWindow | NoExcitation
) -> list[LeftOut]:
    name = "frequency response from throttle or spark to slip"
    inputs = ("throttle_command", "throttle_position", "spark_command")
    roles = () if any(map(data.has, inputs)) else (" or ".join(inputs),)
    if isinstance(window, NoExcitation):
        return [LeftOut(name, window.reason, (*window.roles, *roles))]
    if isinstance(moved, NoMotion):
        return [LeftOut(name, "no slip was measured", (*moved.roles, *roles))]
    return []


def _without_spectrum(data: Aligned, spectra: tuple[Spectrum, ...]) -> list[LeftOut]:
    drawn = {s.role for s in spectra}
    names = {"engine_speed": "engine speed", "rear_suspension_travel": "rear suspension travel"}
    return [
        LeftOut(f"spectrum of the {name}", data.absent.get(role, "not recorded"), (role,))
        for role, name in names.items()
        if role not in drawn and not data.has(role)
    ]
