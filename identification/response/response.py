"""A measured frequency response, with what is known of its error."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from slipbench.identification.signals.samples import BoolArray
from slipbench.protocol.recording.channel import FloatArray

if TYPE_CHECKING:
    import control

ComplexArray = npt.NDArray[np.complex128]
BELIEVED = 0.8  # coherence from which a line is believed
WIDEST_BAND = 0.5  # of the gain; a line that is less certain is not believed


@dataclass(frozen=True)
class FrequencyResponse:
    """First harmonic of an output per unit of an input.

    input, output  roles
    frequency      (n,) Hz, increasing
    value          (n,) complex, output unit per input unit
    coherence      (n,) share of the output's power that the input explains, 0..1
    deviation      (n,) standard deviation of the complex value
    quantile       two-sided 95 % quantile that belongs to `deviation`'s degrees of freedom
    method         how it was estimated, for people
    stride         lines from one to the next that shares no noise with it; 1 where all are
                   independent, more where neighbouring windows overlap
    """

    input: str
    output: str
    frequency: FloatArray
    value: ComplexArray
    coherence: FloatArray
    deviation: FloatArray
    quantile: float
    method: str
    stride: int = 1

    @property
    def gain(self) -> FloatArray:
        """Amplitude of the output per amplitude of the input."""
        return np.asarray(np.hypot(self.value.real, self.value.imag))

    @property
    def phase(self) -> FloatArray:
        """Phase in rad, unwrapped over the believed lines."""
        return unwrapped(self.value, self.believed)

    @property
    def gain_band(self) -> FloatArray:
        """Half width of the 95 % band of the gain."""
        return np.asarray(self.quantile * self.deviation / np.sqrt(2))

    @property
    def phase_band(self) -> FloatArray:
        """Half width of the 95 % band of the phase, rad, at most pi."""
        ratio = self.gain_band / np.maximum(self.gain, 1e-300)
        return np.where(ratio < 1, np.arcsin(np.minimum(ratio, 1)), np.pi)

    @property
    def believed(self) -> BoolArray:
        """Lines with enough coherence and a band that is narrow beside the gain."""
        narrow = self.gain_band <= WIDEST_BAND * self.gain
        return np.asarray((self.coherence >= BELIEVED) & narrow)

    def to_control(self) -> "control.FrequencyResponseData":
        """Give the believed lines as a python-control object; frequencies become rad/s."""
        import control

        lines = self.believed
        return control.FrequencyResponseData(
            self.value[lines],
            2 * np.pi * self.frequency[lines],
            inputs=[self.input],
            outputs=[self.output],
            name=f"{self.input} to {self.output}",
        )


def believed_band(response: FrequencyResponse) -> tuple[float, float] | None:
    """Widest band without a line of too little coherence, Hz; None where no line is believed."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], response.believed.astype(int), [0]))))
    if not edges.size:
        return None
    starts, ends = edges[::2], edges[1::2] - 1
    widest = int(np.argmax(response.frequency[ends] - response.frequency[starts]))
    low, high = response.frequency[starts[widest]], response.frequency[ends[widest]]
    return float(low), float(high)


def least_coherence(response: FrequencyResponse) -> float:
    """Least coherence inside the believed band; over all lines where there is none."""
    band = believed_band(response) or (0.0, np.inf)
    inside = (response.frequency >= band[0]) & (response.frequency <= band[1])
    return float(response.coherence[inside].min())


def unwrapped(value: ComplexArray, trusted: BoolArray) -> FloatArray:
    """Unwrap the phase along trusted lines; the others follow the nearest of them. rad."""
    phase = np.angle(value)
    if not trusted.any():
        return np.unwrap(phase)
    index = np.arange(phase.size)
    backbone = np.interp(index, index[trusted], np.unwrap(phase[trusted]))
    return np.asarray(phase + 2 * np.pi * np.round((backbone - phase) / (2 * np.pi)))
