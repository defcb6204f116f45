"""The memo as a page that needs nothing but a browser."""

from html import escape
from importlib.resources import files

from identification.mismatch.explain import Analysis
from identification.mismatch.memo import headline_error, lines, sentence
from identification.mismatch.pictures import curve_svg, residuals_svg
from identification.mismatch.verdict import Verdict


def memo_page(a: Analysis, verdict: Verdict) -> str:
    """Return the page: the sentence, the evidence, the runners-up, what stays unexplained."""
    style = (files("identification") / "report.css").read_text(encoding="utf-8")
    body = [f"<h1>{escape(sentence(verdict))}</h1>"]
    if a.before and a.before[0].certain:
        body += [
            "<h2>Where, found without the library</h2>",
            f"<figure>{curve_svg(a.before[0], a.system.units)}",
        ]
        best = "".join(
            f"<li>{escape(c.place)} along {escape(c.regressor)}: {c.gain:.0f} nats, "
            f"held out {c.confirmed:.0f}</li>"
            for c in a.before[:5]
        )
        body.append(f"</figure><ol>{best}</ol>")
    error = headline_error(verdict)
    if error is not None and a.held_out is not None and a.named is not None:
        body.append(f"<h2>Held out: {escape(error.output.replace('_', ' '))}</h2>")
        body.append(f"<figure>{residuals_svg(a, error.output)}</figure>")
    told = escape("\n".join(lines(verdict)[1:]))
    body.append(f"<h2>Evidence</h2><pre>{told}</pre>")
    head = f"<meta charset='utf-8'><title>Mismatch</title><style>{style}</style>"
    return (
        f"<!doctype html><html lang='en'><head>{head}</head><body><main>"
        + "".join(body)
        + "</main></body></html>\n"
    )
