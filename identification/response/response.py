"""A measured frequency response, with what is known of its error."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from slipbench.identification.signals.named import unit_of
from slipbench.identification.signals.samples import BoolArray
from slipbench.protocol.extras import optional_library
from slipbench.protocol.notebook import card, table
from slipbench.protocol.recording.channel import FloatArray

if TYPE_CHECKING:
    import control

ComplexArray = npt.NDArray[np.complex128]
RELIABLE_COHERENCE = 0.8  # coherence from which a line is reliable
WIDEST_BAND = 0.5  # of the gain; a line that is less certain is not reliable


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
    units          SI units of input and output; empty: those of the roles
    stated         units that the sources of input and output state; empty: none
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
    units: tuple[str, str] = ("", "")
    stated: tuple[str, str] = ("", "")

    @property
    def si_units(self) -> tuple[str, str]:
        """SI units of input and output."""
        return self.units[0] or unit_of(self.input), self.units[1] or unit_of(self.output)

    @property
    def gain(self) -> FloatArray:
        """Gain, shape (n,), in `unit`."""
        return np.asarray(np.hypot(self.value.real, self.value.imag))

    @property
    def phase(self) -> FloatArray:
        """Phase in rad, unwrapped over the reliable lines."""
        return unwrapped(self.value, self.reliable)

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
    def reliable(self) -> BoolArray:
        """Reliable lines, shape (n,): enough coherence, a 95 % interval below half the gain."""
        narrow = self.gain_band <= WIDEST_BAND * self.gain
        return np.asarray((self.coherence >= RELIABLE_COHERENCE) & narrow)

    def to_control(self) -> "control.FrequencyResponseData":
        """The reliable lines as a python-control object; frequencies become rad/s."""
        import control

        lines = self.reliable
        return control.FrequencyResponseData(
            self.value[lines],
            2 * np.pi * self.frequency[lines],
            inputs=[self.input],
            outputs=[self.output],
            name=f"{self.input} to {self.output}",
        )

    @property
    def unit(self) -> str:
        """Unit of the gain in SI, as in "1 per rad" for spark to slip."""
        under, over = self.si_units
        return f"{over} per {under}"

    def to_pandas(self) -> Any:
        """A pandas.DataFrame indexed by frequency in Hz, one row a line.

        Columns: gain (`unit`), gain_half_width (95 %), phase (rad), phase_half_width (rad, 95 %),
        coherence, reliable. Raises InputError where pandas is not installed.
        """
        pandas = optional_library("pandas")
        frame = pandas.DataFrame(
            {
                "gain": self.gain,
                "gain_half_width": self.gain_band,
                "phase": self.phase,
                "phase_half_width": self.phase_band,
                "coherence": self.coherence,
                "reliable": self.reliable,
            },
            index=pandas.Index(self.frequency, name="frequency"),
        )
        frame.attrs |= {"input": self.input, "output": self.output, "gain_unit": self.unit}
        return frame

    def to_xarray(self) -> Any:
        """An xarray.Dataset over frequency in Hz: complex response, coherence, deviation.

        Raises InputError where xarray is not installed.
        """
        xarray = optional_library("xarray")
        unit = {"units": self.unit}
        return xarray.Dataset(
            {
                "response": ("frequency", self.value, unit),
                "deviation": ("frequency", self.deviation, unit),
                "coherence": ("frequency", self.coherence, {"units": "1"}),
            },
            {"frequency": ("frequency", self.frequency, {"units": "Hz"})},
            {"input": self.input, "output": self.output, "method": self.method},
        )

    def _repr_html_(self) -> str:
        rows = zip(
            self.frequency.tolist(),
            self.gain.tolist(),
            self.gain_band.tolist(),
            np.degrees(self.phase).tolist(),
            self.coherence.tolist(),
            strict=True,
        )
        head = ("frequency, Hz", f"gain, {self.unit}", "± (95 %)", "phase, deg", "coherence")
        return card(
            f"Frequency response, {self.input} to {self.output}", [self.method], table(head, rows)
        )


def reliable_band(response: FrequencyResponse) -> tuple[float, float] | None:
    """Widest band without a line of too little coherence, Hz; None where no line is reliable."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], response.reliable.astype(int), [0]))))
    if not edges.size:
        return None
    starts, ends = edges[::2], edges[1::2] - 1
    widest = int(np.argmax(response.frequency[ends] - response.frequency[starts]))
    low, high = response.frequency[starts[widest]], response.frequency[ends[widest]]
    return float(low), float(high)


def least_coherence(response: FrequencyResponse) -> float:
    """Least coherence inside the reliable band; over all lines where there is none."""
    band = reliable_band(response) or (0.0, np.inf)
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
