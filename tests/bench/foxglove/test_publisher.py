"""Laws of publishing: nothing is decoded for nobody, order of time, and clients forget only after a step back."""

import pytest

from slipbench.bench.foxglove.publisher import STEP_BACK, Publisher
from slipbench.bench.foxglove.quantities import TRIAL
from slipbench.bench.view.observer import TrialObserver
from slipbench.bench.view.portion import Portion
from slipbench.bench.view.recorded_trial import recorded_trial
from tests.bench.foxglove.wire import Wire

NO_TICKS = {"ticks": 0}


@pytest.fixture(scope="module")
def lines(run):
    return (run / "frames.log").read_bytes().splitlines(keepends=True)[:3000]


def published(run, pieces, wanted=None, anew=False):
    """What goes to the wire when frames are read in these pieces. anew: each is a run of its own."""
    recorded, wire = recorded_trial(run), Wire(wanted)
    publisher = Publisher(wire)
    publisher.begin(recorded)
    observer = TrialObserver(recorded)
    for piece in pieces:
        observer = TrialObserver(recorded) if anew else observer
        log = observer.observe(b"".join(piece))
        publisher.publish(Portion(log, observer.observed(), observer.samples(), NO_TICKS))
    return wire


def signals(wire):
    return [each for each in wire.sent if not each[1].startswith("/slipbench/")]


def test_what_is_sent_does_not_depend_on_the_pieces_that_are_read(run, lines):
    one = published(run, [lines])
    many = published(run, [lines[begin : begin + 97] for begin in range(0, len(lines), 97)])
    assert signals(many) == signals(one)
    assert len(signals(one)) > 2900
    assert many.times == sorted(many.times)


def test_topics_that_nobody_wants_are_not_decoded(run, lines):
    wire = published(run, [lines], {"/can0/EngineStatus", TRIAL})
    everything = published(run, [lines])
    assert {topic for _, topic, _ in signals(wire)} == {"/can0/EngineStatus"}
    assert signals(wire) == [
        each for each in signals(everything) if each[1].endswith("EngineStatus")
    ]


@pytest.mark.parametrize(("apart", "cleared"), [(0, 0), (STEP_BACK // 2, 0), (2 * STEP_BACK, 1)])
def test_clients_forget_only_after_a_step_back(run, lines, apart, cleared):
    """Frames of one instant, recorded in turn, are none; a run that begins anew is one."""
    stamp = lines[0].split(b")")[0][1:]
    seconds = float(stamp) + apart * 1e-9
    later = [b"(%.6f)" % seconds + lines[0].partition(b")")[2]]
    wire = published(run, [later, lines[:1]], anew=True)
    assert wire.cleared == cleared
    assert len(signals(wire)) == 2


def test_a_portion_without_a_frame_sends_nothing(run):
    wire = published(run, [[], []])
    assert (wire.sent, wire.times, wire.cleared) == ([], [], 0)
