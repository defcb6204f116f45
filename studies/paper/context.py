"""What the paper's steps are given: identified recordings by name, and what is known beside them.

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
    """What is known beside the recordings.

    nominal    the motorcycle as its vehicle file describes it
    bandwidth  w_c, rad/s, of the throttle servo
    plus_minus 95 % half widths of its numbers, by block and parameter
    """

    nominal: Motorcycle
    bandwidth: float
    plus_minus: Mapping[str, float] = field(default_factory=dict)

    @property
    def cutoff(self) -> float:
        """Give w_c in Hz."""
        return self.bandwidth / (2 * math.pi)


def runs_of(found: Found, kind: str) -> list[Identification]:
    """Give all runs of one kind: "spark" has spark_1, spark_2, ..."""
    return [one for name, one in found.items() if name.rpartition("_")[0] == kind]


def response_of(one: Identification, given: str, taken: str = "slip") -> FrequencyResponse | None:
    """Give the response between two roles; nothing where the recording has none."""
    pairs = {(r.input, r.output): r for r in one.responses}
    return pairs.get((given, taken))
