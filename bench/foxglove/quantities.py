"""Topics of the stream beside the CAN messages: what the view computes from the frames, with units.

    /slipbench/motion           slip, wheel speed, optical speed, throttle, engine speed; 100 samples/s
    /slipbench/trial            phase, trip, what the rider does next, distance left
    /slipbench/limits_in_use    share of each limit in use; 100 % trips
    /slipbench/bus_load         of each bus
    /slipbench/lateness         of the loop

A member is absent while its value is not known.
"""

import json
import math
from collections.abc import Iterator, Mapping
from typing import Any

from slipbench.bench.view.limits import LIMITS
from slipbench.bench.view.message import UNITS, scaled, state_message
from slipbench.bench.view.observer import SAMPLED
from slipbench.bench.view.portion import Portion
from slipbench.bench.view.recorded_trial import RecordedTrial
from slipbench.protocol.export.json_messages import Tree, object_schema, quantity_schema
from slipbench.protocol.trial_file import TrialFile

MOTION, TRIAL = "/slipbench/motion", "/slipbench/trial"
IN_USE, LOAD = "/slipbench/limits_in_use", "/slipbench/bus_load"
LATENESS = "/slipbench/lateness"
TEXTS = {
    "throttle_request": "Throttle opening that the bench requests; absent without authority",
    "throttle": "Throttle opening",
    "slip": "Slip of the rear wheel over its last turn",
    "wheel_speed": "Peripheral speed of the rear wheel over its last turn",
    "speed": "Speed over ground, of the optical sensor where there is one",
    "engine_speed": "Engine speed",
}
TIMES = {
    "median": "Median over the last 1000 ticks",
    "recent": "Largest of the last 1000 ticks",
    "worst": "Largest since the start",
}
COUNTS = {
    "ticks": "Ticks since the start",
    "late": "Of these, late",
    "skipped": "Of these, skipped",
    "refused": "Of these, refused by the recorder",
}
Message = tuple[int, str, bytes]  # time in ns, topic, JSON


def quantity_schemas(recorded: RecordedTrial) -> dict[str, Tree]:
    """JSON Schema of each topic of a trial."""
    motion = {name: quantity_schema(UNITS[name], text) for name, text in TEXTS.items()}
    shares = {name: quantity_schema("%") for name in LIMITS}
    load = {bus: quantity_schema("%") for bus in recorded.buses}
    lateness = {name: quantity_schema("ms", text) for name, text in TIMES.items()}
    counts = {name: quantity_schema("", text, "integer") for name, text in COUNTS.items()}
    return {
        MOTION: object_schema("slipbench.Motion", "Motion of the motorcycle", motion),
        TRIAL: object_schema("slipbench.Trial", "State of the trial", _trial_members()),
        IN_USE: object_schema("slipbench.LimitsInUse", "Share of each limit; 100 % trips", shares),
        LOAD: object_schema("slipbench.BusLoad", "Load over the last half second", load),
        LATENESS: object_schema("slipbench.Lateness", "Lateness of the loop", lateness | counts),
    }


def _trial_members() -> Tree:
    text = {"type": "string"}
    return {
        "phase": {**text, "description": "Phase of the trial"},
        "trip": {**text, "description": "Limit that ended the trial"},
        "line": {**text, "description": "What the rider does next, or what is missing to arm"},
        "distance_left": quantity_schema("m", "Distance until the limit `distance`"),
        "faulty_frames": quantity_schema("", "Frames with a fault since the start", "integer"),
    }


def quantities(portion: Portion, trial: TrialFile) -> Iterator[Message]:
    """Messages of a portion at or after its begin. Times are those of the recording."""
    for time, figures in _motion(portion):
        if time >= portion.begin:
            yield time, MOTION, as_json(figures)
    if portion.log is None:
        return
    now, state = round(portion.seen.time * 1e9), state_message(portion.seen, trial, 0.0)
    if now < portion.begin:
        return
    yield now, TRIAL, as_json(_trial(state))
    yield now, IN_USE, as_json(_percent(state["limits"]))
    yield now, LOAD, as_json(_percent(state["load"]))
    if portion.lateness["ticks"]:
        yield now, LATENESS, as_json(portion.lateness)


def _motion(portion: Portion) -> Iterator[tuple[int, Mapping[str, float]]]:
    """Time in ns and figures in `UNITS` of each sample."""
    for sample, row in zip(portion.samples, scaled(portion.samples, 0.0), strict=True):
        yield round(sample[0] * 1e9), dict(zip(SAMPLED[1:], row[1:], strict=True))


def _trial(state: Mapping[str, Any]) -> Tree:
    kept = {name: state[name] for name in ("phase", "trip", "line", "distance_left")}
    return {**kept, "faulty_frames": sum(state["faults"].values())}


def _percent(shares: Mapping[str, float]) -> dict[str, float]:
    return {name: 100.0 * share for name, share in shares.items()}


def as_json(members: Mapping[str, Any]) -> bytes:
    """JSON of what is known: None, NaN and infinite values are left out."""
    known = {
        name: value
        for name, value in members.items()
        if value is not None and not (isinstance(value, float) and not math.isfinite(value))
    }
    return json.dumps(known, allow_nan=False, separators=(",", ":")).encode()
