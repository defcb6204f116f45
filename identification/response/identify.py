"""Identification of a recording: all analyses, joined in one function."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slipbench.identification.response.following import Following, following
from slipbench.identification.response.left_out import LeftOut, left_out
from slipbench.identification.response.resonance import NoResonance, Resonance, resonance
from slipbench.identification.response.response import FrequencyResponse
from slipbench.identification.response.responses import NoResponse, chosen_response, responses
from slipbench.identification.response.selection import Selection, selected_pair, selected_window
from slipbench.identification.response.spectra import spectra
from slipbench.identification.signals.aligned import Aligned, aligned
from slipbench.identification.signals.dataset import Dataset, dataset
from slipbench.identification.signals.motion import Motion, NoMotion, motion
from slipbench.identification.signals.named import named_signals, stated_unit, unit_of
from slipbench.identification.signals.spectrum import Spectrum
from slipbench.identification.signals.trial_window import NoExcitation, TrialWindow, trial_window
from slipbench.protocol.extras import optional_library
from slipbench.protocol.notebook import card, table
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.recording.recording import Recording


@dataclass(frozen=True)
class Identification:
    """Results of a recording; `main` is the response that the trial was made for.

    following: how the slip followed its target, None where no controller had a target.
    pair: input and output that the user selected, None where they are the trial's.
    selected: window that the user selected, s, None where it is the trial's.
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
    pair: tuple[str, str] | None = None
    selected: tuple[float, float] | None = None

    @property
    def without_slip(self) -> bool:
        """Whether the user selected an input and an output of any machine, none of them slip."""
        return self.pair is not None and "slip" not in self.pair

    def signals(self) -> dict[str, tuple[FloatArray, str]]:
        """Every signal on the common time base `base.time`: values of shape (n,) and SI unit.

        Beside the recorded roles: slip (1) and slip_speed (m/s), where they are known. NaN where a
        value is not known.
        """
        return named_signals(self.base, self.motion)

    def to_pandas(self) -> Any:
        """A pandas.DataFrame of all signals in SI on one time base, indexed by time in s.

        Units are in `attrs["units"]`. Raises InputError where pandas is not installed.
        """
        pandas = optional_library("pandas")
        signals = self.signals()
        index = pandas.Index(self.base.time, name="time")
        frame = pandas.DataFrame({name: value for name, (value, _) in signals.items()}, index)
        frame.attrs["units"] = {name: unit for name, (_, unit) in signals.items()}
        return frame

    def to_xarray(self) -> Any:
        """An xarray.Dataset of all signals in SI over one dimension "time" in s, with units.

        Raises InputError where xarray is not installed.
        """
        xarray = optional_library("xarray")
        return xarray.Dataset(
            {n: ("time", value, {"units": unit}) for n, (value, unit) in self.signals().items()},
            {"time": ("time", self.base.time, {"units": "s"})},
        )

    def _repr_html_(self) -> str:
        rows = [
            (r.input, r.output, float(r.frequency[0]), float(r.frequency[-1]), r.method)
            for r in self.responses
        ]
        head = ("input", "output", "from, Hz", "to, Hz", "method")
        peak = self.resonance
        lines = (
            [f"Resonance at {peak.frequency:.2f} Hz, {peak.peak:.2f} times the low-frequency gain."]
            if isinstance(peak, Resonance)
            else [f"No resonance: {peak.reason}."]
        )
        missing = [(one.analysis, one.reason) for one in self.left_out]
        return card(
            f"Identification of {self.recording.folder.name}",
            lines,
            table(head, rows),
            table(("not estimated", "reason"), missing),
        )


def identify(recording: Recording, selection: Selection | None = None) -> Identification:
    """Align, measure slip, estimate responses and spectra; what is not possible is said.

    selection: window, input and output where they are not the trial's. Raises InputError where the
    recording does not have what is selected.
    """
    selection = selection or Selection()
    data = aligned(recording)
    base = dataset(data)
    where = recording.folder.name
    moved = motion(data, base)
    window = selected_window(selection, base, where) or trial_window(base)
    pair = selected_pair(selection, data, base, moved, window)
    if selection.window is not None:  # then the excitation is unknown
        recording = replace(recording, trial=None)
    responses = _responses(base, moved, window, recording, pair)
    found = tuple(_with_units(r, base) for r in responses if isinstance(r, FrequencyResponse))
    main = next((r for r in found if r.output == (pair[1] if pair else "slip")), None)
    peak = resonance(main) if main else NoResonance("no response to slip was measured")
    drawn = spectra(data, base, moved, window)
    omitted = left_out(data, moved, window, responses, drawn, pair)
    followed = following(base, moved, window, recording.trial)
    return Identification(
        recording,
        data,
        base,
        moved,
        window,
        found,
        main,
        peak,
        drawn,
        omitted,
        followed,
        pair,
        selection.window,
    )


def _with_units(of: FrequencyResponse, base: Dataset) -> FrequencyResponse:
    u, y = of.input, of.output
    return replace(
        of,
        units=(unit_of(u, base), unit_of(y, base)),
        stated=(stated_unit(u, base), stated_unit(y, base)),
    )


def _responses(
    base: Dataset,
    moved: Motion | NoMotion,
    window: TrialWindow | NoExcitation,
    of: Recording,
    pair: tuple[str, str] | None,
) -> tuple[FrequencyResponse | NoResponse, ...]:
    if pair is not None and isinstance(window, TrialWindow):
        return chosen_response(base, moved, window, of.trial, pair)
    if isinstance(moved, NoMotion) or isinstance(window, NoExcitation):
        return ()
    return responses(base, moved, window, of.trial)


def slip_range(found: Identification) -> tuple[float, float] | None:
    """The 0.5 and 99.5 percentiles of slip, in the trial where there was one, else overall."""
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
