"""What curves at a place leave in the whitened outputs, many curves at once.

The answer of the outputs to a push is a filter, and whitening is one as well. So the answer is
whitened, once for each place, and what it makes of all courses of pushes is whitened already.
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
    seen_by,
)
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.whitening import Whitener
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.model import Runs
from slipbench.plant.signals import Floats

SHORT = 64
"""Rows of an answer up to which products cost less than transforms."""

Spectra = npt.NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Waveforms:
    """Waveforms of pushes by record, one value a bin, (bins, k) each. spectra: those already made."""

    pushes: Sequence[Floats]
    spectra: dict[tuple[int, int], Spectra] = field(default_factory=dict)

    def through(self, record: int, answer: Floats, lost: int) -> Floats:
        """Return the pushes of a record through a filter, (bins - lost, m, k).

        answer: of the outputs to a push in one bin, (memory, m); lost: first rows to leave out.
        Before the first bin nothing was pushed.
        """
        pushes, memory = self.pushes[record], len(answer)
        if memory <= SHORT:
            before = max(memory - 1 - lost, 0)
            padded = np.pad(pushes, ((before, 0), (0, 0)))
            windows = sliding_window_view(padded, memory, axis=0)[lost + before + 1 - memory :]
            return np.asarray(np.matmul(answer[::-1].T, windows.transpose(0, 2, 1)))
        length = fft.next_fast_len(len(pushes) + memory - 1, real=True)
        if (record, length) not in self.spectra:
            self.spectra[record, length] = fft.rfft(pushes, length, axis=0)
        both = fft.rfft(answer, length, axis=0)[:, :, None] * self.spectra[record, length][:, None]
        return np.asarray(fft.irfft(both, length, axis=0, overwrite_x=True)[lost : len(pushes)])


@dataclass(frozen=True, eq=False)
class Answer:
    """Answer of a block's outputs to a push in one bin, (memory, m), under a noise model.

    whole: whitened; it lasts longer by the order of the noise model. begin: its first rows as they are.
    """

    white: Whitener
    whole: Floats
    begin: Floats

    @staticmethod
    def of(white: Whitener, answer: Floats) -> "Answer":
        """Whiten an answer."""
        around = np.pad(answer, ((white.order, white.order), (0, 0)))
        return Answer(white, white.innovations(around), answer[: white.order])

    def to(self, courses: Waveforms, record: int) -> Floats:
        """Return what courses of a record leave in the whitened outputs, (bins, m, k)."""
        order = self.white.order
        later = courses.through(record, self.whole, order)
        if not order:
            return later
        opening = Waveforms([courses.pushes[record][:order]]).through(0, self.begin, 0)
        return np.concatenate((self.white.opening(opening), later))


@dataclass(frozen=True, eq=False)
class Whitened:
    """Whitened answers of a fit, and the quantities along which something may act.

    seen: by drive, see `seen_by`; answers: by place; plain: simulations without a push; hats: the
    last that were made.
    """

    fit: Fit
    seen: dict[str, RecordRegressors] = field(default_factory=dict)
    answers: dict[str, list[list[Answer | None]]] = field(default_factory=dict)
    plain: Runs = field(default_factory=dict)
    tents: dict[tuple[str, ...], Waveforms] = field(default_factory=dict)

    def seen_by(self, subsystem: str) -> RecordRegressors:
        """Return every record with the quantities of a drive that all records have."""
        if subsystem not in self.seen:
            self.seen[subsystem] = seen_by(self.fit, subsystem)
        return self.seen[subsystem]

    def along(self, subsystem: str, knots: Mapping[str, Floats]) -> Waveforms:
        """Return what each knot of each quantity pushes, per unit, side by side."""
        key = (subsystem, *knots)
        if key not in self.tents:
            self.tents.clear()
            seen = self.seen_by(subsystem)
            self.tents[key] = Waveforms([in_bins(record, knots, s) for record, s in seen])
        return self.tents[key]

    def columns(self, place: InjectionPoint, courses: Waveforms) -> Floats:
        """Return what courses of pushes at a place leave in the whitened outputs, (rows, k)."""
        if place.name not in self.answers:
            self.answers[place.name] = self._responses(place)
        measured = self.fit.model.measured
        laid = np.zeros((sum(m.size for ms in measured for m in ms), courses.pushes[0].shape[1]))
        first = 0
        for answers, block in zip(self.answers[place.name], measured, strict=True):
            for r, (answer, m) in enumerate(zip(answers, block, strict=True)):
                if answer is not None:
                    laid[first : first + m.size] = answer.to(courses, r).reshape(m.size, -1)
                first += m.size
        return laid

    def _responses(self, place: InjectionPoint) -> list[list[Answer | None]]:
        """Return the answers to a place by block and record; None: it does not reach them."""
        return [
            [Answer.of(white, one) if one.size else None for one in ones]
            for white, ones in zip(
                self.fit.noise, impulse_responses(self.fit, place, self.plain), strict=True
            )
        ]
