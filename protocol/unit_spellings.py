"""Spellings of units that databases and loggers use, and that mean something else, or nothing, to pint.

Units that stand in products as well are in `units.txt`. EXACT holds spellings whose case matters (C, G). ANY_CASE holds the others, in small letters; it comes
before pint, which reads "kmph" as a thousand miles per hour and "min^-1" as a rate without turns.
"""

import re

EXACT = {
    "": "dimensionless",
    "-": "dimensionless",
    "1": "dimensionless",
    "C": "degC",
    "°C": "degC",
    "ºC": "degC",
    "F": "degF",
    "°F": "degF",
    "ºF": "degF",
    "°": "deg",
    "º": "deg",
    "KPa": "kPa",
    "G": "standard_gravity",
    "Grad": "deg",  # German; to pint a giga-radian. "grad" stays a gradian.
}

_SPELLINGS = {
    "km/h": "kmh km/h km/hr kmph kph",
    "mph": "mph mi/h miles/h",
    "m/s": "m_per_s mps m/sec meters/second metres/second",
    "knot": "kts knots",
    "m/s^2": "m/s2 m/s/s mps2 m/sec^2 m/s²",
    "rpm": "rpm 1/min min-1 min^-1 /min rev/min r/min u/min tr/min giri/min umdr/min ot/min",
    "deg": "deg degs degree degrees",
    "deg/s": "deg/sec degs/s degs/sec °/sec º/s dps",
    "degC": "deg_c degc celsius grad_c",
    "degF": "deg_f degf fahrenheit",
    "bar": "bar bars",
    "psi": "psi psig psia",
    "kPa": "kpa",
    "percent": "pct percent prozent",
    "V": "volt volts",
    "A": "amp amps",
    "s": "sec secs second seconds",
    "standard_gravity": "g's gee",
    "kgf/cm^2": "kg/cm2 kg/cm^2 kg/cm²",
}
ANY_CASE = {
    spelling: unit for unit, spellings in _SPELLINGS.items() for spelling in spellings.split()
} | {"deg c": "degC", "degrees c": "degC", "deg f": "degF", "deg / s": "deg/s"}


BARE_POWER = re.compile(r"(?<![\w^*])([A-Za-zµμΩ°]+)(-[1-4]|[2-4])(?![\w.])")
"""A power without its sign: s2, kg m2, s-1."""
INERTIA = re.compile(r"(?<![A-Za-z])kgm(?=(\^|\*\*)?2|²)")
"""The power of kgm^2 is that of the metre."""


def spelled(unit: str) -> str:
    """Unit as pint knows it; unchanged where its spelling is not listed here."""
    listed = EXACT.get(unit) or ANY_CASE.get(unit.casefold())
    return listed or BARE_POWER.sub(r"\1^\2", INERTIA.sub("kg m", unit))
