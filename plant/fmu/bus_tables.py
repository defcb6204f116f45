"""The part of tables.h that describes CAN frames, as can.c reads it."""

from collections.abc import Iterator, Mapping, Sequence

from slipbench.plant.fmu.bus import TIME, Bus, BusFrame, BusProtection, BusSignal, steps_of
from slipbench.plant.fmu.c_text import c_number
from slipbench.plant.fmu.variables import Variable

NO_VARIABLE, CLOCK = 0, -1
KINDS = {"xor": 0, "sum": 1, "crc8": 2}


def bus_tables(bus: Bus, step: float, variables: Sequence[Variable]) -> dict[str, object]:
    """Return macros by name. step: internal step, s. Raises ValueError, see `Bus.interval`."""
    references = {one.name: k for k, one in enumerate(variables, start=1)}
    signals = [s for frame in bus.frames for s in frame.signals]
    return {
        "FRAME_COUNT": len(bus.frames),
        "FRAMES": ", ".join(_frames(bus, step)),
        "SIGNALS": ", ".join(_signal(s, references) for s in signals),
        "BIT_RATE": bus.bitrate,
        "TICK_STEPS": bus.interval(step),
        "BUFFER": bus.buffer,
        "CAN_REFERENCE": len(variables) + 1,
    }


def _frames(bus: Bus, step: float) -> Iterator[str]:
    first = 0
    for frame in bus.frames:
        yield _frame(frame, steps_of(frame, step), first)
        first += len(frame.signals)


def _frame(frame: BusFrame, every: int, first: int) -> str:
    numbers = (frame.identifier, int(frame.extended), int(frame.fd), frame.length, every, first)
    start = ", ".join(map(str, (*numbers, len(frame.signals))))
    return f'{{"{frame.name}", {start}, {_protection(frame.protection)}}}'


def _protection(rule: BusProtection | None) -> str:
    if rule is None:
        return "{0}"
    ids = ", ".join(map(str, rule.data_ids)) or "0"
    checksum = (rule.place, KINDS[rule.kind], rule.polynomial, rule.start, rule.final_xor)
    numbers = ", ".join(map(str, checksum))
    return f"{{{rule.profile}, {rule.period}, {{{ids}}}, {_bits(rule.counter)}, {numbers}}}"


def _signal(one: BusSignal, references: Mapping[str, int]) -> str:
    special = {"": NO_VARIABLE, TIME: CLOCK}
    reference = special[one.variable] if one.variable in special else references[one.variable]
    flags = ", ".join(str(int(flag)) for flag in (one.signed, one.real, one.wraps))
    numbers = ", ".join(c_number(float(v)) for v in (one.scale, one.offset, one.low, one.high))
    return f'{{"{one.name}", {reference}, {flags}, {_bits(one.bits)}, {numbers}, {one.fixed}}}'


def _bits(places: Sequence[int]) -> str:
    return f"{{{len(places)}, {{{', '.join(map(str, places)) or '0'}}}}}"
