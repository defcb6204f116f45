"""Thresholds of the quick look, each with unit and reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Threshold:
    """A bound of a measure. value: in `unit`; reason: why it is there."""

    value: float
    unit: str
    reason: str


@dataclass(frozen=True)
class Thresholds:
    """Bounds by which a run is judged.

    covered           least share of the planned frequencies that are reliable
    coherence         least median coherence over the planned band
    clipping          largest share of the excitation in which the actuator is at its stop
    margin            least margin that must remain to a limit that the motorcycle can trip
    room              margin from which a larger amplitude is safe to propose
    distance          largest relative distance from the earlier repeats
    chance            largest probability of such a distance by noise alone
    missing           largest share of the output that depends on the input beyond the model
    held_out          least NRMSE fit of a model on held-out data
    raised, lowered   factors of an amplitude that is proposed where no margin gives one
    """

    covered: Threshold = Threshold(0.8, "1", "a gap of a fifth of the band can hide the resonance")
    coherence: Threshold = Threshold(
        0.9, "1", "below it noise makes a ninth or more of the response's power"
    )
    clipping: Threshold = Threshold(
        0.01, "1", "an actuator at its stop adds harmonics that a linear model takes for dynamics"
    )
    margin: Threshold = Threshold(
        0.1, "1", "gusts and bumps vary the peak by a tenth from run to run: the next one may trip"
    )
    room: Threshold = Threshold(
        0.5, "1", "half of the range is free, so that half as much again stays well inside"
    )
    distance: Threshold = Threshold(
        0.1, "1", "a gain or phase that moves by more than a tenth (6 degrees) changes the design"
    )
    chance: Threshold = Threshold(
        0.001, "1", "one false alarm in a thousand runs; noise that the intervals know is no fault"
    )
    held_out: Threshold = Threshold(
        50.0, "%", "below it the model misses more than a quarter of the output's power"
    )
    missing: Threshold = Threshold(
        0.03, "1", "a smaller gap changes no design; the test sees gaps of half a percent"
    )
    raised: Threshold = Threshold(1.5, "1", "twice the power; slip stays within half of its range")
    lowered: Threshold = Threshold(0.7, "1", "half the power; the largest step that needs no model")


THRESHOLDS = Thresholds()
