"""cantools' own databases, every message of every file: our decode is its decode, bit for bit."""

import os
import warnings
from pathlib import Path

import cantools.database
import numpy as np
import pytest
from cantools.database.errors import DecodeError

from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.decode import decode, sort_log
from tests.protocol.logs.test_decode import log_of, same

SOURCES = Path(os.environ.get("SLIPBENCH_SOURCES", Path(__file__).parents[3] / "build" / "sources"))
FILES = sorted(SOURCES.glob("cantools-*/tests/files/dbc/*.dbc"))
PAYLOADS, SEED = 12, 7


pytestmark = pytest.mark.skipif(
    not FILES, reason="cantools' sources are not here: run `make sources`, or set SLIPBENCH_SOURCES"
)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_message_decodes_as_cantools_decodes_it(path):
    ours = loaded(path)
    if ours is None:
        return
    theirs = {(m.frame_id, m.is_extended_frame): m for m in as_cantools_reads(path).messages}
    random = np.random.default_rng(SEED)
    print("seed", SEED)
    for message in ours.messages:
        sent = payloads(message, random)
        log = log_of([(message.identifier, message.extended, payload) for payload in sent])
        decoded = decode(sort_log(log, ours))[message.name]
        their = theirs[message.identifier, message.extended]
        compared = sum(compare(their, payload, decoded, row) for row, payload in enumerate(sent))
        assert compared or not message.signals


def loaded(path):
    """The database; None where it is refused, and rightly so."""
    try:
        return load_database(path)
    except InputError as cause:
        fault = str(cause)
    assert rightly_refused(path, fault), fault
    return None


def rightly_refused(path, fault):
    """Whether cantools, being strict, refuses as well, finds no message, or no frame could be."""
    try:
        found = as_cantools_reads(path, strict=True)
    except (cantools.Error, KeyError, ValueError):
        return True
    return not found.messages or "no CAN frame carries" in fault


def as_cantools_reads(path, strict=False):
    """The database as cantools reads it, by file; in the encodings that ours tries."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return cantools.database.load_file(path, encoding="utf-8-sig", strict=strict)
        except UnicodeDecodeError:
            return cantools.database.load_file(path, encoding="cp1252", strict=strict)


def payloads(message, random):
    """Random payloads, and for each multiplexed signal some that hold it."""
    sent = [random.bytes(message.length) for _ in range(PAYLOADS)]
    for signal in message.signals:
        if signal.multiplexer is not None:
            sent += [holding(message, signal, random.bytes(message.length)) for _ in range(2)]
    return sent


def holding(message, signal, payload):
    """The payload with every multiplexer selecting something, so that it holds `signal`."""
    for other in message.signals:
        payload = selecting(message, other, payload)
    while signal.multiplexer is not None:
        payload = selecting(message, signal, payload)
        signal = message.signal(signal.multiplexer)
    return payload


def selecting(message, signal, payload):
    """The payload with the multiplexer of `signal` set so that it selects it."""
    if signal.multiplexer is None:
        return payload
    parent = message.signal(signal.multiplexer)
    mask = (1 << parent.length) - 1
    value = signal.multiplexer_ids[0] & mask
    order, shift = (
        ("little", parent.first_bit)
        if parent.little_endian
        else ("big", 8 * len(payload) - parent.first_bit - parent.length)
    )
    bits = int.from_bytes(payload, order)
    return (bits & ~(mask << shift) | value << shift).to_bytes(len(payload), order)


def compare(their, payload, decoded, row):
    """Compare one frame; returns the number of signals that were equal, all of them."""
    try:
        values = their.decode(payload, decode_choices=False)
    except (DecodeError, ValueError, KeyError):  # a multiplexer with a value that selects nothing
        return 0
    present = {name: samples for name, samples in decoded.items() if row in samples.rows.tolist()}
    assert set(present) == set(values), (their.name, payload.hex())
    for name, value in values.items():
        mine = present[name].value[present[name].rows.tolist().index(row)]
        assert same(mine, value), (their.name, name, payload.hex())
    return len(values)
