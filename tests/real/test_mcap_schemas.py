"""The captures of real vehicles as MCAP: what is in the file is valid, and is what is decoded."""

import json
import math

import jsonschema
import pytest

from slipbench.protocol.database.database import load_database
from slipbench.protocol.export import export_run
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.decode import decode, sort_log
from tests.real.test_import_captures import CAPTURES
from tests.recordings import recording

reader = pytest.importorskip("mcap.reader", reason="pip install 'slipbench[mdf]'")
LINES = 15_000  # of each capture


@pytest.mark.parametrize("name", ["subaru_wrx", "yamaha_r1", "comma2k19"])
def test_a_capture_of_a_vehicle_is_valid_under_the_schemas_of_its_database(name, tmp_path):
    log, database, _ = CAPTURES[name]
    run = tmp_path / "run"
    run.mkdir()
    lines = recording(log).read_bytes().splitlines(keepends=True)[:LINES]
    (run / "frames.log").write_bytes(b"".join(lines))
    (run / "database.dbc").write_bytes(recording(database).read_bytes())
    read, checks = {}, {}
    with export_run(run, "mcap").path.open("rb") as file:
        for schema, channel, message in reader.make_reader(file).iter_messages(
            log_time_order=False
        ):
            tree = json.loads(message.data)
            if channel.topic not in checks:
                members = json.loads(schema.data)
                checks[channel.topic] = jsonschema.Draft202012Validator(members)
            checks[channel.topic].validate(tree)
            topic = channel.topic.rpartition("/")[2]
            for signal, value in tree.items() if topic != "frames" else ():
                read.setdefault((topic, signal), []).append(value)
    frames = read_log(run / "frames.log").frames
    wanted = {}
    for topic, signals in decode(sort_log(frames, load_database(run / "database.dbc"))).items():
        for signal, samples in signals.items():
            values = [value for value in samples.exact.tolist() if math.isfinite(value)]
            if values:
                wanted[topic, signal] = values
    assert len(wanted) >= 5
    assert read == wanted
