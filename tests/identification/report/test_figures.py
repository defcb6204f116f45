"""What is printed on a figure is on the figure: nothing is cut off at its edges."""

import pytest
from matplotlib.figure import Figure

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


def test_a_label_beyond_the_edge_is_seen():
    with drawing.style():
        figure, (axes,) = drawing.panels(1, 2.0)
        axes.set_ylabel("inside")
        assert cut_off(figure) == {}
        figure.text(0.95, 0.5, "a label that is too long")
        assert list(cut_off(figure)) == ["right"]


@pytest.mark.parametrize("truth", [Truth(noise=0.02, tooth_error=0.002), Truth(noise=0.2)])
def test_no_text_of_a_report_leaves_its_figure(truth, tmp_path, monkeypatch):
    drawn: dict[str, dict[str, float]] = {}
    to_svg = drawing.svg

    def noted(figure: Figure, name: str) -> str:
        drawn[name] = cut_off(figure)
        return to_svg(figure, name)

    monkeypatch.setattr(drawing, "svg", noted)
    found = identified(recording(truth))
    write_report(found, studied(found), tmp_path, None)
    assert len(drawn) >= 5
    assert {name: beyond for name, beyond in drawn.items() if beyond} == {}
