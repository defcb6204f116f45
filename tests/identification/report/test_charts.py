"""The charts of a report in a browser: zoom, cursor, legend, dB and linear, print, a phone's width."""

import json
import re
import shutil
import subprocess

import pytest

from slipbench.identification.commands import studied, write_report
from slipbench.identification.report.report import interactive
from slipbench.identification.response.from_folder import identified
from tests.identification.synthetic_recording import Truth, recording

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(BROWSER is None, reason="install chromium to test the charts")

ACT = """
<pre id="seen"></pre><script>
(async function () {
  const seen = {}, charts = (name) => document.querySelector(`figure[data-chart="${name}"]`);
  const pause = () => new Promise((done) => setTimeout(done, 100));
  const bode = charts("response"), plots = bode.plots, u = plots[0];
  const button = (text) => [...bode.querySelectorAll("button")].find((b) => b.textContent === text);
  const mouse = (type, share) => {
    const r = u.over.getBoundingClientRect(), x = r.left + share * r.width, y = r.top + r.height / 2;
    const how = { clientX: x, clientY: y, movementX: 9, bubbles: true, button: 0 };
    u.over.dispatchEvent(new MouseEvent(type, how));
  };
  const range = () => bode.plots.map((p) => [p.scales.x.min, p.scales.x.max]);
  const drawn = [...document.querySelectorAll("figure.charted")];
  seen.charts = drawn.map((f) => f.dataset.chart);
  seen.still = getComputedStyle(bode.querySelector(".still")).display;
  seen.wide = document.documentElement.scrollWidth - window.innerWidth;
  seen.before = range();
  for (const [type, share] of [["mousemove", 0.5], ["mousedown", 0.5], ["mousemove", 0.75], ["mouseup", 0.75]]) {
    mouse(type, share);
    await pause();
  }
  seen.zoomed = range();
  mouse("mousemove", 0.4);
  await pause();
  seen.cursor = plots.map((p) => p.root.querySelector(".u-legend").textContent);
  u.root.querySelectorAll(".u-legend .u-series")[1].querySelector("th").click();
  await pause();
  seen.shown = plots.map((p) => p.series.map((s) => s.show));
  seen.decibels = [u.scales.y.min, u.scales.y.max];
  button("linear").click();
  await pause();
  seen.linear = [bode.plots[0].scales.y.min, bode.plots[0].scales.y.max];
  seen.labels = bode.textContent;
  button("reset zoom").click();
  await pause();
  seen.reset = range();
  const plane = charts("nichols"), p = plane.plots[0];
  const first = JSON.parse(document.getElementById("charts").textContent).nichols.panels[0].traces[0];
  p.setCursor({ left: p.valToPos(first.x[3], "x"), top: p.valToPos(first.y[3], "y") });
  await pause();
  seen.point = plane.querySelector(".readout").textContent;
  seen.note = first.notes[3];
  document.getElementById("seen").textContent = JSON.stringify(seen);
})();
</script>
"""


def dump(page, *options):
    command = [BROWSER, "--headless=new", "--no-sandbox", "--disable-gpu", *options]
    made = subprocess.run(
        [*command, "--virtual-time-budget=8000", "--dump-dom", f"file://{page}"],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    return made.stdout


@pytest.fixture(scope="module")
def found():
    return identified(recording(Truth(noise=0.02)))


@pytest.fixture(scope="module")
def folder(found, tmp_path_factory):
    folder = tmp_path_factory.mktemp("charts")
    write_report(found, studied(found), folder, None)
    text = (folder / "report.html").read_text(encoding="utf-8")
    (folder / "acted.html").write_text(text.replace("</body>", ACT + "</body>"), encoding="utf-8")
    return folder


@pytest.fixture(scope="module", params=["1200,900", "390,844"])
def seen(folder, request):
    text = dump(folder / "acted.html", f"--window-size={request.param}")
    return json.loads(re.search(r'<pre id="seen">(.*?)</pre>', text, re.S).group(1))


def test_every_chart_is_drawn_and_replaces_its_printed_figure(seen, found):
    assert set(seen["charts"]) == set(interactive(found, studied(found)))
    assert seen["still"] == "none"
    assert seen["wide"] <= 0  # no sideways scrolling, also on a phone


def test_a_drag_zooms_all_panels_and_reset_shows_everything_again(seen):
    low, high = seen["before"][0]
    for start, end in seen["zoomed"]:
        assert low < start < end < high
        assert [start, end] == pytest.approx(seen["zoomed"][0])
    assert seen["reset"] == seen["before"]


def test_the_cursor_gives_the_value_of_every_panel_with_its_interval(seen):
    for text in seen["cursor"]:
        assert re.search(r"frequency / Hz\s*\d", text)
        assert re.search(r"throttle command to slip\s*-?\d", text)
    assert re.search(r"\d \(-?[\d.]+ … -?[\d.]+\)", seen["cursor"][0])


def test_the_legend_hides_a_trace_with_its_interval_in_every_panel(seen):
    for panel in seen["shown"]:
        assert panel[1] is False
        assert True in panel[2:]
    assert seen["shown"][0][1:5] == [False] * 4  # trace, both ends of its interval, its pale line


def test_the_gain_is_shown_in_db_and_linear(seen):
    assert seen["decibels"][0] < seen["decibels"][1] < 0  # a gain below 1
    assert 0 <= seen["linear"][0] < seen["linear"][1] < 1


def test_the_cursor_in_the_nichols_plane_names_the_frequency(seen):
    assert seen["note"] in seen["point"]


def test_print_shows_the_figures_without_the_charts(folder, tmp_path):
    paper = tmp_path / "report.pdf"
    dump(folder / "report.html", f"--print-to-pdf={paper}")
    assert paper.stat().st_size > 50_000
