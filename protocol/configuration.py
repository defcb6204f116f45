"""Configuration is read once, from TOML, into frozen objects; an unknown key is an error."""

import difflib
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError
from pydantic_core import CoreSchema, core_schema

from slipbench.protocol.errors import InputError
from slipbench.protocol.units import parse_quantity
from slipbench.protocol.user_file import read_user_file

LARGEST = 4_000_000  # bytes of a TOML file
DEEPEST = 100  # parts of a dotted key; the time that tomllib takes grows with their square
_PART = r"""(?:(?<![\w-])[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_DOTTED = re.compile(rf"(?:{_PART}[ \t]*+\.[ \t]*+)++")


class Section(BaseModel):
    """One table of a TOML file: frozen, with no unknown keys, and only finite numbers."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, arbitrary_types_allowed=True, allow_inf_nan=False
    )


@dataclass(frozen=True)
class InSI:
    """Annotation of a field: a number in an SI unit, or a text with a unit that becomes it."""

    unit: str

    def convert(self, value: Any) -> Any:
        """Number in the SI unit; what is neither number nor text unchanged. Raises ValueError."""
        try:
            known = isinstance(value, (str, int, float))
            return parse_quantity(value, self.unit) if known else value
        except InputError as cause:
            raise ValueError(f"{cause.expected} is expected; {cause.remedy}") from cause

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Schema that converts before the number is checked."""
        return core_schema.no_info_before_validator_function(self.convert, handler(source))


@dataclass(frozen=True)
class Unit:
    """Annotation of a field: the unit of a number that is written without one."""

    unit: str


Seconds = Annotated[float, InSI("s")]
Hertz = Annotated[float, InSI("Hz")]
Metres = Annotated[float, InSI("m")]
MetresPerSecond = Annotated[float, InSI("m/s")]

Model = TypeVar("Model", bound=BaseModel)


def load_toml(path: Path) -> dict[str, Any]:
    """Contents of a TOML file. Raises InputError that names the file, the line and the remedy."""
    try:
        text = read_user_file(path, LARGEST)
        return tomllib.loads(_not_too_deep(text.decode("utf-8").replace("\r\n", "\n")))
    except ValueError as cause:  # not TOML, not UTF-8, or a number of thousands of digits
        raise InputError(
            "not valid TOML", where=str(path), found=str(cause), remedy="correct that line"
        ) from cause
    except RecursionError as cause:
        raise InputError("nested too deeply", where=str(path), remedy="use fewer levels") from cause


def _not_too_deep(text: str) -> str:
    """The text unchanged. Raises ValueError for a dotted key of more than DEEPEST parts."""
    for found in _DOTTED.finditer(text):
        if found[0].count(".") > DEEPEST:
            line = text.count("\n", 0, found.start()) + 1
            raise ValueError(f"more than {DEEPEST} parts with dots between (at line {line})")
    return text


def read_toml(path: Path, model: type[Model], *, recorded: bool = False) -> Model:
    """Read a TOML file into `model`. Raises InputError that lists every fault of the file.

    recorded: the file belongs to a recording; see `parse`.
    """
    return parse(load_toml(path), model, where=str(path), recorded=recorded)


def parse(data: dict[str, Any], model: type[Model], where: str, *, recorded: bool = False) -> Model:
    """Check plain data against `model`.

    recorded: the trial is over, so hard bounds on its limits do not apply (older versions had none,
    and accepted numbers without a unit as SI). Raises InputError that names the file and every key
    at fault, and for an unknown key the nearest known one.
    """
    try:
        return model.model_validate(data, context={"recorded": recorded})
    except ValidationError as cause:
        faults = [_fault(error, model, data) for error in cause.errors()]
        raise InputError("; ".join(faults), where=where) from cause


def _fault(error: Any, model: type[BaseModel], data: Any) -> str:
    path = _written_path(error["loc"], data)
    if error["type"] == "extra_forbidden":
        known = _known_keys(model, error["loc"][:-1])
        near = difflib.get_close_matches(str(error["loc"][-1]), known, n=1, cutoff=0.4)
        hint = f"did you mean {near[0]!r}?" if near else "known here: " + ", ".join(sorted(known))
        return f"unknown key {path!r}; {hint}"
    if error["type"] == "missing":
        return f"{path} is missing"
    if error["type"] in ("union_tag_invalid", "union_tag_not_found"):
        return _unknown_variant(error, path)
    message = error["msg"].removeprefix("Value error, ").replace("Input should be", "must be")
    return f"{path} = {error['input']!r}: {message}" if path else message


def _unknown_variant(error: Any, path: str) -> str:
    """Message for a table whose kind (a key such as `waveform`) is unknown or missing."""
    key = f"{path}.{error['ctx']['discriminator'].strip(chr(39))}"
    if error["type"] == "union_tag_not_found":
        return f"{key} is missing"
    written, known = error["ctx"]["tag"], error["ctx"]["expected_tags"]
    near = difflib.get_close_matches(written, re.findall(r"'([^']+)'", known), n=1, cutoff=0.4)
    hint = f"did you mean {near[0]!r}?" if near else f"known here: {known}"
    return f"{key} = {written!r}: unknown; {hint}"


def _written_path(location: tuple[Any, ...], data: Any) -> str:
    """Name a key as the file has it: without the tags that pydantic adds for unions."""
    written = ""
    for number, part in enumerate(location, 1):
        inner = _inner(data, part)
        if inner is not None or number == len(location):
            written += f"[{part}]" if isinstance(data, list | tuple) else f".{part}"
            data = inner
    return written.removeprefix(".")


def _inner(data: Any, part: Any) -> Any:
    """What the data have at one part of a path; None where they lack it."""
    if isinstance(data, list | tuple):
        return data[part] if isinstance(part, int) and part < len(data) else None
    return data.get(part) if isinstance(data, dict) else None


def _known_keys(model: type[BaseModel], path: tuple[Any, ...]) -> list[str]:
    """Name the keys of the table at `path` below `model` (discriminated unions included)."""
    level: list[type[BaseModel]] = [model]
    for part in path:
        deeper = [
            inner
            for candidate in level
            for name, field in candidate.model_fields.items()
            if name == part
            for inner in _models_in(field.annotation)
        ]
        level = deeper or level
    return sorted({name for candidate in level for name in candidate.model_fields})


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for part in getattr(annotation, "__args__", ()) for found in _models_in(part)]
