"""Interactive charts of a page: data, library and script, all inside the page."""

import json
from collections.abc import Mapping
from importlib.resources import files

from markupsafe import Markup

from slipbench.identification.report.chart import Chart, tree


def script(charts: Mapping[str, Chart]) -> Markup:
    """Elements that make the figures named in `charts` interactive; empty without any.

    uPlot (MIT licence) is part of the page, so that the page needs no network.
    """
    if not charts:
        return Markup("")
    data = json.dumps({name: tree(chart) for name, chart in charts.items()}, allow_nan=False)
    data = data.replace("<", "\\u003c")
    library = (files("slipbench") / "static" / "uplot.iife.min.js").read_text(encoding="utf-8")
    own = (files("slipbench.identification.report") / "charts.js").read_text(encoding="utf-8")
    return Markup(
        f'<script type="application/json" id="charts">{data}</script>\n'
        f"<script>{library}</script>\n<script>{own}</script>"
    )


def style() -> Markup:
    """Style sheet of a report with charts."""
    shared = (files("slipbench") / "static" / "uplot.min.css").read_text(encoding="utf-8")
    own = (files("slipbench.identification.report") / "report.css").read_text(encoding="utf-8")
    return Markup(shared + "\n" + own)
