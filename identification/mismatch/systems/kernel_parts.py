"""Text of functions that a kernel calls: delays of quantities with jumps, linear interpolation."""

WITHIN, FIRST, ROW, STEP, END = range(5)
"""Instants at which the rates are evaluated: within a step; at the begin of the simulation, of a
row, of a later step of the row; at the end of a row."""

# A quantity is the sum of its jumps between rows, constant over a step, and of a remainder that is
# linear over a step. Delayed jumps act by their mean over the step: evaluated at the stages of the
# step only, a jump within the step would not move with the delay.
# ring: sum of the jumps so far, and the remainder, at the begin of each step. memory: the quantity
# at the end of the last row.
KEEP = f"""def keep(ring, memory, count, when, value):
    here, before = count & (ring.shape[1] - 1), (count - 1) & (ring.shape[1] - 1)
    if when == {FIRST}:
        ring[0, :], ring[1, :] = 0.0, value
    elif when == {END}:
        memory[0] = value
    elif when != {WITHIN}:
        ring[0, here] = ring[0, before] + (value - memory[0] if when == {ROW} else 0.0)
        ring[1, here] = value - ring[0, here]
"""
PAST = """def past(ring, count, fraction, value, delay_steps):
    mask = ring.shape[1] - 1
    whole = int(delay_steps)
    share = delay_steps - whole
    new, old = ring[0, (count - whole) & mask], ring[0, (count - whole - 1) & mask]
    jumps = new + share * (old - new)
    place = fraction - delay_steps
    if place >= 0.0:
        begun, now = ring[1, count & mask], value - ring[0, count & mask]
        return jumps + (begun + (now - begun) * place / fraction if fraction > 0.0 else now)
    whole = int(-place)
    share = -place - whole
    new, old = ring[1, (count - whole) & mask], ring[1, (count - whole - 1) & mask]
    return jumps + new + share * (old - new)
"""

# Linear interpolation, constant beyond the knots. table: knots, values; the last may be repeated.
LINE = """def line(table, z):
    last = table.shape[1] - 1
    if z <= table[0, 0]:
        return table[1, 0]
    for k in range(1, last + 1):
        if z < table[0, k]:
            share = (z - table[0, k - 1]) / (table[0, k] - table[0, k - 1])
            return table[1, k - 1] + share * (table[1, k] - table[1, k - 1])
    return table[1, last]
"""
