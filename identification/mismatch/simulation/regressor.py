"""Regressors of a free curve: a quantity z now, its past, its hysteresis, its scale, or its turn.

Now: a piecewise linear function f(z) with knots in z. Past: a step response to z, piecewise linear
over the lag, so that delays, lags and resonances have the same form. Hysteresis: a sum of elements
that follow z within their half width and then slide, the stops of Prandtl and Ishlinskii (Brokate
and Sprekels, "Hysteresis and Phase Transitions" (1996), section 2.3), by which play and dry
friction differ from any f(z). Scale: f(z) x, a piecewise linear gain over z of another quantity x.
Turn: a periodic function of an angle, its first orders without the mean, since a constant does not
depend on the angle.

All curves are linear in their values. They are evaluated for every row of a simulation, since
effects of some milliseconds or of a wheel's angle are averaged out in longer bins.
"""

from collections.abc import Iterable, Iterator, Mapping
from itertools import pairwise

import numpy as np
from numba import njit

from slipbench.plant.signals import Floats

PAST = "past of "
HYSTERESIS = "hysteresis of "
SCALE = "scale of "
DETAIL = "detail of "
OVER = " along "
"""Between the scaled quantity and the quantity on which the scale depends."""
TURN = "turn of "
ANGLE = TURN + "rear wheel"
LAGS = np.array((0.0, 0.005, 0.012, 0.03, 0.07, 0.15, 0.3, 0.6, 1.2, 2.4))
"""Lags after a step, s."""
WIDTHS = np.array((0.0, 0.004, 0.012, 0.04, 0.12, 0.4))
"""Half widths as shares of the quantity's range; 0 stands for the quantity itself."""
KNOTS = 7
"""Knots of a piecewise linear curve, or of a turn: there evenly spaced, for orders up to 3."""
FINE = 30
ROUNDS = (7, 15, 31)
"""Evenly spaced knots of a turn once a curve is detected: for orders up to 3, 7 and 15."""
HALVED = {HYSTERESIS: 0, DETAIL: 2}
"""How often knot spacings are halved once a curve is detected; 1 for other kinds."""
KINDS = (PAST, HYSTERESIS, SCALE, DETAIL, TURN)
ENDS = (0.002, 0.998)
"""Quantiles of a quantity that count as the ends of its range."""


def kind_of(regressor: str) -> str:
    """Return the kind of a regressor: one of KINDS, or an empty string for the value now.

    Knots are lags (s) of a past, half widths (in the quantity's unit) of a hysteresis, evenly
    spaced angles of a turn, else values of the quantity (many of them for its detail). The waveform
    of a scale consists of two quantities, (2, rows).
    """
    return next((kind for kind in KINDS if regressor.startswith(kind)), "")


def quantity_of(regressor: str) -> str:
    """Return the quantity on the abscissa of a curve."""
    return regressor.removeprefix(kind_of(regressor)).rpartition(OVER)[2]


def scale(scaled: Floats, abscissa: Floats) -> Floats:
    """Return the waveform of a regressor that scales one quantity over another, (2, rows)."""
    return np.stack((abscissa, scaled))


def with_kinds(
    quantities: Mapping[str, Floats],
    past: Iterable[str] = (),
    hysteresis: Iterable[str] = (),
    detail: Iterable[str] = (),
    scaled: Iterable[tuple[str, str]] = (),
) -> dict[str, Floats]:
    """Return quantities and regressors of other kinds that are made of them.

    Shape (rows,) each; (2, rows) for a scale. past, hysteresis, detail: names of quantities; those
    that do not exist are left out. scaled: pairs of the quantity that is scaled and the one over
    which its factor varies.
    """
    kinds = {PAST: past, HYSTERESIS: hysteresis, DETAIL: detail}
    more = {k + n: quantities[n] for k, names in kinds.items() for n in names if n in quantities}
    for what, over in scaled:
        if what in quantities and over in quantities:
            more[f"{SCALE}{what}{OVER}{over}"] = scale(quantities[what], quantities[over])
    return {**quantities, **more}


def knots_for(regressor: str, z: Floats) -> Floats:
    """Return the knots of a curve: of z, lags or half widths; empty where z does not vary.

    Shape (knots,), in the unit of z; s for lags, rad for a turn. z: the quantity alone, shape
    (rows,) or (bins,).
    """
    if kind_of(regressor) == PAST:
        return LAGS if np.ptp(z) > 0.0 else np.empty(0)
    if kind_of(regressor) == HYSTERESIS:
        low, high = np.quantile(z, ENDS)
        return WIDTHS * (high - low) if high > low else np.empty(0)
    if kind_of(regressor) == TURN:
        return even_angles(KNOTS) if np.ptp(z) > 2.0 * np.pi else np.empty(0)
    return knots_between(z, FINE if kind_of(regressor) == DETAIL else KNOTS)


def columns(regressor: str, z: Floats, knots: Floats, step: float) -> Iterator[Floats]:
    """Yield the columns, (rows,), one for each knot, of which a curve is the weighted sum.

    z: the quantity, (rows,), or the result of `scale`; step: s, of a row.
    """
    if kind_of(regressor) == PAST:
        yield from _past(z - z.mean(), knots, step)
    elif kind_of(regressor) == HYSTERESIS:
        yield from _stops(z - z.mean(), knots)
    elif kind_of(regressor) == SCALE:
        for row in np.eye(knots.size):
            yield z[1] * np.interp(z[0], knots, row)
    elif kind_of(regressor) == TURN:
        yield from _fourier(z, knots)
    else:
        for row in np.eye(knots.size):
            yield np.interp(z, knots, row)


def curve_waveform(regressor: str, z: Floats, knots: Floats, values: Floats, step: float) -> Floats:
    """Return the waveform of a curve, shape (rows,).

    z: the quantity, shape (rows,), or the result of `scale`, (2, rows); knots, values: (n,). step:
    s, of a row.
    """
    if kind_of(regressor) == SCALE:
        return np.asarray(z[1] * np.interp(z[0], knots, values))
    if kind_of(regressor) in ("", DETAIL):
        return np.interp(z, knots, values)
    parts = columns(regressor, z, knots, step)
    return np.asarray(sum(v * part for v, part in zip(values, parts, strict=True)))


def half_range(regressor: str, z: Floats, knots: Floats) -> Floats:
    """Return the magnitude of each knot's column, (knots,), in the unit of the column."""
    if kind_of(regressor) == PAST:
        return np.full(knots.size, float(np.std(z)))
    if kind_of(regressor) == HYSTERESIS:
        return np.where(knots > 0.0, knots, float(np.std(z)))
    if kind_of(regressor) == SCALE:
        return np.full(knots.size, float(np.sqrt(np.mean(z[1] ** 2))))
    return np.ones(knots.size)


def finer(regressor: str, knots: Floats) -> Floats:
    """Return the knots with others in between, as set in `HALVED`; half widths stay as they are.

    knots: (n,), in increasing order.
    """
    for _ in range(HALVED.get(kind_of(regressor), 1)):
        knots = np.sort(np.concatenate((knots, 0.5 * (knots[1:] + knots[:-1]))))
    return knots


def even_angles(count: int) -> Floats:
    """Return evenly spaced angles of a turn, rad."""
    return 2.0 * np.pi * np.arange(count) / count


def step_response(knots: Floats, values: Floats, time: Floats) -> Floats:
    """Return the step response of a curve of the past. time: s after a step of its quantity."""
    return np.interp(time, knots, np.cumsum(values))


def change_after_reversal(widths: Floats, values: Floats, distance: Floats) -> Floats:
    """Return the change of a hysteresis curve after a reversal, without its part linear in z.

    distance: of z since the reversal, in the unit of the half widths.
    """
    slides = widths > 0.0
    return np.asarray(np.minimum(distance[:, None], 2.0 * widths[slides]) @ values[slides])


def knots_between(z: Floats, count: int) -> Floats:
    """Return means of quantiles and even knots, none closer than a fifth of an even step.

    z: (n,); gives at most `count` knots, in the unit of z, and none where z does not vary.
    """
    low, high = np.quantile(z, ENDS)
    if not high > low:
        return np.empty(0)
    knots = 0.5 * np.quantile(z, np.linspace(*ENDS, count)) + 0.5 * np.linspace(low, high, count)
    return knots[np.concatenate(([True], np.diff(knots) > 0.2 * (high - low) / (count - 1)))]


def _fourier(z: Floats, knots: Floats) -> Iterator[Floats]:
    """Yield, for each knot, the orders that are 1 there and 0 at all others, less their mean."""
    orders = np.arange(1, (knots.size - 1) // 2 + 1)
    for knot in knots:
        yield 2.0 / knots.size * np.cos(orders[:, None] * (z - knot)).sum(axis=0)


def _past(z: Floats, lags: Floats, step: float) -> Iterator[Floats]:
    """Yield z itself, then its mean between each two lags; z is constant before the start."""
    yield z
    integrated = np.concatenate(([0.0], np.cumsum(z) * step))
    now = step * np.arange(1, z.size + 1)

    def integral(until: Floats) -> Floats:
        inside = np.interp(until, step * np.arange(z.size + 1), integrated)
        return np.asarray(inside + np.minimum(until, 0.0) * z[0])

    for near, far in pairwise(lags):
        yield (integral(now - near) - integral(now - far)) / (far - near)


def _stops(z: Floats, widths: Floats) -> Iterator[Floats]:
    """Yield stop elements, which follow z within their half width and then slide; 0: z itself."""
    for width in widths:
        yield _stop(z, float(width)) if width > 0.0 else z


@njit(cache=True)
def _stop(z: Floats, width: float) -> Floats:
    output = np.empty_like(z)
    now, before = 0.0, z[0]
    for i in range(z.size):
        now = min(max(now + z[i] - before, -width), width)
        before = z[i]
        output[i] = now
    return output
