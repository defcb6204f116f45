"""Phases of a trial from its description, where no message of the bus shows them."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.recording.channel import Channel

PERIOD = 0.02  # s, as the bench sends TrialStatus where the bus has it
ROLE = "trial_phase"


def phase_channel(description: Mapping[str, Any], start_ns: int, duration: float) -> Channel | None:
    """Phase at every 20 ms of a recording of `duration` s, from the outcome of its trial.

    start_ns: time zero of the recording, ns. None where the description has no phases.
    """
    outcome = description.get("outcome")
    changes = outcome.get("phases") if isinstance(outcome, Mapping) else None
    entered = [
        ((change["time_ns"] - start_ns) * 1e-9, float(Phase[change["phase"].upper()]))
        for change in (changes if isinstance(changes, list) else [])
        if isinstance(change, Mapping)
        and isinstance(change.get("time_ns"), int)
        and str(change.get("phase", "")).upper() in Phase.__members__
    ]
    if not entered or not 0.0 < duration < LONGEST:
        return None
    times, phases = np.array(sorted(entered)).T
    grid = np.arange(0.0, duration, PERIOD)
    at = np.searchsorted(times, grid, side="right")
    values = np.concatenate([[float(Phase.IDLE)], phases])[at]
    return Channel(ROLE, grid, values, "1", "bus", "run.toml outcome.phases")


LONGEST = 86_400.0  # s of a recording
