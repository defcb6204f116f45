"""From a recording to what it tells: the one function that joins the analyses."""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.response.following import Following, following
from slipbench.identification.response.left_out import LeftOut, left_out
from slipbench.identification.response.resonance import NoResonance, Resonance, resonance
from slipbench.identification.response.response import FrequencyResponse
from slipbench.identification.response.responses import NoResponse, responses
from slipbench.identification.response.spectra import spectra
from slipbench.identification.signals.aligned import Aligned, aligned
from slipbench.identification.signals.dataset import Dataset, dataset
from slipbench.identification.signals.motion import Motion, NoMotion, motion
from slipbench.identification.signals.spectrum import Spectrum
from slipbench.identification.signals.trial_window import NoExcitation, TrialWindow, trial_window
from slipbench.protocol.recording.recording import Recording


@dataclass(frozen=True)
class Identification:
    """All that was found in a recording; `main` is the response that the trial was made for.

    following: how the slip followed its target, None where no controller had a target.
    """

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
    following: Following | None = None


def identify(recording: Recording) -> Identification:
    """Align, measure slip, estimate responses and spectra; what is not possible is said."""
    data = aligned(recording)
    base = dataset(data)
    moved, window = motion(data, base), trial_window(base)
    tried = _responses(base, moved, window, recording)
    found = tuple(r for r in tried if isinstance(r, FrequencyResponse))
    main = next((r for r in found if r.output == "slip"), None)
    peak = resonance(main) if main else NoResonance("no response to slip was measured")
    drawn = spectra(data, base, moved, window)
    left = left_out(data, moved, window, tried, drawn)
    followed = following(base, moved, window, recording.trial)
    return Identification(
        recording, data, base, moved, window, found, main, peak, drawn, left, followed
    )


def _responses(
    base: Dataset, moved: Motion | NoMotion, window: TrialWindow | NoExcitation, of: Recording
) -> tuple[FrequencyResponse | NoResponse, ...]:
    if isinstance(moved, NoMotion) or isinstance(window, NoExcitation):
        return ()
    return responses(base, moved, window, of.trial)


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
