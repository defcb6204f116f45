"""A recording is data: nothing in it is executed, and nothing outside it is touched."""

import ast
import contextlib
import resource
from pathlib import Path

import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench import dbc
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.faults import FrameFault
from slipbench.protocol.codec.messages import EcuStatus
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.candump import LONGEST
from slipbench.protocol.recording.database_copy import DATABASE
from slipbench.protocol.recording.run_folder import DESCRIPTION, FRAMES, ROLES, read
from tests.hostile.damage import damaged, fuzz
from tests.imports import PACKAGES
from tests.paths import ROOT

CODEC = Codec(load_database(dbc.MOTORBIKE))


def make(folder: Path) -> Path:
    """A small recording of the bench's own messages."""
    folder.mkdir()
    lines = []
    for number in range(60):
        status = EcuStatus(0, 0.1, 0.0, number * 0.001)
        identifier, data = CODEC.encode(status, counter=number % 15)
        lines.append(f"({1.7e9 + number * 0.001:.6f}) can0 {identifier:03X}#{data.hex().upper()}\n")
    (folder / FRAMES).write_text("".join(lines), encoding="ascii")
    (folder / DATABASE).write_bytes(dbc.MOTORBIKE.read_bytes())
    (folder / ROLES).write_bytes((ROOT / "dbc" / "motorbike_roles.toml").read_bytes())
    description = {
        "run": {"start_time_ns": 1_700_000_000_000_000_000},
        "bus": {"bitrate": 1_000_000},
    }
    (folder / DESCRIPTION).write_bytes(tomli_w.dumps(description).encode())
    return folder


def test_a_good_recording_is_read(tmp_path):
    assert read(make(tmp_path / "run")).frame_count == 60


@pytest.mark.parametrize(
    ("name", "examples"), [(DESCRIPTION, 150), (FRAMES, 100), (ROLES, 60), (DATABASE, 25)]
)
def test_whichever_file_of_it_is_damaged_the_fault_is_told(name, examples, tmp_path):
    folder = make(tmp_path / "run")
    good = (folder / name).read_bytes()

    @settings(fuzz, max_examples=examples)
    @given(damaged(good))
    def attempt(data):
        (folder / name).write_bytes(data)
        with contextlib.suppress(InputError):
            read(folder)

    attempt()


value = st.one_of(
    st.none().map(lambda _: "x"),
    st.booleans(),
    st.integers(-(2**70), 2**70),
    st.floats(),
    st.text(max_size=20),
    st.just([1, 2]),
    st.just({"a": 1}),
    st.just([]),
    st.just({}),
)


of_run = st.dictionaries(st.sampled_from(["start_time_ns", "database_sha256"]), value)
of_bus = st.dictionaries(st.sampled_from(["bitrate", "data_bitrate", "start_time_ns"]), value)
of_tables = st.dictionaries(st.text(max_size=5), value)
told = {
    "run": value | of_run,
    "bus": value | of_bus,
    "warnings": value,
    "tables": value | of_tables,
}


@settings(fuzz, max_examples=150)
@given(st.fixed_dictionaries({}, optional={**told, "warnings": value}))
def test_whatever_the_description_says_it_is_data(folder_of, description):
    (folder_of / DESCRIPTION).write_bytes(tomli_w.dumps(description).encode("utf-8", "replace"))
    with contextlib.suppress(InputError):
        read(folder_of)


@pytest.fixture(scope="module")
def folder_of(tmp_path_factory):
    return make(tmp_path_factory.mktemp("runs") / "run")


@pytest.mark.parametrize(
    "place",
    [
        "../secret.csv",
        "/etc/hostname",
        "tables/../../secret.csv",
        "tables/link.csv",
        "..",
        "~/x.csv",
    ],
)
def test_no_table_is_read_from_outside(place, tmp_path):
    (tmp_path / "secret.csv").write_text("time,speed\n0,1\n1,2\n", encoding="ascii")
    folder = make(tmp_path / "run")
    (folder / "tables").mkdir()
    (folder / "tables" / "link.csv").symlink_to(tmp_path / "secret.csv")
    (folder / DESCRIPTION).write_bytes(tomli_w.dumps({"tables": {"gps": place}}).encode())
    with pytest.raises(InputError, match=r"leads out|no such file"):
        read(folder)


@pytest.mark.parametrize("name", [FRAMES, DATABASE, ROLES, DESCRIPTION, "report.html", "x/y/z"])
def test_no_link_leads_out_of_a_recording_to_be_read_or_written(name, tmp_path):
    """`slipbench identify` writes report.html beside the frames: a link there would be followed."""
    folder = make(tmp_path / "run")
    outside = tmp_path / "outside"
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    if (folder / name).exists():
        (folder / name).rename(outside)
    (folder / name).symlink_to(outside)
    with pytest.raises(InputError, match="leads out of the recording"):
        read(folder)


def test_a_recording_may_itself_be_reached_by_a_link(tmp_path):
    make(tmp_path / "run")
    (tmp_path / "last").symlink_to(tmp_path / "run")
    assert read(tmp_path / "last").frame_count == 60


def test_a_log_without_a_line_end_does_not_fill_the_memory(tmp_path):
    path = tmp_path / "endless.log"
    with path.open("wb") as file:
        file.write(b"(1.0) can0 100#00\n(1.0) can0 100#")
        file.truncate(40 * LONGEST)  # NUL bytes, of which the disk holds none
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(InputError, match="no line end"):
        read_log(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 10 * LONGEST / 1024


OURS = [16, 32, 48, 64, 80, 96, 112, 128, 256, 272, 288, 304, 512]


@settings(fuzz, max_examples=1000)
@given(st.sampled_from(OURS) | st.integers(0), st.binary(max_size=70))
def test_every_payload_is_a_message_or_a_named_fault(identifier, data):
    decoded = CODEC.decode(identifier, data)
    assert isinstance(decoded, FrameFault) or CODEC.name(identifier)
    assert CODEC.counter(identifier, data) in (None, *range(16))


@settings(fuzz, max_examples=1000)
@given(st.sampled_from([32, 48, 64, 96, 112, 128, 272, 288]), st.binary(min_size=8, max_size=8))
def test_every_rightly_protected_payload_is_a_message_or_a_named_fault(identifier, data):
    plan = CODEC.plan(identifier)
    payload = bytearray(data[: plan.message.length])
    plan.guard.protect(payload, data[1] % 15)
    decoded = CODEC.decode(identifier, payload)
    if not isinstance(decoded, FrameFault):
        again = CODEC.encode(decoded, counter=payload[1] & 15, name=plan.message.name)
        assert CODEC.decode(*again) == decoded


# What could execute

EXECUTES = {"pickle", "cPickle", "marshal", "shelve", "dill", "cloudpickle", "joblib", "code"}
CALLS = {"eval", "exec", "compile", "__import__"}


def test_no_reader_can_execute_what_it_reads():
    """No pickle, no eval, and numpy's loader only without pickle, in the packages that read."""
    found = []
    for package in ("protocol", "identification", "dbc", "controllers"):
        for path in sorted((ROOT / package).rglob("*.py")):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            found += [f"{path.relative_to(ROOT)}:{line} {what}" for line, what in suspects(tree)]
    assert found == []
    assert set(PACKAGES) >= {"protocol", "identification", "dbc", "controllers"}


def suspects(tree):
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=names) if any(n.name.split(".")[0] in EXECUTES for n in names):
                yield node.lineno, "imports " + names[0].name
            case ast.ImportFrom(module=str(module)) if module.split(".")[0] in EXECUTES:
                yield node.lineno, "imports from " + module
            case ast.Call(func=ast.Name(id=name)) if name in CALLS:
                yield node.lineno, f"calls {name}"
            case ast.Call(func=ast.Attribute(attr="load", value=ast.Name(id="np")), keywords=given):
                safe = any(
                    k.arg == "allow_pickle" and getattr(k.value, "value", True) is False
                    for k in given
                )
                if not safe:
                    yield node.lineno, "np.load without allow_pickle=False"
            case ast.Attribute(attr="read_pickle" | "loadtxt_pickle"):
                yield node.lineno, "reads a pickle"


@pytest.mark.parametrize(
    "text",
    [
        "import pickle",
        "from pickle import loads",
        "eval(x)",
        "np.load(p)",
        "np.load(p, allow_pickle=True)",
        "pd.read_pickle(p)",
    ],
)
def test_what_could_execute_is_found(text):
    assert list(suspects(ast.parse(text)))
    assert not list(suspects(ast.parse("np.load(p, allow_pickle=False)")))
