"""The public interface: what the page shows, what an import costs, tables and notebooks."""

import doctest
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import slipbench
from slipbench.identification.response.identify import Identification
from slipbench.protocol.extras import optional_library
from slipbench.protocol.notebook import card, table
from slipbench.protocol.recording.channel import Channel
from tests.paths import DEMONSTRATION, ROOT, TRIALS, with_full_paths

PAGE = ROOT / "docs" / "api.md"
HEAVY = ("numpy", "scipy", "numba", "matplotlib", "asammdf", "pandas", "cantools", "control", "can")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the trial file of the page."""
    made = tmp_path_factory.mktemp("api")
    text = with_full_paths((TRIALS / "throttle_sweep.toml").read_text(encoding="utf-8"))
    assert 'duration = "30 s"' in text
    text = text.replace('duration = "30 s"', 'duration = "4 s"')
    (made / "sweep.toml").write_text(text, encoding="utf-8")
    return made


@pytest.fixture(scope="module")
def outcome(folder: Path):
    """The outcome of the page's examples, which make runs/sweep; the page itself is checked here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        done = doctest.testfile(str(PAGE), module_relative=False, optionflags=doctest.ELLIPSIS)
    assert done.attempted > 20
    return done


@pytest.fixture(scope="module")
def recording(outcome: doctest.TestResults, folder: Path) -> slipbench.Recording:
    return slipbench.read(folder / "runs" / "sweep")


@pytest.fixture(scope="module")
def found(recording: slipbench.Recording) -> Identification:
    return slipbench.identify(recording)


def test_the_examples_of_the_page_hold(outcome: doctest.TestResults) -> None:
    assert outcome.failed == 0


def test_the_page_names_every_public_name_and_each_has_a_docstring() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert [name for name in slipbench.__all__ if f"`{name}`" not in text] == []
    assert [name for name in slipbench.__all__ if not getattr(slipbench, name).__doc__] == []


def test_an_import_loads_no_library() -> None:
    code = f"import sys, slipbench; print([m for m in {HEAVY!r} if m in sys.modules])"
    ran = subprocess.run(
        [sys.executable, "-c", code], check=True, text=True, stdout=subprocess.PIPE
    )
    assert ran.stdout.strip() == "[]"


def test_a_name_that_does_not_exist_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'reed'"):
        slipbench.__getattr__("reed")


def test_a_missing_library_is_named_with_the_command_that_installs_it(
    recording: slipbench.Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(slipbench.InputError, match=r"pip install 'slipbench\[analysis\]'"):
        recording.to_pandas()


def test_a_recording_keeps_every_sample_and_unit_in_pandas(recording: slipbench.Recording) -> None:
    pytest.importorskip("pandas", reason="pip install 'slipbench[analysis]'")
    frame = recording.to_pandas()
    for role, channel in recording.channels.items():
        rows = frame[frame["role"] == role]
        assert np.array_equal(rows["time"], channel.time)
        assert np.array_equal(rows["value"], channel.value, equal_nan=True)
        assert set(rows["unit"]) <= {channel.unit}
        assert np.array_equal(channel.to_pandas().index, channel.time)


def test_a_recording_keeps_every_sample_and_unit_in_xarray(recording: slipbench.Recording) -> None:
    pytest.importorskip("xarray", reason="pip install 'slipbench[analysis]'")
    data = recording.to_xarray()
    for role, channel in recording.channels.items():
        assert np.array_equal(data[role].to_numpy(), channel.value, equal_nan=True)
        assert np.array_equal(data[f"time_{role}"].to_numpy(), channel.time)
        assert data[role].attrs["units"] == channel.unit


def test_an_identification_gives_its_signals_with_units(found: Identification) -> None:
    pytest.importorskip("pandas", reason="pip install 'slipbench[analysis]'")
    frame = found.to_pandas()
    assert np.array_equal(frame.index, found.base.time)
    assert np.array_equal(frame["slip"], found.motion.slip.ratio, equal_nan=True)
    assert frame.attrs["units"]["engine_speed"] == "rad/s"
    assert set(frame.attrs["units"]) == set(frame.columns)


def test_an_identification_gives_its_signals_in_xarray(found: Identification) -> None:
    pytest.importorskip("xarray", reason="pip install 'slipbench[analysis]'")
    data = found.to_xarray()
    for name, (value, unit) in found.signals().items():
        assert np.array_equal(data[name].to_numpy(), value, equal_nan=True)
        assert data[name].attrs["units"] == unit


def test_a_response_keeps_gain_phase_and_frequency(found: Identification) -> None:
    response = found.main
    assert response is not None
    frame = response.to_pandas()
    rebuilt = frame["gain"].to_numpy() * np.exp(1j * frame["phase"].to_numpy())
    assert np.allclose(rebuilt, response.value)
    assert np.array_equal(frame.index, response.frequency)
    control = response.to_control()
    assert np.allclose(control.omega, 2 * np.pi * response.frequency[response.reliable])


def test_a_response_keeps_its_complex_values_in_xarray(found: Identification) -> None:
    pytest.importorskip("xarray", reason="pip install 'slipbench[analysis]'")
    response = found.main
    assert response is not None
    data = response.to_xarray()
    assert np.array_equal(data["response"].to_numpy(), response.value)
    assert data["frequency"].attrs["units"] == "Hz"


def test_frequency_data_hold_the_delay_exactly_and_a_transfer_function_nearly(
    found: Identification,
) -> None:
    model = slipbench.fit_models(found).models[0].fit.model
    assert model.delay > 0
    frequency = np.linspace(0.5, 8.0, 20)
    exact = model.to_frequency_data(frequency)
    assert np.array_equal(exact.omega, 2 * np.pi * frequency)
    assert np.allclose(exact.frdata.ravel(), model.response(frequency))
    pade = model.to_control(pade=4)(2j * np.pi * frequency)
    assert np.allclose(pade, model.response(frequency), rtol=1e-3)


def test_decoded_signals_equal_the_samples_in_the_table(folder: Path, outcome) -> None:
    run = folder / "runs" / "sweep"
    decoded = slipbench.decode(run / "frames.log", run / "database.dbc")
    frame = decoded.to_pandas()
    assert len(frame) == sum(one.time.size for one in decoded.values())
    assert frame["time_ns"].is_monotonic_increasing
    one = decoded["EngineStatus.engine_speed"]
    rows = frame[frame["signal"] == one.name]
    assert np.array_equal(rows["value"], one.value)
    assert set(rows["unit"]) == {"rpm"}


def test_explain_returns_what_it_has_when_it_is_interrupted(folder: Path, outcome) -> None:
    def interrupt(_: str) -> None:
        raise KeyboardInterrupt

    verdict = slipbench.explain(DEMONSTRATION, [folder / "runs" / "sweep"], progress=interrupt)
    assert not verdict.complete
    check_html(verdict._repr_html_())
    assert list(verdict.to_pandas().columns)[:3] == ["effect", "subject", "parameter"]


class Balance(HTMLParser):
    """Fails where a tag is closed that was not opened last."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: set[str] = set()

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.open.append(tag)
        self.tags.add(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def check_html(text: str) -> set[str]:
    """Check that every tag is closed in order; return the names of the tags."""
    parser = Balance()
    parser.feed(text)
    parser.close()
    assert parser.open == []
    return parser.tags


def test_results_show_themselves_as_well_formed_html(
    recording: slipbench.Recording, found: Identification, folder: Path
) -> None:
    study = slipbench.fit_models(found)
    decoded = slipbench.decode(recording.folder / "frames.log", recording.folder / "database.dbc")
    results = (
        recording,
        found,
        found.main,
        study,
        study.models[0].fit.model,
        decoded,
        recording.channels["engine_speed"],
    )
    for result in results:
        tags = check_html(result._repr_html_())
        assert tags <= {"div", "p", "b", "table", "thead", "tbody", "tr", "th", "td"}


def test_an_outcome_shows_its_phases_and_gives_its_lateness(tmp_path: Path, folder: Path) -> None:
    done = slipbench.Trial(folder / "sweep.toml").run(tmp_path / "run")
    check_html(done._repr_html_())
    assert "exciting" in done._repr_html_()
    frame = done.to_pandas()
    assert np.array_equal(frame["lateness"], done.lateness.lateness * 1e-9)


@pytest.mark.parametrize(
    "name", ["load_vehicle", "load_controller", "load_database", "Trial", "read"]
)
def test_a_file_that_does_not_exist_is_an_input_error_that_names_it(
    tmp_path: Path, name: str
) -> None:
    with pytest.raises(slipbench.InputError, match=r"nothing\.there"):
        getattr(slipbench, name)(tmp_path / "nothing.there")


def test_text_in_html_is_escaped() -> None:
    evil = "<script>alert('x')</script> & \"quotes\""
    shown = card(evil, [evil], table([evil], [[evil, 1.0]]))
    assert check_html(shown) == {"div", "p", "b", "table", "thead", "tbody", "tr", "th", "td"}
    channel = Channel(evil, np.zeros(1), np.zeros(1), evil, evil, evil)
    assert "<script" not in channel._repr_html_()


def test_a_library_that_is_there_is_imported() -> None:
    assert optional_library("pandas").__name__ == "pandas"
