"""Logs that others wrote: their frames as other readers read them, decoded as cantools decodes.

No database came with these logs, so one is made up for the identifiers that are in them: signals of
both byte orders across the payload, signed and scaled. What they mean does not matter here.
"""

import can
import cantools.database
import numpy as np
import pytest

from slipbench.protocol.database.database import load_database
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.decode import decode, sort_log
from tests.protocol.logs.test_decode import same
from tests.recordings import recording

READERS = {"formats/candump.log": can.CanutilsLogReader, "formats/obd2_logger.mf4": can.MF4Reader}
SIGNALS = """ SG_ low{n} : 0|12@1+ (1,0) [0|0] "" Vector__XXX
 SG_ across{n} : 23|11@0- (0.1,-40) [0|0] "" Vector__XXX
 SG_ high{n} : 40|24@1- (0.015625,3) [0|0] "" Vector__XXX
"""


@pytest.fixture(params=sorted(READERS))
def captured(request):
    """A log as we read it, and the messages of another reader."""
    path = recording(request.param)
    return read_log(path).frames, list(READERS[request.param](path))


def test_every_frame_is_what_another_reader_reads(captured):
    log, messages = captured
    theirs = [m for m in messages if not (m.is_error_frame or m.is_remote_frame)]
    assert len(log) == len(theirs)
    ours = [
        (int(i), bool(x), d[:n].tobytes())
        for i, x, d, n in zip(log.identifier, log.extended, log.data, log.length, strict=True)
    ]
    assert ours == [(m.arbitration_id, m.is_extended_id, bytes(m.data)) for m in theirs]
    off = log.time_ns * 1e-9 - np.array([m.timestamp for m in theirs])
    assert np.ptp(off) < 2e-6  # a reader may count from another start, never at another rate


def test_every_sample_is_what_cantools_decodes(captured, tmp_path):
    log, _ = captured
    whole = log.select(log.length == 8)
    known = np.unique(np.stack([whole.identifier, whole.extended]), axis=1).T.tolist()
    text = 'VERSION ""\n\nBU_: Vector__XXX\n\n' + "\n".join(
        f"BO_ {identifier | extended << 31} M{n}: 8 Vector__XXX\n" + SIGNALS.replace("{n}", str(n))
        for n, (identifier, extended) in enumerate(known)
    )
    (tmp_path / "x.dbc").write_text(text)
    decoded = decode(sort_log(whole, load_database(tmp_path / "x.dbc")))
    theirs = cantools.database.load_file(tmp_path / "x.dbc")
    compared = 0
    for message in theirs.messages:
        samples = decoded[message.name]
        rows = next(iter(samples.values())).rows
        for place, row in enumerate(rows.tolist()):
            for name, value in message.decode(whole.data[row].tobytes()).items():
                assert same(samples[name].value[place], value)
                compared += 1
    assert compared == 3 * len(whole) > 3000
