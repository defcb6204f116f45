"""A device's clock wraps at another width in each of its messages; one clock comes of them all."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slipbench.protocol.recording.bus_channels import BusSamples


def align_clocks(
    found: Mapping[str, BusSamples], clocks: Mapping[str, str]
) -> dict[str, BusSamples]:
    """Samples by role; those of one wrapping clock count the same wraps, so that times compare.

    found: samples by role; clocks: name of each role's clock. The message with the longest period of
    its clock is the reference; the others are moved to the nearest wrap by their arrivals, which is right while frames
    are late by less than half the shorter period.
    """
    aligned = dict(found)
    for clock in set(clocks.values()):
        roles = [role for role in found if clocks[role] == clock and found[role].device is not None]
        if roles:
            leader = max(roles, key=lambda role: found[role].turn or np.inf)
            zero = _on_turn(found[leader], 0.0)
            aligned |= {role: _on_turn(found[role], _lead(zero)) for role in roles}
    return aligned


def _lead(samples: BusSamples) -> float:
    """Time by which arrivals lie beyond the device's own times, s."""
    assert samples.device is not None
    return float(np.median(samples.arrival - samples.device))


def _on_turn(samples: BusSamples, lead: float) -> BusSamples:
    if samples.turn is None or samples.device is None:
        return samples
    turns = np.rint((_lead(samples) - lead) / samples.turn)
    return replace(samples, device=samples.device + turns * samples.turn)
