"""Law: on a motorcycle that shares no name with ours, `bind` and what only the user can state give its binding."""

from pathlib import Path

import pytest

from slipbench import examples
from slipbench.bench.check.report import check_report
from slipbench.bench.check.traffic import frame_log
from slipbench.protocol.binding.binding import read_binding
from slipbench.protocol.binding.binding_text import binding_text
from slipbench.protocol.binding.capture import captured
from slipbench.protocol.binding.propose import propose
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.decode import sort_log
from tests.bench.check.harness import traffic, world

FOLDER = Path(examples.__path__[0]) / "bindings"
STATED = """
[messages.LOG_Demand]
protection = { profile = "plain", counter = "Dmd_Cnt", checksum = { signal = "Dmd_Crc", kind = "crc8", polynomial = 0x1D, start = 0xFF, final_xor = 0xFF } }

[roles.authority]
signals = ["ECM_Intervention.Iv_Mode"]
"""


@pytest.fixture(scope="module")
def frames():
    """What the motorcycle sends in 2 s."""

    with world(read_binding(FOLDER / "superbike.toml")) as made:
        return made.frames(2.0)


def test_the_proposal_lacks_only_what_the_user_must_state(frames, tmp_path) -> None:

    ours = read_binding(FOLDER / "superbike.toml")
    database = load_database(FOLDER / "superbike.dbc")
    text = binding_text(
        propose(
            database,
            captured(sort_log(frame_log(("bus", each) for each in frames), database), database),
        ),
        "Superbike",
        str(FOLDER / "superbike.dbc"),
    )
    assert "The bench sends LOG_Demand. State the protection" in text
    path = tmp_path / "bike.toml"
    path.write_text(text)
    with pytest.raises(InputError, match="lacks 1 role that a trial needs"):
        read_binding(path).require_trial(spark=True)
    path.write_text(text + STATED)
    binding = read_binding(path)
    binding.require_trial(spark=True)
    assert binding.degraded == ours.degraded
    for name, fields in ours.placement.items():
        assert binding.placement[name] == fields, name
    for message in ours.database.messages:
        found = binding.database.message(message.name).protection
        assert (found is None) == (message.protection is None), message.name
        if found and message.protection:
            assert (found.counter, found.checksum) == (
                message.protection.counter,
                message.protection.checksum,
            )
    assert check_report(binding, traffic(binding, frames)).status == 0
