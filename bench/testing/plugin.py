"""What pytest loads: options, markers, fixtures and the check of measurements at a test's end.

pytest imports this file in every run where slipbench is installed. It imports pytest and the standard
library only, and does nothing for a test that uses none of its fixtures. See docs/how_to/pytest.md.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from slipbench.bench.testing.measurements import Measurement, failures

if TYPE_CHECKING:
    from pluggy import Result as PluggyResult

    from slipbench.bench.gateway.gateway import Gateway
    from slipbench.bench.testing.bench_bus import BenchBus
    from slipbench.bench.testing.bus_recording import BusRecording
    from slipbench.bench.testing.devices import Device
    from slipbench.bench.testing.replay_on_bus import ReplayOnBus
    from slipbench.bench.testing.setup import Setup
    from slipbench.bench.testing.stimulus import Stimulus
    from slipbench.bench.testing.trial_on_bus import TrialOnBus
    from slipbench.bench.testing.xcp.session import XcpOnBus

GROUP = "slipbench"
# (name, default, help); each is a command-line option and, with underscores, a key of the ini file.
OPTIONS = (
    ("slipbench-clock", "simulated", "clock of the tests: simulated, or real-time"),
    ("slipbench-interface", "slipbench", "python-can interface in real time"),
    ("slipbench-channel", "pytest", "channel of the interface"),
    ("slipbench-bitrate", "1000000", "bit rate in bit/s"),
    ("slipbench-database", "motorbike", "CAN database: a path, or the name of one that ships"),
    ("slipbench-trial", "throttle_sweep", "trial file: operating point, rider, limits"),
    ("slipbench-lateness", "10", "ms by which the test itself may be late in real time, or inf"),
    ("slipbench-device", "virtual", "device under test: virtual, external, or module:factory"),
)
REPORT, KEEP = "--slipbench-report", "--slipbench-keep"
MARKERS = (
    "requirement(*ids): requirements that the test verifies, such as SAF-3",
    "real_time: the test needs the clock of the machine (--slipbench-clock real-time)",
    "socketcan: the test needs a SocketCAN interface (--slipbench-interface socketcan)",
)
SETUP, MEASURED = "slipbench_setup", "slipbench_measured"
_measured: pytest.StashKey[list[Measurement]] = pytest.StashKey()
_setup: pytest.StashKey[Setup] = pytest.StashKey()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options, each on the command line and in the ini file."""
    group = parser.getgroup(GROUP, "slipbench: tests of devices on a CAN bus")
    for name, default, text in OPTIONS:
        group.addoption(f"--{name}", default=None, help=f"{text} (default: {default})")
        parser.addini(name.replace("-", "_"), f"{text}, see --{name}", default=default)
    group.addoption(REPORT, default=None, metavar="FILE", help="write an HTML page on all tests")
    text = "keep the recording of each failed test there, as a run folder"
    group.addoption(KEEP, default=None, metavar="FOLDER", help=text)


def pytest_configure(config: pytest.Config) -> None:
    """Register the markers, and the report where it is wanted."""
    for marker in MARKERS:
        config.addinivalue_line("markers", marker)
    from slipbench.bench.testing.summary import Summary

    page = config.getoption(REPORT)
    if page is not None and not hasattr(config, "workerinput"):
        _check_writable(Path(page))
    config.pluginmanager.register(Summary(page), "slipbench-summary")


def _check_writable(path: Path) -> None:
    """Refuse a report that could not be written at the end of the run."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.open("a").close()
    except OSError as cause:
        raise pytest.UsageError(f"{REPORT} {path}: {cause.strerror}; give another file") from cause


def option(config: pytest.Config, name: str) -> str:
    """Value of an option: of the command line, else of the ini file, else its default."""
    given = config.getoption(f"--{name}")
    return str(config.getini(name.replace("-", "_")) if given is None else given)


# End of a test


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip a test that needs another clock or interface, where it uses the fixtures of slipbench."""
    if SETUP in getattr(item, "fixturenames", ()):
        reason = _missing(item)
        if reason:
            pytest.skip(reason)


def _missing(item: pytest.Item) -> str:
    """What the options do not provide and the test needs; empty where all is there."""
    if option(item.config, "slipbench-clock") == "simulated":
        for marker in ("real_time", "socketcan"):
            if item.get_closest_marker(marker):
                return f"{marker}: needs --slipbench-clock real-time"
    interface = option(item.config, "slipbench-interface")
    if item.get_closest_marker("socketcan") and interface != "socketcan":
        return f"socketcan: needs --slipbench-interface socketcan, found {interface}"
    return ""


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, PluggyResult[Any], None]:
    """Fail a test at its end where a measurement is outside its limits or a stimulus never began.

    A wrapper of the old kind: one of the new kind stops every run under a pluggy before 1.2.
    """
    outcome = yield
    _measure_lateness(item)
    text = _found_at_end(item)
    if text and outcome.excinfo is None:
        if not hasattr(outcome, "force_exception"):  # pluggy before 1.1
            pytest.fail(text, pytrace=False)
        outcome.force_exception(pytest.fail.Exception(text, pytrace=False))


def _measure_lateness(item: pytest.Item) -> None:
    setup = item.stash.get(_setup, None)
    lateness = setup.lateness() if setup is not None else None
    if lateness is not None:
        item.stash.setdefault(_measured, []).append(lateness)


def _found_at_end(item: pytest.Item) -> str:
    texts = [failures(item.stash.get(_measured, []))]
    setup = item.stash.get(_setup, None)
    texts += setup.problems() if setup is not None else []
    return "\n".join(text for text in texts if text)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, PluggyResult[Any], None]:
    """Add measurements, requirements and the signals around a failure to the report of a test."""
    outcome = yield
    report = outcome.get_result()
    if report.when == "call" or report.outcome != "passed":
        _describe(item, report)


def _describe(item: pytest.Item, report: pytest.TestReport) -> None:
    measured, marked = item.stash.get(_measured, []), _marked(item)
    setup = item.stash.get(_setup, None)
    if not (measured or marked or setup):
        return
    described: dict[str, Any] = {
        "measurements": [each.as_json() for each in measured],
        "requirements": marked,
    }
    if report.failed:
        outside = failures(measured)
        if outside and outside not in str(report.longrepr):
            report.sections.append(("slipbench measurements", outside))
        if setup is not None:
            described["plots"] = setup.plots()
            keep = item.config.getoption(KEEP)
            if keep is not None:
                report.sections.append(("slipbench recording", setup.keep(Path(keep))))
    vars(report)["slipbench"] = described  # plain data: pytest-xdist carries it as well
    if report.when == "call":  # JUnit XML takes them from the item, after its teardown
        named = dict.fromkeys([*marked, *(m.requirement for m in measured if m.requirement)])
        item.user_properties.extend(("requirement", each) for each in named)
        item.user_properties.extend(
            (f"measurement {each.name}", f"{each}, {each.verdict}") for each in measured
        )


def _marked(item: pytest.Item) -> list[str]:
    """Requirements of the markers of a test, without repetition."""
    names = (str(each) for mark in item.iter_markers("requirement") for each in mark.args)
    return list(dict.fromkeys(names))


# Fixtures. Each depends on `slipbench_setup` only, so that a test suite may have its own `bus`.


@pytest.fixture
def slipbench_setup(
    request: pytest.FixtureRequest, tmp_path: Path, slipbench_trial_file: str | Path
) -> Iterator[Setup]:
    """Bus, clock, database and devices of one test, from the options."""
    from slipbench.bench.testing.setup import Choice, Setup

    values = {name: option(request.config, name) for name, _, _ in OPTIONS}
    values["slipbench-trial"] = str(slipbench_trial_file)
    setup = Setup(Choice.of(values), tmp_path, request.node.name)
    request.node.stash[_setup] = setup
    yield setup
    setup.close()


@pytest.fixture
def slipbench_trial_file(request: pytest.FixtureRequest) -> str | Path:
    """Trial file: a path, or the name of one that ships. Override it for other trials."""
    return option(request.config, "slipbench-trial")


@pytest.fixture
def bus(slipbench_setup: Setup) -> BenchBus:
    """CAN bus of the test and its clock: `bus.run`, `bus.value`, `bus.wait_for`, `bus.node`."""
    return slipbench_setup.bus


@pytest.fixture
def vehicle(slipbench_setup: Setup) -> Device:
    """Device under test, on the bus: the virtual motorcycle unless --slipbench-device says else."""
    return slipbench_setup.vehicle


@pytest.fixture
def stimulus(slipbench_setup: Setup) -> Stimulus:
    """What the test sends, and the faults that it injects, at a time or on a signal."""
    return slipbench_setup.stimulus


@pytest.fixture
def trial(slipbench_setup: Setup, vehicle: Device) -> TrialOnBus:
    """Trial with the device under test: `trial.run()` gives the outcome, `trial.read()` the recording."""
    return slipbench_setup.trial


@pytest.fixture
def gateway(slipbench_setup: Setup) -> Gateway:
    """Gateway of slipbench on the bus; it ticks from now on, `gateway.state` is its trial."""
    return slipbench_setup.trial.gateway


@pytest.fixture
def replay(slipbench_setup: Setup) -> ReplayOnBus:
    """Replay of captured drives on the bus, edited on their way: `replay.run(log, edits)`."""
    return slipbench_setup.replay


@pytest.fixture
def recording(slipbench_setup: Setup) -> BusRecording:
    """All frames of the bus since the test began: `recording.read()`, `recording.decode()`."""
    return slipbench_setup.recording


@pytest.fixture
def xcp(slipbench_setup: Setup) -> XcpOnBus:
    """XCP on CAN: `xcp.connect("ecu.a2l")` gives a session, which reads, polls or receives DAQ."""
    return slipbench_setup.xcp


@pytest.fixture
def measure(request: pytest.FixtureRequest) -> Measure:
    """Function that records a measurement; a value outside its limits fails the test at its end."""
    measured: list[Measurement] = []
    request.node.stash[_measured] = measured
    return Measure(request.node, measured)


class Measure:
    """Records measurements of one test."""

    def __init__(self, item: pytest.Item, measured: list[Measurement]) -> None:
        """Append to `measured`; requirement and time are those of `item`."""
        self._item, self._measured = item, measured

    def __call__(
        self,
        name: str,
        value: float,
        unit: str = "",
        *,
        at_least: float | None = None,
        at_most: float | None = None,
        requirement: str = "",
        source: str = "",
    ) -> Measurement:
        """Record a value with its limits, both in `unit`.

        requirement  that the limits come from; "": that of the test's marker, where it has one
        source       where the value comes from, such as "EcuStatus.authority"
        """
        marked = _marked(self._item)
        setup = self._item.stash.get(_setup, None)
        measured = Measurement(
            name,
            float(value),
            unit,
            None if at_least is None else float(at_least),
            None if at_most is None else float(at_most),
            requirement or (marked[0] if len(marked) == 1 else ""),
            source,
            setup.now if setup is not None else None,
        )
        self._measured.append(measured)
        return measured
