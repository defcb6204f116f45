"""Titles of columns: name and unit, in the ways in which loggers write them."""

import re
from functools import lru_cache

from slipbench.protocol.units import converts

# Behind the unit TrackAddict writes the source: "Engine Speed (rpm) *OBD".
_BRACKETS = re.compile(r"(.*?)\s*[(\[{<]\s*([^()\[\]{}<>]{0,16}?)\s*[)\]}>]\s*(\*\w{1,8})?")
_BEHIND = re.compile(r"(.*\S)(?:\s+in\s+|\s+/\s+|\s*,\s+|\s+-\s+)(\S{1,12})\s*")
# RaceCapture: "EngineTemp"|"F"|0|300|1, which the CSV reader leaves with some of its quotes.
_PIPES = re.compile(r'"?([^|"]+)"?\|"?([^|"]*)"?(?:\|-?[\d.]+){2,3}')
_GRAVITY = re.compile(r"acc|g[ _]?force|(?:^|[_ ])a[xyz]?_", re.IGNORECASE)

# Last word of a name -> unit. Only words that stand for nothing else at the end of a signal's name.
ENDINGS = {
    "kmh": "km/h",
    "km_h": "km/h",
    "kph": "km/h",
    "mph": "mph",
    "mps": "m/s",
    "m_s": "m/s",
    "ms1": "m/s",
    "m_per_s": "m/s",
    "knots": "knot",
    "kts": "knot",
    "mps2": "m/s^2",
    "ms2": "m/s^2",
    "m_s2": "m/s^2",
    "m_per_s2": "m/s^2",
    "rpm": "rpm",
    "rads": "rad/s",
    "rad_s": "rad/s",
    "rad_per_s": "rad/s",
    "radps": "rad/s",
    "degs": "deg/s",
    "deg_s": "deg/s",
    "deg_per_s": "deg/s",
    "dps": "deg/s",
    "deg": "deg",
    "rad": "rad",
    "degc": "degC",
    "deg_c": "degC",
    "celsius": "degC",
    "degf": "degF",
    "pct": "%",
    "percent": "%",
    "perc": "%",
    "bar": "bar",
    "mbar": "mbar",
    "hpa": "hPa",
    "kpa": "kPa",
    "mpa": "MPa",
    "psi": "psi",
    "mm": "mm",
    "nm": "N m",
    "volts": "V",
    "mv": "mV",
    "g": "standard_gravity",
}
_MOST_WORDS = 3  # of an ending
_ALONE = ("rpm", "kmh", "kph", "mph")  # a whole name that is a unit
# What a bare word behind a name may measure. "F" or "L" there is the front or the left.
_MEASURED = ("m/s", "m/s^2", "rad/s", "rad", "Pa", "K", "V", "A", "s", "N m", "m", "Hz")
_ONE_LETTER = "sVAmgG%°"


def split_unit(title: str) -> tuple[str, str]:
    """Name and unit of a title such as "Throttle Pos (%)", "Time[s]" or "v in km/h".

    In brackets any short text is taken for a unit; behind a comma, a dash, a stroke or "in" only a
    unit that is known.
    """
    text = title.strip()
    if piped := _PIPES.fullmatch(text):
        return piped[1].strip(), piped[2].strip()
    match = _BRACKETS.fullmatch(text)
    if match and match[1].strip():
        return f"{match[1].strip()} {match[3] or ''}".strip(), match[2]
    match = _BEHIND.fullmatch(text)
    if match and _is_measured(match[2]):
        return match[1], match[2]
    return text, ""


def _is_measured(word: str) -> bool:
    if len(word) == 1:
        return word in _ONE_LETTER
    return any(converts(word, unit) for unit in _MEASURED)


@lru_cache(maxsize=4096)
def unit_in_name(name: str) -> str:
    """Unit that the end of a name states, "speed_kmh" -> km/h; "" where it states none."""
    words = _words(name)
    if len(words) == 1 and words[0].casefold() in _ALONE:
        return ENDINGS[words[0].casefold()]
    return ENDINGS.get(_ending(name, words), "")


def without_unit(name: str) -> str:
    """Name without the unit at its end, "speed_kmh" -> "speed"; as it is where there is none."""
    words = _words(name)
    ending = _ending(name, words)
    return "_".join(words[: len(words) - len(ending.split("_"))]) if ending else name


def _words(name: str) -> list[str]:
    return re.sub(r"([a-z])([A-Z])", r"\1_\2", name).replace(" ", "_").split("_")


def _ending(name: str, words: list[str]) -> str:
    """Last words of a name that are a unit; "" where none are."""
    for count in range(min(_MOST_WORDS, len(words) - 1), 0, -1):
        ending = "_".join(words[-count:]).casefold()
        if ending in ENDINGS and (ending != "g" or _GRAVITY.search(name)):
            return ending
    return ""


def is_time_unit(unit: str) -> bool:
    """Whether a unit measures time."""
    return bool(unit) and converts(unit, "s")
