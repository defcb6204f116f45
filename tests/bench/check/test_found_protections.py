"""Law: on a motorcycle with drawn protections, what the search finds verifies frames that it has not seen."""

from collections import Counter
from dataclasses import replace

import pytest

from slipbench.bench.check.traffic import BusTraffic, frame_log
from slipbench.protocol.binding.capture import Traffic, traffic_of
from slipbench.protocol.codec.protection import Guard, guard_of
from slipbench.protocol.database.layout import Message, Protection
from tests.bench.check.harness import world
from tests.protocol.binding.foreign import foreign_binding


def guard(message: Message, found: Traffic) -> Guard | None:
    """Guard of what was found; None where nothing was."""
    if found.profile is not None:
        return guard_of(replace(message, protection=found.profile.protection))
    if found.counter or (found.checksum is not None and not found.others):
        checksum = None if found.others else found.checksum
        plain = Protection(0, counter=found.counter, period=found.period, checksum=checksum)
        return guard_of(replace(message, protection=plain))
    return None


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_what_is_found_verifies_frames_that_it_has_not_seen(seed, tmp_path) -> None:
    print(f"seed {seed}")
    binding = foreign_binding(seed, tmp_path)
    with world(binding) as made:
        frames = made.frames(2.0)
    half = len(frames) // 2
    bare = replace(
        binding.database,
        messages=tuple(replace(message, protection=None) for message in binding.database.messages),
    )
    seen, unseen = (
        BusTraffic(frame_log(("bus", each) for each in part), bare)
        for part in (frames[:half], frames[half:])
    )
    outcomes: Counter[str] = Counter()
    for message in binding.database.messages:
        held = seen.sorted.frames[message.name]
        if message.protection is None or len(held) < 50:
            continue
        found = guard(message, traffic_of(held, seen.log.time_ns))
        if found is None:
            outcomes["not found"] += 1
            continue
        data = unseen.sorted.frames[message.name].data
        assert found.all_intact(data).mean() > 0.99, message.name
        stated = guard_of(message)
        assert stated is not None
        outcomes["found" if type(found) is type(stated) else "as plain"] += 1
    print(dict(outcomes))
    assert outcomes["found"] >= 0.7 * sum(outcomes.values())
