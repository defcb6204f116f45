"""Laws of the plugin: it disturbs nobody, and its fixtures are a bench on the simulated clock."""

import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import pytest

from slipbench.protocol.recording.run_folder import read
from tests.bench.testing.conftest import PLUGIN, Run, plugin_options

pytest_plugins = ["pytester"]

HEAVY = ("numpy", "numba", "scipy", "can", "cantools", "pydantic", "pint", "matplotlib")


def test_loading_the_plugin_imports_no_library() -> None:
    code = f"import sys, pytest, {PLUGIN}, slipbench.bench.testing.summary\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(HEAVY) & set(done.stdout.split()) == set()


OLD_PYTEST = f"""
import pytest

for name in ("TerminalReporter", "FixtureDef", "Directory"):  # newer than pytest 7.0
    vars(pytest).pop(name, None)
now = pytest.hookimpl

def old(hookwrapper=False, optionalhook=False, tryfirst=False, trylast=False):  # no `wrapper`
    return now(hookwrapper=hookwrapper, tryfirst=tryfirst, trylast=trylast)

pytest.hookimpl = old
import {PLUGIN}, slipbench.bench.testing.summary
"""


def test_an_older_pytest_loads_the_plugin_too() -> None:
    """pytest loads it in every run: what it cannot import there ends runs that do not use it."""
    subprocess.run([sys.executable, "-c", OLD_PYTEST], check=True)


def test_a_run_without_its_fixtures_prints_and_imports_nothing_of_it(
    pytester: pytest.Pytester,
) -> None:
    pytester.makepyfile(
        f"""
        import sys
        def test_mine():
            assert not [name for name in {HEAVY} if name in sys.modules]
        """
    )
    result = pytester.runpytest_subprocess(*plugin_options(), "-p", "no:hypothesispytest")
    result.assert_outcomes(passed=1)
    result.stdout.no_fnmatch_line("*measurements*")
    result.stdout.no_fnmatch_line("*requirements*")


def test_a_users_own_fixtures_of_these_names_win(run: Run, pytester: pytest.Pytester) -> None:
    names = ["bus", "vehicle", "gateway", "trial", "replay", "recording", "stimulus", "measure"]
    pytester.makeconftest(
        "import pytest\n"
        + "".join(
            f"@pytest.fixture\ndef {name}():\n    return 'mine: {name}'\n\n" for name in names
        )
    )
    result = run(
        f"def test_mine({', '.join(names)}):\n"
        + "".join(f"    assert {name} == 'mine: {name}'\n" for name in names)
    )
    result.assert_outcomes(passed=1)


def test_a_users_own_bus_does_not_reach_the_vehicle_of_the_plugin(run: Run) -> None:
    result = run(
        """
        import pytest

        @pytest.fixture
        def bus():
            return "mine"

        def test_both(bus, vehicle, stimulus):
            stimulus.wait_for("EcuStatus.authority == 0", within="10 ms")
            assert bus == "mine"
        """
    )
    result.assert_outcomes(passed=1)


def test_time_passes_only_in_waits_and_signals_have_the_units_of_the_database(run: Run) -> None:
    result = run(
        """
        import pytest

        def test_bus(bus, vehicle):
            assert bus.now == 0.0
            bus.run("250 ms")
            assert bus.now == pytest.approx(0.25)
            rpm = bus.value("EngineStatus.engine_speed")
            assert rpm == pytest.approx(14000, abs=200)
            assert bus.value("EngineStatus.engine_speed", "rad/s") == pytest.approx(rpm * 0.10472, rel=1e-4)
            assert bus.times("EngineStatus").size == pytest.approx(50, abs=1)
            assert bus.faults("EngineStatus") == []
        """
    )
    result.assert_outcomes(passed=1)


def test_an_unknown_signal_is_named_with_the_nearest(run: Run) -> None:
    result = run(
        """
        def test_typo(bus):
            bus.value("EngineStatus.engine_sped")
        """
    )
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*did you mean engine_speed?*"])


@pytest.mark.parametrize("marker", ["real_time", "socketcan"])
def test_a_test_that_needs_another_clock_is_skipped_with_the_option(run: Run, marker: str) -> None:
    result = run(
        f"""
        import pytest

        @pytest.mark.{marker}
        def test_needs_it(bus):
            pass

        @pytest.mark.{marker}
        def test_of_somebody_else():
            pass
        """,
        "-rs",
    )
    result.assert_outcomes(passed=1, skipped=1)
    result.stdout.fnmatch_lines([f"*{marker}: needs --slipbench-clock real-time"])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--slipbench-clock", "sundial"], "*expected: simulated or real-time*"),
        (["--slipbench-bitrate", "fast"], "*expected: 10000 to 1000000 bit/s*"),
        (["--slipbench-trial", "throttle_swep"], "*slipbench ships no trial of this name*"),
        (["--slipbench-device", "external"], "*an external device needs real time*"),
        (["--slipbench-device", "nowhere:device"], "*cannot be imported*"),
        (["--slipbench-device", "toaster"], "*module:name of a function*"),
    ],
    ids=lambda value: value[1] if isinstance(value, list) else "",
)
def test_a_wrong_option_is_an_error_with_what_is_expected(
    run: Run, options: list[str], said: str
) -> None:
    result = run("def test_any(bus, vehicle):\n    pass\n", *options)
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines([said])


def test_an_option_may_stand_in_the_ini_file_and_the_command_line_wins(
    run: Run, pytester: pytest.Pytester
) -> None:
    pytester.makeini("[pytest]\nslipbench_device = toaster\n")
    text = "def test_any(vehicle):\n    pass\n"
    run(text).assert_outcomes(errors=1)
    run(text, "--slipbench-device", "virtual").assert_outcomes(passed=1)


# Measurements


MEASURED = """
    import pytest

    @pytest.mark.requirement("SAF-3")
    def test_soft(measure):
        measure("hand-back", 12.3, "ms", at_most=20, source="EcuStatus.authority")
        measure("overshoot", 7.0, "%", at_most=5)
        measure("bandwidth", 3.0, "Hz", at_least=4, requirement="PERF-1")
        measure("room", 21.0, "degC")
        measure("reached", 1, at_least=1)
"""


def test_measurements_outside_their_limits_are_joined_and_fail_the_test_at_its_end(
    run: Run,
) -> None:
    result = run(MEASURED)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        [
            "2 of 5 measurements outside their limits",
            "  overshoot: 7 %, expected at most 5 %, SAF-3",
            "  bandwidth: 3 Hz, expected at least 4 Hz, PERF-1",
            "passed*SAF-3*hand-back*12.3 ms*at most 20 ms*test_soft",
            "failed*SAF-3*overshoot*",
            "recorded*room*21 degC*",
            "PERF-1: failed (1 test)",
            "SAF-3: failed (1 test)",
        ]
    )


@pytest.mark.parametrize(
    "arguments",
    [
        "float('nan'), at_least=10",
        "float('nan'), at_most=20",
        "20.001, at_most=20",
        "9.999, at_least=10, at_most=20",
    ],
)
def test_a_value_that_is_not_inside_its_limits_fails(run: Run, arguments: str) -> None:
    result = run(f"def test_one(measure):\n    measure('time', {arguments})\n")
    result.assert_outcomes(failed=1)


def test_measurements_of_a_test_that_fails_otherwise_are_shown_as_well(run: Run) -> None:
    result = run(
        """
        def test_both(measure):
            measure("time", 30.0, "ms", at_most=20)
            assert False, "something else"
        """
    )
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*something else*", "*time: 30 ms, expected at most 20 ms*"])


def test_a_failed_measurement_of_one_requirement_leaves_another_passed(run: Run) -> None:
    result = run(
        """
        import pytest

        def test_two(measure):
            measure("a", 1, at_most=2, requirement="A-1")
            measure("b", 3, at_most=2, requirement="A-2")

        @pytest.mark.requirement("A-10")
        @pytest.mark.skip(reason="no hardware")
        def test_not_run():
            pass
        """
    )
    lines = ["A-1: passed (1 test)", "A-2: failed (1 test)", "A-10: not tested (1 test)"]
    result.stdout.fnmatch_lines(lines)


def test_junit_xml_has_measurements_and_requirements_as_properties(
    run: Run, pytester: pytest.Pytester
) -> None:
    run(MEASURED, "--junit-xml", "junit.xml")
    found = {
        (each.get("name"), each.get("value"))
        for each in ElementTree.parse(pytester.path / "junit.xml").iter("property")
    }
    hand_back = (
        "hand-back: 12.3 ms, expected at most 20 ms, SAF-3, from EcuStatus.authority, passed"
    )
    assert {("requirement", "SAF-3"), ("requirement", "PERF-1")} < found
    assert ("measurement hand-back", hand_back) in found


def test_the_summary_is_the_same_with_several_processes(run: Run) -> None:
    result = run(MEASURED, "-n", "1")
    result.stdout.fnmatch_lines(["failed*SAF-3*overshoot*", "PERF-1: failed (1 test)"])


def test_the_recording_of_a_failed_test_is_kept_where_it_is_wanted(
    run: Run, pytester: pytest.Pytester
) -> None:
    text = """
        import pytest

        @pytest.mark.parametrize("period", ["1 ms"])
        def test_failed(bus, vehicle, period):
            bus.run("100 ms")
            assert False

        def test_passed(bus, vehicle):
            bus.run("1 ms")
        """
    result = run(text, "--slipbench-keep", "kept")
    (folder,) = (pytester.path / "kept").iterdir()
    assert folder.name == "test_failed_1_ms"
    assert read(folder).frame_count > 300
    assert str(folder.name) in result.stdout.str()
    again = run(text, "--slipbench-keep", "kept")  # nothing is overwritten
    again.stdout.fnmatch_lines(["*not kept: *never overwritten*"])
