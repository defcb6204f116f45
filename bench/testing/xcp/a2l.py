"""Measurements of an A2L file: address, type, conversion to physical values, CAN identifiers.

Only what a measurement needs is read. Characteristics, records and axes are skipped.
"""

import re
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from slipbench.protocol.errors import InputError
from slipbench.protocol.user_file import read_user_file

LARGEST = 1 << 28  # bytes
TOKEN = re.compile(r'"(?:[^"\\]|\\.|"")*"|/begin\b|/end\b|[^\s"]+')
COMMENT = re.compile(r'"(?:[^"\\]|\\.|"")*"|/\*.*?(?:\*/|\Z)|//[^\n]*', re.DOTALL)
DEEPEST = 50  # blocks inside each other; files of the field have about ten
# Type of the file -> format of `struct`.
TYPES = {
    "UBYTE": "B",
    "SBYTE": "b",
    "UWORD": "H",
    "SWORD": "h",
    "ULONG": "I",
    "SLONG": "i",
    "A_UINT64": "Q",
    "A_INT64": "q",
    "FLOAT16_IEEE": "e",
    "FLOAT32_IEEE": "f",
    "FLOAT64_IEEE": "d",
}
ORDERS = {"MSB_LAST": "<", "MSB_FIRST": ">"}
EXTENDED = 1 << 31  # of a CAN identifier in the file: 29 bits


@dataclass(frozen=True)
class XcpMeasurement:
    """One measurement: physical value = raw * scale + offset, in `unit`.

    form  format of `struct`, with byte order
    mask  bits of the raw value that count; None: all
    """

    name: str
    address: int
    extension: int
    form: str
    scale: float
    offset: float
    unit: str
    mask: int | None = None

    @property
    def size(self) -> int:
        """Number of bytes."""
        return struct.calcsize(self.form)

    def value(self, data: bytes) -> float:
        """Physical value of `size` bytes, in `unit`."""
        (raw,) = struct.unpack(self.form, data)
        if self.mask is not None:
            shift = (self.mask & -self.mask).bit_length() - 1
            raw = (raw & self.mask) >> shift
        return float(raw * self.scale + self.offset)


@dataclass(frozen=True)
class A2l:
    """Measurements by name, and the CAN identifiers: `command` to the ECU, `response` from it.

    An identifier with bit 31 has 29 bits. None where the file states no XCP on CAN.
    """

    origin: str
    measurements: dict[str, XcpMeasurement]
    command: int | None
    response: int | None


@dataclass(frozen=True)
class _Block:
    """A block of the file: its words and strings in order, and the blocks inside."""

    kind: str
    words: list[str]
    blocks: list["_Block"]

    def all(self, kind: str) -> Iterator["_Block"]:
        """Blocks of a kind, at any depth."""
        for block in self.blocks:
            if block.kind == kind:
                yield block
            yield from block.all(kind)

    def after(self, keyword: str, default: str | None = None, first: int = 0) -> str | None:
        """The word behind a keyword, looked for from word `first` on."""
        for place in range(first, len(self.words) - 1):
            if self.words[place] == keyword:
                return self.words[place + 1]
        return default


def read_a2l(path: Path) -> A2l:
    """Read an A2L file. Raises InputError where it is damaged, or a conversion is not linear."""
    text = read_user_file(path, LARGEST).decode("utf-8-sig", errors="replace")
    root = _parse(COMMENT.sub(_without_comment, text), str(path))
    try:
        return _described(root, str(path))
    except (ValueError, IndexError, KeyError) as cause:
        raise InputError(
            "this A2L file is damaged",
            where=str(path),
            expected="blocks as in ASAM MCD-2 MC",
            found=f"{type(cause).__name__}: {cause}"[:300],
        ) from cause


def _without_comment(match: re.Match[str]) -> str:
    return match[0] if match[0].startswith('"') else " "


def _parse(text: str, where: str) -> _Block:
    root = _Block("", [], [])
    open_blocks, tokens = [root], iter(TOKEN.findall(text))
    for token in tokens:
        if token == "/begin":
            block = _Block(next(tokens, ""), [], [])
            open_blocks[-1].blocks.append(block)
            open_blocks.append(block)
            if len(open_blocks) > DEEPEST:
                raise _unbalanced(where)
        elif token == "/end":
            if next(tokens, "") != open_blocks.pop().kind or not open_blocks:
                raise _unbalanced(where)
        else:
            open_blocks[-1].words.append(token)
    if len(open_blocks) != 1:
        raise _unbalanced(where)
    return root


def _unbalanced(where: str) -> InputError:
    return InputError(
        "this is no whole A2L file", where=where, expected="/begin and /end of each block, in pairs"
    )


def _described(root: _Block, where: str) -> A2l:
    common = next(root.all("MOD_COMMON"), None)
    order = (common.after("BYTE_ORDER") if common else None) or "MSB_LAST"
    methods = {block.words[0]: block for block in root.all("COMPU_METHOD")}
    found = {
        block.words[0]: _measurement(block, methods, order, where)
        for block in root.all("MEASUREMENT")
        if block.after("ECU_ADDRESS") is not None
    }
    if not found:
        raise InputError(
            "the A2L file has no measurement with an address",
            where=where,
            expected="/begin MEASUREMENT with ECU_ADDRESS",
            remedy="give the A2L file of this ECU",
        )
    can = next(root.all("XCP_ON_CAN"), None)
    numbers = [can.after(each) if can else None for each in ("CAN_ID_MASTER", "CAN_ID_SLAVE")]
    highest = EXTENDED | 0x1FFF_FFFF
    command, response = (None if each is None else _number(each, 0, highest) for each in numbers)
    return A2l(where, found, command, response)


def _measurement(
    block: _Block, methods: dict[str, _Block], default_order: str, where: str
) -> XcpMeasurement:
    """Measurement of a block: name, text, type, conversion, resolution, accuracy, limits, options."""
    name, kind, method = block.words[0], block.words[2], block.words[3]
    place = f"{where}: {name}"
    order = block.after("BYTE_ORDER", default_order, 8) or default_order
    if kind not in TYPES:
        raise InputError("unknown type", where=place, expected=", ".join(TYPES), found=kind)
    if order not in ORDERS:
        raise InputError(
            "the byte order is not certain",
            where=place,
            expected=" or ".join(ORDERS),
            found=order,
            remedy="BIG_ENDIAN and LITTLE_ENDIAN were used in both senses: write MSB_FIRST or MSB_LAST",
        )
    scale, offset, unit = _conversion(methods.get(method), method, place)
    mask = block.after("BIT_MASK", None, 8)
    return XcpMeasurement(
        name,
        _number(block.after("ECU_ADDRESS", "0", 8), 0, 0xFFFF_FFFF),
        _number(block.after("ECU_ADDRESS_EXTENSION", "0", 8), 0, 0xFF),
        ORDERS[order] + TYPES[kind],
        scale,
        offset,
        (block.after("PHYS_UNIT", None, 8) or unit).strip('"'),
        None if mask is None or TYPES[kind] in "efd" else _number(mask, 1, (1 << 64) - 1),
    )


def _number(text: str | None, low: int, high: int) -> int:
    """Integer of a text. Raises ValueError where it is none, or not in low to high."""
    number = int(text or "", 0)
    if not low <= number <= high:
        raise ValueError(f"{number:#x} is not in {low:#x} to {high:#x}")
    return number


def _conversion(method: _Block | None, name: str, where: str) -> tuple[float, float, str]:
    """Scale, offset and unit of a conversion. Raises InputError where it is not linear."""
    if method is None:
        if name == "NO_COMPU_METHOD":
            return 1.0, 0.0, ""
        raise InputError("the conversion is not in the file", where=where, found=name)
    kind, unit = method.words[2], method.words[4]
    if kind == "IDENTICAL" or kind.startswith("TAB_"):  # a table gives names, not numbers
        return 1.0, 0.0, unit
    if kind == "LINEAR":
        scale, offset = _numbers(method, "COEFFS_LINEAR", 2)
        return scale, offset, unit
    if kind == "RAT_FUNC":  # raw = (a x^2 + b x + c) / (d x^2 + e x + f), x: physical
        a, b, c, d, e, f = _numbers(method, "COEFFS", 6)
        if a == d == e == 0.0 and b != 0.0:
            return f / b, -c / b, unit
    raise InputError(
        "the conversion is not linear",
        where=where,
        expected="IDENTICAL, LINEAR, a linear RAT_FUNC, or a table of names",
        found=f"{name}: {kind}",
        remedy="read the raw value, or convert it elsewhere",
    )


def _numbers(method: _Block, keyword: str, count: int) -> Sequence[float]:
    place = method.words.index(keyword)
    numbers = [float(word) for word in method.words[place + 1 : place + 1 + count]]
    if len(numbers) != count:
        raise ValueError(f"{keyword} of {method.words[0]} has {len(numbers)} numbers")
    return numbers
