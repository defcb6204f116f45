"""Laws of the HTML page: whole in itself, every result on it, signals around each failure."""

import re
from xml.etree import ElementTree

import pytest

from slipbench.bench.testing.measurements import Measurement
from slipbench.bench.testing.plot_svg import plot_svg, ticks
from slipbench.bench.testing.report_page import page
from slipbench.bench.testing.summary import TestResult
from tests.bench.testing.conftest import Run

pytest_plugins = ["pytester"]

FAILING = """
    import pytest

    @pytest.mark.requirement("SAF-3")
    def test_silence(bus, vehicle, stimulus, measure):
        command = stimulus.cyclic("ActuatorCommand", authority=1, throttle="10 %")
        stimulus.wait_for("EcuStatus.authority == 1", within="50 ms")
        stimulus.drop("ActuatorCommand", "60 ms")
        back = stimulus.wait_for("EcuStatus.authority == 0", within="100 ms")
        measure("hand-back", 1e3 * back, "ms", at_most=20, source="EcuStatus.authority")

    def test_fine(measure):
        measure("fine", 1.0, at_most=2, requirement="SAF-4")
"""


@pytest.mark.parametrize("options", [(), ("-n", "1")], ids=["one process", "xdist"])
def test_a_failure_is_on_the_page_with_the_signals_that_the_test_read(
    run: Run, pytester: pytest.Pytester, options: tuple[str, ...]
) -> None:
    run(FAILING, "--slipbench-report", "out/report.html", *options)
    text = (pytester.path / "out" / "report.html").read_text(encoding="utf-8")
    assert re.search(r"SAF-3</td><td><span class=.badge failed.", text)
    assert re.search(r"SAF-4</td><td><span class=.badge passed.", text)
    assert "1 of 1 measurements outside their limits" in text
    drawings = re.findall("<svg.*?</svg>", text)
    assert len(drawings) == 1
    assert "EcuStatus.authority" in drawings[0]
    assert "ActuatorCommand lost" in drawings[0]
    assert "{{" not in text
    assert not re.findall(r'(?:src|href)="', text)


def test_a_report_that_cannot_be_written_is_refused_before_the_first_test(
    run: Run, pytester: pytest.Pytester
) -> None:
    (pytester.path / "file").touch()
    result = run(FAILING, "--slipbench-report", "file/report.html")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*--slipbench-report file/report.html: *; give another file"])


def test_text_of_a_test_cannot_change_the_page() -> None:
    wicked = "<script>alert(1)</script>"
    result = TestResult(
        wicked,
        "failed",
        wicked,
        [Measurement(wicked, 1.0, wicked, source=wicked, requirement=wicked)],
        [wicked],
        [plot(name=wicked, unit=wicked, marks=[[0.1, 0.2, wicked]])],
    )
    assert "<script" not in page([result], wicked)


def plot(**changes) -> dict:
    drawn = {"name": "A.b", "unit": "V", "time": [0.0, 0.5], "value": [1.0, 2.0]}
    return {**drawn, "begin": 0.0, "end": 1.0, "marks": [], **changes}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"time": [], "value": []},
        {"value": [3.0, 3.0]},
        {"value": [float("nan"), float("inf")]},
        {"begin": 0.0, "end": 0.0, "time": [0.0, 0.0]},
        {"value": [-1e300, 1e300]},
        {"marks": [[0.0, 1.0, f"mark {n}"] for n in range(9)]},
    ],
)
def test_every_drawing_is_valid_and_inside_its_frame(changes: dict) -> None:
    svg = ElementTree.fromstring(plot_svg(plot(**changes)))
    height = float(svg.get("viewBox", "").split()[3])
    numbers = [float(each.get("y", "0")) for each in svg.iter("text")]
    assert all(0 <= number <= height for number in numbers)
    text = ElementTree.tostring(svg, encoding="unicode")
    assert "nan" not in text
    assert "inf" not in text


@pytest.mark.parametrize(("low", "high"), [(0, 1), (-0.003, 0.004), (13990, 14110), (1e-9, 3e-9)])
def test_ticks_are_round_numbers_inside_the_range(low: float, high: float) -> None:
    found = ticks(low, high, 4)
    assert 2 <= len(found) <= 6
    assert all(low - 1e-12 <= each <= high + 1e-12 for each in found)
