"""Time and distance of a trial on a straight: approach, excitation, braking."""

import math

BEFORE = (
    3.0  # s at the operating point before the button: steady state, armed, the rider's reaction
)
BRAKING = 5.0  # m/s^2 after the trial: half of what a dry track allows
WINDOW = 0.03  # of the crank speed, either way: what a rider holds on a straight
DRIFT = 0.05  # of the speed, by which it may rise during the trial
AFTERWARDS = 1.5  # s of settling and hand-back
MARGIN = 0.25  # of the range of each limit, that a simulation leaves before a trial is proposed
SHORTEST, LONGEST = 8.0, 30.0  # s of excitation: below it the lines are too wide for a resonance


def room(speed: float, straight: float) -> tuple[float, float]:
    """Longest excitation (s), in half seconds, and way (m) from the button to where braking begins.

    speed: m/s, without slip; straight: m. The excitation may be too short, or the way negative,
    where the straight does not suit the speed.
    """
    fastest = speed * (1 + WINDOW + DRIFT)
    distance = straight - fastest * BEFORE - fastest**2 / (2 * BRAKING)
    return longest_excitation(speed, distance), distance


def longest_excitation(speed: float, distance: float) -> float:
    """Longest excitation (s), in half seconds, at a speed (m/s) on a way (m) from the button on."""
    duration = min(distance / (speed * (1 + WINDOW + DRIFT)) - AFTERWARDS, LONGEST)
    return math.floor(2 * duration + 1e-9) / 2
