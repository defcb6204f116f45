"""From a recording to what it tells: the one function that joins the analyses."""

from dataclasses import dataclass

import numpy as np

from identification.aligned import Aligned, aligned
from identification.clocks import Unaligned
from identification.dataset import Dataset, dataset
from identification.motion import Motion, NoMotion, motion
from identification.resonance import NoResonance, Resonance, resonance
from identification.response import FrequencyResponse
from identification.responses import NoResponse, responses
from identification.spectrum import Spectrum, spectrum, steadiest
from identification.trial_window import NoExcitation, TrialWindow, trial_window
from protocol.channel import FloatArray
from protocol.recording import Recording


@dataclass(frozen=True)
class LeftOut:
    """An analysis that this recording does not carry, why, and the roles that it lacks."""

    analysis: str
    reason: str
    roles: tuple[str, ...] = ()


@dataclass(frozen=True)
class Identification:
    """All that was found in a recording; `main` is the response that the trial was made for."""

    recording: Recording
    data: Aligned
    base: Dataset
    motion: Motion | NoMotion
    window: TrialWindow | NoExcitation
    responses: tuple[FrequencyResponse, ...]
    main: FrequencyResponse | None
    resonance: Resonance | NoResonance
    spectra: tuple[Spectrum, ...]
    left_out: tuple[LeftOut, ...]


def identify(recording: Recording) -> Identification:
    """Align, measure slip, estimate responses and spectra; what is not possible is said."""
    data = aligned(recording)
    base = dataset(data)
    moved, window = motion(data, base), trial_window(base)
    tried = _responses(base, moved, window, recording)
    found = tuple(r for r in tried if isinstance(r, FrequencyResponse))
    main = next((r for r in found if r.output == "slip"), None)
    peak = resonance(main) if main else NoResonance("no response to slip was measured")
    spectra = _spectra(base, moved, window)
    left = _left_out(data, moved, window, tried, spectra)
    return Identification(recording, data, base, moved, window, found, main, peak, spectra, left)


def _responses(
    base: Dataset, moved: Motion | NoMotion, window: TrialWindow | NoExcitation, of: Recording
) -> tuple[FrequencyResponse | NoResponse, ...]:
    if isinstance(moved, NoMotion) or isinstance(window, NoExcitation):
        return ()
    return responses(base, moved.slip, window, of.trial)


def _spectra(
    base: Dataset, moved: Motion | NoMotion, window: TrialWindow | NoExcitation
) -> tuple[Spectrum, ...]:
    """Spectra of the excited stretch, else of the steadiest one."""
    speed = moved.raw if isinstance(moved, Motion) else base.get("engine_speed")
    if speed is None:
        return ()
    stretch = window.record if isinstance(window, TrialWindow) else steadiest(speed, base.rate)
    if stretch is None:
        return ()
    wheel = moved.wheel_frequency if isinstance(moved, Motion) else None
    sources: list[tuple[str, str, FloatArray | None]] = [
        ("engine_speed", "rad/s", base.get("engine_speed")),
        ("rear_suspension_travel", "m", base.get("rear_suspension_travel")),
        ("front_suspension_travel", "m", base.get("front_suspension_travel")),
    ]
    if isinstance(moved, Motion):
        sources.insert(0, (f"{moved.axle.axle} wheel speed", "m/s", moved.raw))
    made = [
        spectrum(role, unit, x, base.rate, stretch, wheel)
        for role, unit, x in sources
        if x is not None
    ]
    return tuple(s for s in made if s is not None)


def _left_out(
    data: Aligned,
    moved: Motion | NoMotion,
    window: TrialWindow | NoExcitation,
    tried: tuple[FrequencyResponse | NoResponse, ...],
    spectra: tuple[Spectrum, ...],
) -> tuple[LeftOut, ...]:
    left = [
        LeftOut(f"everything on the clock of {fit.clock}", fit.reason)
        for fit in data.clocks.values()
        if isinstance(fit, Unaligned)
    ]
    if isinstance(moved, NoMotion):
        left.append(LeftOut("slip", moved.reason, moved.roles))
    elif moved.slip.kind == "slip speed":
        left.append(LeftOut("slip as a ratio", moved.slip.statement))
    left += _without_response(data, moved, window)
    left += [
        LeftOut(f"response from {r.input} to {r.output}", r.reason, r.roles)
        for r in tried
        if isinstance(r, NoResponse)
    ]
    return (*left, *_without_spectrum(data, spectra))


def _without_response(
    data: Aligned, moved: Motion | NoMotion, window: TrialWindow | NoExcitation
) -> list[LeftOut]:
    name = "frequency response from throttle or spark to slip"
    inputs = ("throttle_command", "throttle_position", "spark_command")
    roles = () if any(map(data.has, inputs)) else (" or ".join(inputs),)
    if isinstance(window, NoExcitation):
        return [LeftOut(name, window.reason, (*window.roles, *roles))]
    if isinstance(moved, NoMotion):
        return [LeftOut(name, "there is no slip to answer", (*moved.roles, *roles))]
    return []


def _without_spectrum(data: Aligned, spectra: tuple[Spectrum, ...]) -> list[LeftOut]:
    drawn = {s.role for s in spectra}
    wanted = {"engine_speed": "engine speed", "rear_suspension_travel": "rear suspension travel"}
    return [
        LeftOut(f"spectrum of the {name}", data.absent.get(role, "not recorded"), (role,))
        for role, name in wanted.items()
        if role not in drawn and not data.has(role)
    ]


def slip_range(found: Identification) -> tuple[float, float] | None:
    """Give the 0.5 and 99.5 percentiles of slip, in the trial where there was one, else overall."""
    if isinstance(found.motion, NoMotion) or found.motion.slip.kind != "slip":
        return None
    window = found.window
    part = window.exciting if isinstance(window, TrialWindow) else slice(None)
    known = found.motion.slip.ratio[part]
    known = known[np.isfinite(known)]
    if not known.size:
        return None
    low, high = np.percentile(known, (0.5, 99.5))
    return float(low), float(high)
