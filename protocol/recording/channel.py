"""One measured quantity over time, on the clock of the device that measured it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.extras import optional_library
from slipbench.protocol.notebook import card

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Channel:
    """Samples of one role, unaligned and never resampled.

    role     what the samples mean (see `slipbench.protocol.recording.roles`)
    time     (n,) s since the recording's start, read on `clock`
    value    (n,) in `unit`
    unit     SI
    clock    "bus" where the time is the frame's arrival (or a table's own time column after its
             stated offset), else the name of the device whose clock it is; without `arrival`
             that clock has nothing in common with the bus's
    arrival  (n,) s on the bus clock at which each sample arrived; None where `clock` is "bus"
    origin   where the samples come from, for people: "can0 EngineStatus.engine_speed"
    stated   unit that the source states for them, in which a report shows them; empty: the usual one

    A tooth channel has the tooth's time in `time` and its running count in `value`: a count that
    steps by more than one states how many teeth are unknown there.
    """

    role: str
    time: FloatArray
    value: FloatArray
    unit: str
    clock: str
    origin: str
    arrival: FloatArray | None = None
    stated: str = ""

    def __post_init__(self) -> None:
        """Refuse arrays that do not belong together."""
        if self.time.shape != self.value.shape or self.time.ndim != 1:
            raise ValueError(f"{self.role}: time {self.time.shape}, value {self.value.shape}")
        if self.arrival is not None and self.arrival.shape != self.time.shape:
            raise ValueError(f"{self.role}: arrival {self.arrival.shape}, time {self.time.shape}")

    def to_pandas(self) -> Any:
        """A pandas.Series of values in `unit`, indexed by time in s. Raises InputError."""
        pandas = optional_library("pandas")
        index = pandas.Index(self.time, name="time")
        series = pandas.Series(self.value, index=index, name=self.role)
        series.attrs |= {"unit": self.unit, "clock": self.clock, "origin": self.origin}
        return series

    def to_xarray(self) -> Any:
        """An xarray.DataArray over the dimension "time", in s, with units. Raises InputError."""
        xarray = optional_library("xarray")
        return xarray.DataArray(
            self.value,
            {"time": ("time", self.time, {"units": "s"})},
            name=self.role,
            attrs={"units": self.unit, "clock": self.clock, "origin": self.origin},
        )

    def _repr_html_(self) -> str:
        return card(
            f"{self.role} [{self.unit}]",
            [f"{self.time.size} samples from {self.origin}, time of clock {self.clock}"],
        )
