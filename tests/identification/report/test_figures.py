"""What is printed on a figure is on the figure, and no title or legend covers another."""

import itertools

import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from slipbench.identification.commands import studied, write_report
from slipbench.identification.report import drawing
from slipbench.identification.response.from_folder import identified
from tests.identification.synthetic_recording import Truth, recording

SLACK = 0.01  # in


def cut_off(figure: Figure) -> dict[str, float]:
    """Return by how much what is drawn reaches beyond each edge of a figure, in."""
    figure.canvas.draw()
    drawn = figure.get_tightbbox()
    width, height = figure.get_size_inches()
    beyond = {
        "left": -drawn.x0,
        "bottom": -drawn.y0,
        "right": drawn.x1 - width,
        "top": drawn.y1 - height,
    }
    return {edge: round(float(by), 3) for edge, by in beyond.items() if by > SLACK}


def covered(figure: Figure) -> list[tuple[str, str]]:
    """Return the pairs of titles and legends of a figure that overlap, by their texts."""
    figure.canvas.draw()
    printed = [
        (text.get_text(), text.get_window_extent())
        for text in figure.findobj(Text)
        if text.axes is not None and text.get_text() == text.axes.get_title("left") != ""
    ]
    for axes in figure.axes:
        if (legend := axes.get_legend()) is not None:
            texts = ", ".join(t.get_text() for t in legend.get_texts())
            printed.append((texts, legend.get_window_extent()))
    pairs = itertools.combinations(printed, 2)
    return [(a, b) for (a, one), (b, other) in pairs if one.overlaps(other)]


def test_a_label_beyond_the_edge_is_seen():
    with drawing.style():
        figure, (axes,) = drawing.panels(1, 2.0)
        axes.set_ylabel("inside")
        assert cut_off(figure) == {}
        figure.text(0.95, 0.5, "a label that is too long")
        assert list(cut_off(figure)) == ["right"]


def test_a_legend_over_a_title_is_seen():
    with drawing.style():
        figure, (axes,) = drawing.panels(1, 2.0)
        axes.plot([0, 1], label="a trace")
        drawing.legend(axes)
        assert covered(figure) == []
        axes.set_title("a title as long as the panel is wide " * 4)
        assert len(covered(figure)) == 1


@pytest.mark.parametrize("truth", [Truth(noise=0.02, tooth_error=0.002), Truth(noise=0.2)])
def test_no_text_of_a_report_leaves_its_figure_or_covers_another(truth, tmp_path, monkeypatch):
    drawn: dict[str, dict[str, float]] = {}
    overlapping: dict[str, list[tuple[str, str]]] = {}
    to_svg = drawing.svg

    def noted(figure: Figure, name: str) -> str:
        drawn[name] = cut_off(figure)
        overlapping[name] = covered(figure)
        return to_svg(figure, name)

    monkeypatch.setattr(drawing, "svg", noted)
    found = identified(recording(truth))
    write_report(found, studied(found), tmp_path, None)
    assert len(drawn) >= 5
    assert {name: beyond for name, beyond in drawn.items() if beyond} == {}
    assert {name: pairs for name, pairs in overlapping.items() if pairs} == {}
