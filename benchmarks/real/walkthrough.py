"""`make walkthrough`: write docs/how_a_mismatch_is_explained.md from one real case, step by step.

    python -m benchmarks.real.walkthrough RECORDINGS

The case is the Silverbox: an electronic circuit that behaves as a mass on a hardening spring.
"""

import sys
import time
from collections.abc import Iterable
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from benchmarks.real.cases import CASES
from benchmarks.real.run import BUILD, DOCS, _import, _model
from slipbench.identification.mismatch.analysis import Analysis
from slipbench.identification.mismatch.explain import NAMES, analyse
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.memo import sentence
from slipbench.identification.mismatch.runs import open_analysis

CASE = next(case for case in CASES if case.name == "silverbox")
PAGE = DOCS / "how_a_mismatch_is_explained.md"
SHOWN = 5
"""Rows of a table."""


def main(recordings: Path) -> None:
    """Analyse the case and write the page with its two figures."""
    _import(recordings, CASE)
    folders = [[BUILD / "runs" / n for n in names] for names in (CASE.training, CASE.held_out)]
    analysis = open_analysis(_model(CASE), *folders)
    used = time.process_time()
    analyse(analysis)
    used = time.process_time() - used
    _draw_curve(analysis, DOCS / "figures/explained_curve.png")
    _draw_residuals(analysis, DOCS / "figures/explained_residuals.png")
    PAGE.write_text(_page(analysis, used), encoding="utf-8")


def _page(a: Analysis, used: float) -> str:
    assert a.base is not None
    assert a.named is not None
    best = a.before[0]
    steps = "\n".join(f"{i}. {name}" for i, name in enumerate(NAMES, start=1))
    names = ", ".join(f"`{name}`" for name in a.named.names)
    return f"""# How a mismatch is explained

Made by `make walkthrough` from a published recording, the Silverbox (Wigren and Schoukens, *Three free data sets for
development and benchmarking in nonlinear system identification*, ECC 2013): a circuit that behaves as a mass on a spring.
The model file `examples/models/silverbox.toml` has a linear spring. What does the simulation lack? The command is

    slipbench explain --vehicle examples/models/silverbox.toml TRAINING... --held-out RUN...

and its answer, after {used:.0f} s of processor time:

> {sentence(verdict(a))}

An analysis has {len(NAMES)} steps, and each works on what the one before left (`identification/mismatch/explain.py`):

{steps}

## 1. Calibration

**In:** the model file with its parameters and their half widths (95 %), the training recordings.
**Out:** the parameters that fit the recordings best, held to the file by their half widths; a noise model of the residuals.

The parameters, a slowly varying disturbance and the noise move together, so that nothing is explained as missing physics
that another value of a parameter explains as well (`fit/calibrate.py`).

{_parameters(a)}

## 2. Localization

**In:** the calibrated simulation, its residuals on training and held-out recordings.
**Out:** at every input, seam and rate of the model, along every quantity: a free curve f(z), and the log-likelihood that it gains.

No library is needed for this: the curve is a broken line, added to the quantity (`curves/locate.py`). {len(a.before)} curves were
fitted. The best acts on **{best.place}** along **{best.regressor}**.

{_curves(a)}

Places that reach the output through one equation tie: a localization names the equation and the motion, the effect comes next.

![The best curve](figures/explained_curve.png)

## 3. Effect selection

**In:** the library of effects, each at every place where it may act.
**Out:** effects that are accepted, those that these recordings cannot tell from them, and what the held-out recordings contradict.

A score test predicts for each effect, from one simulation, what a fit would gain (`naming/score.py`). The most promising are fitted
fully, together with all parameters (`naming/fits.py`).

{_scores(a)}

An effect is accepted if it gains at least 12 nats, if its size is significant against serially correlated errors, over all
tests (5 % of false alarms in the whole family), and if the held-out recordings do not contradict it
(`naming/acceptance.py`, `naming/significance.py`). If several are accepted, each is exchanged for others once; then each is
removed once, and must be needed (`naming/search.py`). Accepted: {names}; together {a.named.log_likelihood_gain:.0f} nats.

{_effects(a)}

## 4. Residual test

**In:** the simulation with the accepted effects.
**Out:** whether a free curve still explains more than 5 % of what they explain (`curves/adequacy.py`).

{_remains(a)}

## 5. Free curve

Only if the effects do not suffice: the best curve is fitted in the simulation (`curves/fit_in_model.py`).
{"It was not needed here." if a.free is None else "Here it replaces the effects."}

## 6. Validation on held-out recordings

**In:** the model file as written, re-calibrated, and with the accepted effects. **Out:** their errors on recordings that no fit has used.

{_errors(a)}

![Residuals on the held-out recording](figures/explained_residuals.png)

The memo tells the improvement against the *re-calibrated* file: what calibration alone explains is no proof of an effect.

## 7. The next trial

Where two effects cannot be told apart, or were not excited, the trials of the system's menu are simulated, and the one that
would tell most is proposed (`naming/next_trial.py`). A model file has no menu: it has no trials.

How often all this is right on cases whose answer is hidden: [blind validation](blind_validation.md). What it finds in other
published recordings: [real recordings](real_recordings.md).
"""


def _table(head: str, rows: Iterable[str]) -> str:
    return "\n".join([f"| {head} |", "|" + "---|" * (head.count("|") + 1), *rows])


def _parameters(a: Analysis) -> str:
    assert a.base is not None
    known = zip(a.base.model.known, a.base.point.x, strict=True)
    rows = (f"| {k.name} | {k.at(0.0):.4g} | {k.at(float(x)):.4g} | {x:+.2f} |" for k, x in known)
    return _table("parameter | as written | calibrated | moved by, prior deviations", rows)


def _curves(a: Analysis) -> str:
    rows = (
        f"| {c.place} | {c.regressor} | {c.log_likelihood_gain:.0f} | {c.confirmed:.0f} | {c.p:.1e} |"
        for c in a.before[:SHOWN]
    )
    return _table("place | along | gain in training, nats | held out, nats | p, family-wise", rows)


def _scores(a: Analysis) -> str:
    assert a.named is not None
    rows = (
        f"| {s.candidate.name} | {s.log_likelihood_gain:.0f} | {100 * s.kept:.0f} |"
        for s in a.named.scores[:SHOWN]
    )
    return _table("effect | predicted gain, nats | share that calibration cannot hide, %", rows)


def _effects(a: Analysis) -> str:
    found = (
        f"| {e.name} at {e.subject} | {p.name} | {p.value:.4g} | {p.low:.4g} to {p.high:.4g} | {p.unit} |"
        for e in verdict(a).effects
        for p in e.parameters
    )
    return _table("effect | parameter | value | 95 % interval | unit", found)


def _remains(a: Analysis) -> str:
    if a.remains is None:
        return "Nothing certain was left."
    share = f"{100 * a.remains.share:.2g} % of the mean square that the effects explain"
    return (
        f"Left here: {share}; {'the names suffice' if a.remains.small else 'they do not suffice'}."
    )


def _errors(a: Analysis) -> str:
    rows = (
        f"| {e.output} | {e.nominal:.4g} | {e.calibrated:.4g} | {e.improved:.4g} | {e.floor:.2g} |"
        for e in a.errors
    )
    return _table("output, RMS error | as written | re-calibrated | improved | noise floor", rows)


def _draw_curve(a: Analysis, path: Path) -> None:
    best = a.before[0]
    figure, axes = plt.subplots(figsize=(6, 3))
    z = np.linspace(best.knots[0], best.knots[-1], 400)
    axes.plot(z, best(z), color="C0")
    axes.plot(best.knots, best(best.knots), "o", color="C0", ms=4)
    axes.set(xlabel=best.regressor, ylabel=f"added to {best.place} / {best.unit}")
    _save(figure, path)


def _draw_residuals(a: Analysis, path: Path) -> None:
    assert a.held_out is not None
    record = a.held_out.records[0]
    t = record.grid.centre
    block = a.held_out.partition.groups[0]
    figure, axes = plt.subplots(figsize=(7, 3))
    labels = ("as written", "re-calibrated", "improved")
    fit: Fit
    for fit, label, colour in zip(a.held_out_runs, labels, ("0.75", "C1", "C0"), strict=True):
        axes.plot(t, fit.residuals[0][0][:, 0], color=colour, lw=0.8, label=label)
    unit = record.sensors[block.outputs[0]].unit
    axes.set(xlabel="time / s", ylabel=f"residual of {block.name} / {unit}")
    axes.legend(loc="upper right", fontsize=8, frameon=False)
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    figure.tight_layout()
    figure.savefig(path, dpi=80)
    plt.close(figure)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
