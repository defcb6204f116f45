"""Input of the paper's steps: identified recordings by name, and prior knowledge.

context = Context(nominal.motorcycle, bandwidth=2 * math.pi * 10)
runs_of(found, "spark")          # spark_1, spark_2, ...
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from slipbench.identification.response.identify import Identification
from slipbench.identification.response.response import FrequencyResponse
from slipbench.plant.motorcycle import Motorcycle

Found = Mapping[str, Identification]


@dataclass(frozen=True)
class Context:
    """Prior knowledge beside the recordings.

    nominal    the motorcycle as its vehicle file describes it
    bandwidth  w_c, rad/s, of the throttle servo
    plus_minus 95 % half widths of its numbers, by block and parameter
    """

    nominal: Motorcycle
    bandwidth: float
    plus_minus: Mapping[str, float] = field(default_factory=dict)

    @property
    def cutoff(self) -> float:
        """Bandwidth w_c of the throttle servo, Hz."""
        return self.bandwidth / (2 * math.pi)


def runs_of(found: Found, kind: str) -> list[Identification]:
    """All runs of one kind, in order: "spark" has spark_1, spark_2, ..."""
    return [one for name, one in found.items() if name.rpartition("_")[0] == kind]


def response_of(one: Identification, given: str, taken: str = "slip") -> FrequencyResponse | None:
    """Frequency response between two roles; None where the recording has none."""
    pairs = {(r.input, r.output): r for r in one.responses}
    return pairs.get((given, taken))
