"""Whatever is cut out of a recording or spoilt in it, identification answers; it never breaks."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from slipbench.identification.models.study import study_of
from slipbench.identification.report.key_figures import key_figures
from slipbench.identification.response.identify import identify
from slipbench.identification.signals.motion import Motion
from tests.identification.synthetic_recording import recording

WHOLE = recording()


def cut(channel, start, stop):
    part = slice(int(start * channel.time.size), int(stop * channel.time.size))
    arrival = None if channel.arrival is None else channel.arrival[part]
    return replace(channel, time=channel.time[part], value=channel.value[part], arrival=arrival)


def spoilt(channel, how, rng):
    match how:
        case "absent":
            return None
        case "cut":
            return cut(channel, *sorted(rng.random(2)))
        case "few":
            return cut(channel, 0.0, 3.5 / channel.time.size)
        case "unknown":
            hidden = np.where(rng.random(channel.value.size) < 0.3, np.nan, channel.value)
            return replace(channel, value=hidden)
        case "still":
            return replace(channel, value=np.zeros_like(channel.value))
        case "backwards":
            return replace(channel, time=channel.time[::-1].copy())
    return channel


hows = st.sampled_from(["whole", "whole", "absent", "cut", "few", "unknown", "still", "backwards"])


@given(damage=st.fixed_dictionaries(dict.fromkeys(WHOLE.channels, hows)), seed=st.integers(0, 99))
@example(damage=dict.fromkeys(WHOLE.channels, "absent"), seed=0)
@settings(max_examples=60, deadline=None)
# What other tests left behind may be collected here; that says nothing about this recording.
@pytest.mark.filterwarnings("error", "ignore::ResourceWarning")
def test_a_damaged_recording_is_identified_as_far_as_it_goes(damage, seed):
    rng = np.random.default_rng(seed)
    made = {role: spoilt(c, damage[role], rng) for role, c in WHOLE.channels.items()}
    found = identify(replace(WHOLE, channels={k: c for k, c in made.items() if c is not None}))
    key_figures(found, study_of(found))
    assert found.main is not None or found.left_out
    if damage["rear_teeth"] == "absent" or damage["optical_speed"] == "absent":
        assert not isinstance(found.motion, Motion)
