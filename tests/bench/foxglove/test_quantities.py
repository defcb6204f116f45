"""Laws of the derived quantities: they are those of the view, valid under their schemas, never NaN."""

import json
import math
from itertools import pairwise

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.bench.foxglove.quantities import (
    IN_USE,
    LOAD,
    MOTION,
    TRIAL,
    as_json,
    quantities,
    quantity_schemas,
)
from slipbench.bench.view.limits import LIMITS
from slipbench.bench.view.message import FACTORS
from slipbench.bench.view.observer import SAMPLED, TrialObserver
from slipbench.bench.view.portion import Portion
from slipbench.bench.view.recorded_trial import recorded_trial

NO_TICKS = {"ticks": 0}


@pytest.fixture(scope="module")
def observed(run):
    """Portions of a recording, and the trial."""
    recorded = recorded_trial(run)
    observer, portions = TrialObserver(recorded), []
    lines = (run / "frames.log").read_bytes().splitlines(keepends=True)
    for begin in range(0, len(lines), 500):
        log = observer.observe(b"".join(lines[begin : begin + 500]))
        portions.append(Portion(log, observer.observed(), observer.samples(), NO_TICKS))
    return recorded, portions


def messages_of(observed):
    recorded, portions = observed
    return [each for portion in portions for each in quantities(portion, recorded.plan.trial)]


def test_every_message_is_valid_under_the_schema_of_its_topic(observed):
    schemas = quantity_schemas(observed[0])
    found = set()
    for _, topic, data in messages_of(observed):
        jsonschema.validate(json.loads(data), schemas[topic])
        found.add(topic)
    assert found == {MOTION, TRIAL, IN_USE, LOAD}  # no tick was read here: no lateness


def test_motion_is_the_samples_of_the_view_in_its_units(observed):
    sent = [
        (time, json.loads(data)) for time, topic, data in messages_of(observed) if topic == MOTION
    ]
    samples = [sample for portion in observed[1] for sample in portion.samples]
    assert len(sent) == len(samples) > 100
    for (time, tree), sample in zip(sent, samples, strict=True):
        assert abs(time - sample[0] * 1e9) < 1.0
        scaled = [value * factor for value, factor in zip(sample, FACTORS, strict=True)]
        known = {
            name: value
            for name, value in zip(SAMPLED, scaled, strict=True)
            if name != "time" and math.isfinite(value)
        }
        assert tree == pytest.approx(known)


def test_state_comes_at_the_time_of_the_last_frame_in_order(observed):
    times = [time for time, topic, _ in messages_of(observed) if topic == TRIAL]
    last = [int(portion.log.time_ns[-1]) for portion in observed[1]]
    assert all(abs(time - end) < 1000 for time, end in zip(times, last, strict=True))
    assert all(before < after for before, after in pairwise(times))


def test_every_limit_that_can_be_in_use_has_its_place_in_the_schema(observed):
    recorded, portions = observed
    used = {name for portion in portions for name in portion.seen.limits}
    assert used <= set(LIMITS)
    members = quantity_schemas(recorded)[IN_USE]["properties"]
    assert set(members) == set(LIMITS)
    assert {each["unit"] for each in members.values()} == {"%"}


def test_what_lies_before_a_seek_is_not_sent_again(observed):
    recorded, portions = observed
    portion = portions[3]
    begin = int(portion.log.time_ns[-1]) - 20_000_000
    later = Portion(portion.log, portion.seen, portion.samples, NO_TICKS, begin)
    sent = list(quantities(later, recorded.plan.trial))
    assert sent == [each for each in quantities(portion, recorded.plan.trial) if each[0] >= begin]
    beyond = Portion(portion.log, portion.seen, portion.samples, NO_TICKS, begin + 10**9)
    assert list(quantities(beyond, recorded.plan.trial)) == []


@given(st.dictionaries(st.text(), st.none() | st.floats() | st.integers() | st.text()))
def test_json_has_what_is_known_and_nothing_else(members):
    known = {
        name: value
        for name, value in members.items()
        if value is not None and not (isinstance(value, float) and not math.isfinite(value))
    }
    assert json.loads(as_json(members)) == known
