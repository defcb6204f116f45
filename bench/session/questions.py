"""Questions that a session can answer, and the trial for each."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from slipbench.protocol.errors import InputError

LOW, HIGH = 0.5, 12.0  # Hz: above the drift of the speed, and beyond the resonance of the driveline
STEPS = 0.5  # Hz of the square wave: one second after each step records slow responses
PERIODS = 4  # of the multisine: one to settle, and three from whose scatter the noise follows
DEGREE = math.pi / 180


@dataclass(frozen=True)
class Question:
    """A question, and the trial that answers it.

    text       for people
    actuator   that is excited
    amplitude  largest one that is proposed, opening or rad
    repeats    runs, enough for an interval from their scatter
    waveform   table [excitation] without actuator and amplitude, for a time in s
    steepest   fastest change per amplitude, 1/s
    """

    text: str
    actuator: str
    amplitude: float
    repeats: int
    waveform: Callable[[float], Mapping[str, Any]]
    steepest: float


def _sweep(duration: float) -> dict[str, Any]:
    return {
        "waveform": "linear_sweep",
        "start": f"{LOW:g} Hz",
        "stop": f"{HIGH:g} Hz",
        "duration": f"{duration:g} s",
    }


def _multisine(duration: float) -> dict[str, Any]:
    period = math.floor(2 * duration / PERIODS) / 2
    return {
        "waveform": "multisine",
        "lowest": f"{LOW:g} Hz",
        "highest": f"{HIGH:g} Hz",
        "period": f"{period:g} s",
        "duration": f"{PERIODS * period:g} s",
        "detection": True,
    }


def _square(duration: float) -> dict[str, Any]:
    return {
        "waveform": "square",
        "frequency": f"{STEPS:g} Hz",
        "duration": f"{math.floor(duration * STEPS) / STEPS:g} s",
    }


QUESTIONS = {
    "throttle_response": Question(
        "frequency response from throttle to slip", "throttle", 0.03, 3, _sweep, 2 * math.pi * HIGH
    ),
    "spark_response": Question(
        "frequency response from spark to slip", "spark", 4 * DEGREE, 3, _sweep, 2 * math.pi * HIGH
    ),
    "distortion": Question(
        "what is linear, what is noise, and which distortion is even or odd",
        "throttle",
        0.03,
        2,
        _multisine,
        2 * math.pi * HIGH,
    ),
    "steps": Question(
        "dead time, backlash, and whether opening and closing differ",
        "throttle",
        0.03,
        2,
        _square,
        200.0,
    ),
}
DEFAULT = ("throttle_response", "spark_response")


def questions_of(text: str) -> dict[str, Question]:
    """Questions of a list with commas, by name. Raises InputError where one is unknown."""
    names = [name.strip() for name in text.split(",") if name.strip()]
    unknown = [name for name in names if name not in QUESTIONS]
    if unknown or not names:
        raise InputError(
            "unknown question" if unknown else "no question",
            where="--questions",
            expected="; ".join(f"{name}: {one.text}" for name, one in QUESTIONS.items()),
            found=", ".join(unknown),
            remedy="name one or more of these, with commas",
        )
    return {name: QUESTIONS[name] for name in dict.fromkeys(names)}
