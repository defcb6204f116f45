"""Kernel text for stops of states: integration of a step with contacts.

A step that ends beyond a stop is integrated again: to the contact, which is located on the cubic
through positions and speeds at both ends, and from there with the rebound speed. So simulated
outputs are a smooth function of the parameters as long as no contact is grazing. A state that does
not leave the stop within its step comes to rest: its speed is 0.

A contact is detected at the end of a step: a state that exceeds a stop and returns within one step
is not detected.
"""

from collections.abc import Iterator, Sequence

from slipbench.identification.mismatch.systems.kernel_parts import WITHIN
from slipbench.identification.mismatch.systems.stops import Limit, Stop

STOPS = "stop_at, stop_speed, stop_low, stop_high"
MOST_CONTACTS = 8
"""Largest number of contacts in one step; then a state beyond a stop is set to rest at it."""

# Limit states to their stops. bouncing: also those with a speed, which are then set to rest.
WITHIN_STOPS = f"""def within_stops(x, bouncing, {STOPS}):
    for i in range(len(stop_at)):
        j, m = stop_at[i], stop_speed[i]
        if m >= 0 and not bouncing:
            continue
        if x[j] > stop_high[i]:
            x[j] = stop_high[i]
            if m >= 0:
                x[m] = min(x[m], 0.0)
        elif x[j] < stop_low[i]:
            x[j] = stop_low[i]
            if m >= 0:
                x[m] = max(x[m], 0.0)
"""
# Share of a step of length span after which a cubic from x to y reaches a limit, by bisection.
CROSSING = """def crossing(x, speed, y, last, span, limit, side):
    a, b = 0.0, 1.0
    for _ in range(60):
        s = 0.5 * (a + b)
        r = 1.0 - s
        place = r * r * ((1.0 + 2.0 * s) * x + s * span * speed)
        place += s * s * ((1.0 + 2.0 * r) * y - r * span * last)
        if side * (place - limit) < 0.0:
            a = s
        else:
            b = s
    return b
"""
# Earliest contact between two ends of a step: its share of the step, and 2 i or 2 i + 1 for the
# lower or the upper stop of number i; -1: none.
CONTACT = f"""def contact(begun, x, span, {STOPS}):
    first, which = 2.0, -1
    for i in range(len(stop_at)):
        j, m = stop_at[i], stop_speed[i]
        if m < 0:
            continue
        for k in range(2):
            limit, side = (stop_high[i], 1.0) if k == 1 else (stop_low[i], -1.0)
            if side * (begun[j] - limit) < 0.0 and side * (x[j] - limit) > 0.0:
                share = crossing(begun[j], begun[m], x[j], x[m], span, limit, side)
                if share < first:
                    first, which = share, 2 * i + k
    return first, which
"""
# From the state at one share of a step to that at another: one Runge-Kutta step.
LEG = """def leg(begin, end, s, substeps, row, before, after, held, begun, reached, total, u, p, {known}):
    {views}
    span = end - begin
    for i in range(len(begun)):
        x[i] = begun[i]
    for part in range(4):
        fraction = begin + span * (0.0 if part == 0 else (1.0 if part == 3 else 0.5))
        for i in range(len(u)):
            line = before[i] + (after[i] - before[i]) * (s + fraction) / substeps
            u[i] = after[i] if held[i] else line
        q[0] = (row * substeps + s + fraction) * step
        rates(u, p, fraction, fraction * step, {within}, {known})
        weight = 1.0 if part == 0 or part == 3 else 2.0
        ahead = span * step * (1.0 if part == 2 else 0.5)
        for i in range(len(begun)):
            total[i] = weight * dx[i] + (0.0 if part == 0 else total[i])
            x[i] = begun[i] + ahead * dx[i]
    for i in range(len(begun)):
        reached[i] = begun[i] + span * step / 6.0 * total[i]
"""
AT_FIRST = """
    begun = x.copy()
    stop_at, stop_speed = np.array({at}), np.array({speed})
    stop_low, stop_high, stop_back = np.zeros({n}), np.zeros({n}), np.zeros({n})
{limits}
    within_stops(x, True, {stops})"""
AT_BEGIN = """
            if part == 0:
                begun[:] = x"""
AT_STAGE = """
                within_stops(stage, False, {stops})"""
AT_END = """
                begin = 0.0
                for _ in range({most}):
                    share, which = contact(begun, x, (1.0 - begin) * step, {stops})
                    if which < 0:
                        break
                    middle = begin + share * (1.0 - begin)
                    leg(begin, middle, {leg})
                    i, side = which // 2, 2.0 * (which % 2) - 1.0
                    x[stop_at[i]] = stop_high[i] if side > 0.0 else stop_low[i]
                    if side * x[stop_speed[i]] > 0.0:
                        x[stop_speed[i]] *= -stop_back[i]
                    begun[:] = x
                    leg(middle, 1.0, {leg})
                    begin = middle
                within_stops(x, True, {stops})
                stage[:] = x"""


def functions(known: str, views: str) -> Iterator[str]:
    """Yield the functions that a kernel with stops calls.

    known: arguments of `rates` after `when`; views: the line that names the fields of the record.
    """
    leg = LEG.format(known=known, within=WITHIN, views=views)
    yield from (WITHIN_STOPS, CROSSING, CONTACT, leg)


def in_run(
    stops: Sequence[Stop], states: Sequence[str], parameters: Sequence[str], known: str
) -> dict[str, str]:
    """Return the text for `advance` at its start, and at each step's begin, stages and end.

    known: arguments of `rates` after `when`, by their names in `advance`.
    """
    if not stops:
        return dict.fromkeys(("at_first", "at_begin", "at_stage", "at_end"), "")
    limits = [
        f"    stop_{end}[{i}] = {_number(limit, parameters)}"
        for i, stop in enumerate(stops)
        for end, limit in (("low", stop.low), ("high", stop.high), ("back", stop.restitution))
    ]
    leg = f"s, substeps, r, before, u[r], held, begun, x, total, now, p, {known}"
    return {
        "at_first": AT_FIRST.format(
            at=[states.index(stop.state) for stop in stops],
            speed=[states.index(stop.speed) if stop.speed else -1 for stop in stops],
            n=len(stops),
            limits="\n".join(limits),
            stops=STOPS,
        ),
        "at_begin": AT_BEGIN,
        "at_stage": AT_STAGE.format(stops=STOPS),
        "at_end": AT_END.format(most=MOST_CONTACTS, stops=STOPS, leg=leg),
    }


def _number(limit: Limit, parameters: Sequence[str]) -> str:
    if isinstance(limit, str):
        return f"p[{parameters.index(limit)}]"
    return repr(limit).replace("inf", "math.inf")
