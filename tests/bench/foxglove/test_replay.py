"""Laws of a replay: each frame arrives once with its values; play, pause, seek and speed are obeyed."""

import jsonschema
import pytest

pytest.importorskip("foxglove", reason="pip install 'slipbench[foxglove]'")
pytest.importorskip("websockets", reason="pip install websockets")

from slipbench.bench.foxglove.replay_thread import folder_stream
from slipbench.bench.view.access import Address
from slipbench.protocol.logs import read_log
from tests.bench.foxglove.client import ENDED, PAUSE, PAUSED, PLAY, PLAYING, client
from tests.bench.foxglove.conftest import decoded, served

FAST = 20.0


@pytest.fixture
def url(run):
    lines = []
    with served(folder_stream(run, True, Address(port=0), lines.append), lines) as address:
        yield address


def bounds(run):
    times = read_log(run / "frames.log").frames.time_ns
    return int(times[0]), int(times[-1])


def ended(viewer):
    return lambda: viewer.states and viewer.states[-1][0] == ENDED


def test_every_frame_arrives_once_with_the_values_that_are_decoded(run, url):
    with client(url) as viewer:
        viewer.subscribe()
        viewer.control(PLAY, speed=FAST)
        viewer.until(ended(viewer)).receive(0.3)
        received = {topic: viewer.values(topic) for topic in viewer.messages}
        schemas = {topic: viewer.schema(topic) for topic in viewer.messages}
        assert viewer.statuses == []
    own = {topic for topic in received if topic.startswith("/slipbench/")}
    assert {topic: received[topic] for topic in received if topic not in own} == decoded(run)
    assert len(own) == 5
    for topic, values in received.items():
        check = jsonschema.Draft202012Validator(schemas[topic])
        for _, tree in values:
            check.validate(tree)


def test_a_topic_has_units_and_no_client_gets_what_it_did_not_ask_for(url):
    with client(url) as viewer:
        speed = viewer.schema("/can0/OpticalSpeed")["properties"]
        assert {each["unit"] for each in speed.values() if "unit" in each} >= {"m/s"}
        viewer.subscribe("/can0/OpticalSpeed")
        viewer.control(PLAY, speed=FAST)
        viewer.until(ended(viewer)).receive(0.3)
        assert set(viewer.messages) == {"/can0/OpticalSpeed"}


def test_messages_come_in_order_of_time_and_the_clock_is_that_of_the_recording(run, url):
    first, last = bounds(run)
    with client(url) as viewer:
        assert viewer.info["dataStartTime"] == {"sec": first // 10**9, "nsec": first % 10**9}
        assert viewer.info["dataEndTime"] == {"sec": last // 10**9, "nsec": last % 10**9}
        viewer.subscribe()
        viewer.control(PLAY, speed=FAST)
        viewer.until(ended(viewer)).receive(0.3)
        assert viewer.order == sorted(viewer.order)
        assert viewer.times == sorted(viewer.times)
        assert (viewer.order[0], viewer.order[-1], viewer.times[-1]) == (first, last, last)


def test_a_replay_waits_for_a_client_and_starts_by_itself(run, url):
    with client(url) as viewer:
        assert viewer.receive(0.5).states == []
        viewer.subscribe("/can0/EngineStatus")
        viewer.until(lambda: len(viewer.messages.get("/can0/EngineStatus", [])) > 10)
        assert viewer.states[0][0] == PLAYING
        assert viewer.values("/can0/EngineStatus")[0] == decoded(run)["/can0/EngineStatus"][0]


def test_a_client_that_comes_back_misses_nothing_that_another_did_not_see(run, url):
    topic = "/can0/EngineStatus"
    with client(url) as viewer:
        viewer.subscribe(topic)
        viewer.until(lambda: len(viewer.messages.get(topic, [])) > 100)
        before = viewer.values(topic)
    with client(url) as viewer:
        viewer.subscribe(topic)
        viewer.until(ended(viewer)).receive(0.3)
        after = viewer.values(topic)
    assert before == decoded(run)[topic][: len(before)]
    assert after == decoded(run)[topic][-len(after) :]
    missing = len(decoded(run)[topic]) - len(before) - len(after)
    assert 0 <= missing < 100  # what was under way when the first one left: half a second at most


def test_pause_stops_the_messages_and_play_goes_on_without_a_gap(run, url):
    topic = "/can0/EcuStatus"
    with client(url) as viewer:
        viewer.subscribe(topic)
        viewer.control(PLAY, speed=2.0)
        viewer.until(lambda: len(viewer.messages.get(topic, [])) > 500)
        viewer.control(PAUSE, speed=2.0, name="pause")
        viewer.until(lambda: viewer.states[-1][0] == PAUSED).receive(0.2)
        paused = len(viewer.messages[topic])
        assert len(viewer.receive(0.4).messages[topic]) == paused
        assert viewer.requests[-1] == "pause"
        viewer.control(PLAY, speed=FAST)
        viewer.until(ended(viewer)).receive(0.3)
        assert viewer.values(topic) == decoded(run)[topic]


@pytest.mark.parametrize("share", [0.0, 0.37, 0.9])
def test_a_seek_gives_exactly_the_frames_from_there_on(run, url, share):
    first, last = bounds(run)
    place = first + round(share * (last - first))
    with client(url) as viewer:
        viewer.subscribe()
        viewer.control(PLAY, speed=FAST)
        viewer.until(ended(viewer)).receive(0.3)
        viewer.messages.clear()
        viewer.order.clear()
        viewer.control(PLAY, seek_ns=place, speed=FAST, name="seek")
        viewer.until(lambda: viewer.requests[-1] == "seek")
        assert viewer.states[-1][1:] == (place, FAST, True)
        viewer.until(ended(viewer)).receive(0.3)
        received = {topic: viewer.values(topic) for topic in viewer.messages}
        assert viewer.order[0] >= place
    found = {topic: values for topic, values in received.items() if "/can0/" in topic}
    assert found == decoded(run, place)
    assert all(values[0][0] >= place for values in received.values())


def test_a_seek_beyond_the_recording_ends_at_its_bounds(run, url):
    first, last = bounds(run)
    with client(url) as viewer:
        viewer.subscribe("/slipbench/motion")
        for place, bound in ((last + 10**12, last), (1, first)):
            viewer.control(PAUSE, seek_ns=place, name=str(place))
            viewer.until(lambda place=place: str(place) in viewer.requests)
            assert viewer.states[-1][1] == bound


def test_two_clients_receive_the_same(run, url):
    topic = "/can0/RearTeeth"
    with client(url) as one, client(url) as other:
        one.subscribe(topic)
        other.subscribe(topic)
        one.receive(0.1)
        other.receive(0.1)
        one.control(PLAY, speed=FAST)
        one.until(ended(one)).receive(0.3)
        other.receive(0.3)
        assert one.values(topic) == other.values(topic) == decoded(run)[topic]
