"""Whitened responses of the outputs to many curves at one injection point.

The impulse response and the whitening are linear filters. So the impulse response is whitened once
per injection point, and its convolution with a disturbance is the whitened response.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft

from slipbench.identification.mismatch.curves.trace import (
    RecordRegressors,
    impulse_responses,
    in_bins,
    regressors_by_record,
)
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.whitening import Whitener
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.model import Runs
from slipbench.plant.signals import Floats

SHORT = 64
"""Length of an impulse response, bins, up to which direct products are faster than transforms."""

Spectra = npt.NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Waveforms:
    """Disturbance waveforms by record, one value per bin, (bins, k) each. spectra: cached."""

    disturbances: Sequence[Floats]
    spectra: dict[tuple[int, int], Spectra] = field(default_factory=dict)

    def filtered(self, record: int, impulse_response: Floats, lost: int) -> Floats:
        """Return the filtered disturbances of a record, (bins - lost, m, k).

        impulse_response: of the outputs, (memory, m); lost: number of first rows to omit.
        Disturbances are zero before the first bin.
        """
        disturbance, memory = self.disturbances[record], len(impulse_response)
        if memory <= SHORT:
            before = max(memory - 1 - lost, 0)
            padded = np.pad(disturbance, ((before, 0), (0, 0)))
            windows = sliding_window_view(padded, memory, axis=0)[lost + before + 1 - memory :]
            return np.asarray(np.matmul(impulse_response[::-1].T, windows.transpose(0, 2, 1)))
        length = fft.next_fast_len(len(disturbance) + memory - 1, real=True)
        if (record, length) not in self.spectra:
            self.spectra[record, length] = fft.rfft(disturbance, length, axis=0)
        product = (
            fft.rfft(impulse_response, length, axis=0)[:, :, None]
            * self.spectra[record, length][:, None]
        )
        return np.asarray(
            fft.irfft(product, length, axis=0, overwrite_x=True)[lost : len(disturbance)]
        )


@dataclass(frozen=True, eq=False)
class WhitenedImpulseResponse:
    """Impulse response of the outputs of an output group, (memory, m), with a noise model.

    whitened: whitened impulse response, longer by the order of the noise model. first_rows: of the
    response, not whitened.
    """

    whitener: Whitener
    whitened: Floats
    first_rows: Floats

    @staticmethod
    def of(whitener: Whitener, impulse_response: Floats) -> "WhitenedImpulseResponse":
        """Whiten an impulse response, (memory, m)."""
        padded = np.pad(impulse_response, ((whitener.order, whitener.order), (0, 0)))
        return WhitenedImpulseResponse(
            whitener, whitener.innovations(padded), impulse_response[: whitener.order]
        )

    def response(self, waveforms: Waveforms, record: int) -> Floats:
        """Return the whitened responses to the waveforms of a record, (bins, m, k)."""
        order = self.whitener.order
        later = waveforms.filtered(record, self.whitened, order)
        if not order:
            return later
        opening = Waveforms([waveforms.disturbances[record][:order]]).filtered(
            0, self.first_rows, 0
        )
        return np.concatenate((self.whitener.opening(opening), later))


@dataclass(frozen=True, eq=False)
class WhitenedResponses:
    """Whitened impulse responses of a fit and the regressors, cached.

    regressors: by subsystem, see `regressors_of`; impulse_responses: by injection point; runs:
    simulations without an impulse; tents: the last tent functions.
    """

    fit: Fit
    regressors: dict[str, RecordRegressors] = field(default_factory=dict)
    impulse_responses: dict[str, list[list[WhitenedImpulseResponse | None]]] = field(
        default_factory=dict
    )
    runs: Runs = field(default_factory=dict)
    tents: dict[tuple[str, ...], Waveforms] = field(default_factory=dict)

    def regressors_of(self, subsystem: str) -> RecordRegressors:
        """Return every record with the regressors of a subsystem that all records contain.

        By name, SI, shape (rows,) each; (2, rows) for a scale.
        """
        if subsystem not in self.regressors:
            self.regressors[subsystem] = regressors_by_record(self.fit, subsystem)
        return self.regressors[subsystem]

    def unit_disturbances(self, subsystem: str, knots: Mapping[str, Floats]) -> Waveforms:
        """Return the unit disturbances of each knot of each regressor, side by side.

        knots: of each regressor, shape (knots,), SI. The waveforms have shape (bins, all knots).
        """
        key = (subsystem, *knots)
        if key not in self.tents:
            self.tents.clear()
            records = self.regressors_of(subsystem)
            self.tents[key] = Waveforms([in_bins(record, knots, s) for record, s in records])
        return self.tents[key]

    def columns(self, place: InjectionPoint, waveforms: Waveforms) -> Floats:
        """Return the whitened responses to disturbances at an injection point, shape (rows, k).

        waveforms: the disturbances, shape (bins, k) by record.
        """
        if place.name not in self.impulse_responses:
            self.impulse_responses[place.name] = self._responses(place)
        measured = self.fit.model.measured
        stacked = np.zeros(
            (sum(m.size for ms in measured for m in ms), waveforms.disturbances[0].shape[1])
        )
        first = 0
        for responses, block in zip(self.impulse_responses[place.name], measured, strict=True):
            for r, (impulse_response, m) in enumerate(zip(responses, block, strict=True)):
                if impulse_response is not None:
                    stacked[first : first + m.size] = impulse_response.response(
                        waveforms, r
                    ).reshape(m.size, -1)
                first += m.size
        return stacked

    def _responses(self, place: InjectionPoint) -> list[list[WhitenedImpulseResponse | None]]:
        """Return the responses to an impulse by output group and record; None: not affected."""
        return [
            [WhitenedImpulseResponse.of(whitener, one) if one.size else None for one in ones]
            for whitener, ones in zip(
                self.fit.noise, impulse_responses(self.fit, place, self.runs), strict=True
            )
        ]
