"""Progress of a trial: seconds of its script that are over, phase by phase."""

from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.trial_file import TrialFile

AFTERWARDS = 1.0  # s, about: status frames after the end, and the record


def script_duration(trial: TrialFile) -> float:
    """Expected duration of a trial from its start to its end, s."""
    return sum(_phases(trial).values()) + AFTERWARDS


def script_time(trial: TrialFile, phase: Phase, elapsed: float) -> float:
    """Seconds of the script that are over, `elapsed` s after `phase` began.

    A phase that lasts longer than expected, as the wait for the rider, stays at its expected end.
    """
    over = 0.0
    for each, duration in _phases(trial).items():
        if each == phase:
            return over + min(max(elapsed, 0.0), duration)
        over += duration
    return over + AFTERWARDS


def _phases(trial: TrialFile) -> dict[Phase, float]:
    """Expected duration of each phase before the end, s, in order."""
    return {
        Phase.IDLE: trial.operating_point.steady_for,
        Phase.ARMED: trial.rider.presses_button_after,
        Phase.EXCITING: trial.excitation.duration,
        Phase.SETTLING: trial.settling,
        Phase.HANDING_BACK: trial.hand_back,
    }
