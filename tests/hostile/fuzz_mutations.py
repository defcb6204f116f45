"""Hostile values, damaged files and hostile paths, each drawn from a seeded generator."""

import os
import re
import tomllib
from collections.abc import Callable, Iterator
from copy import deepcopy
from datetime import date
from pathlib import Path
from random import Random
from typing import Any

import tomli_w

from tests.hostile.damage import NASTY

SPARSE = 3 << 30  # bytes of a file that no memory limit of a case holds


class Raw(str):
    """Text that stands in a TOML file as it is, without quotes."""

    __slots__ = ()


NUMBERS = [-1, 0, 1, 2**31, 2**63 - 1, -(2**63), 1e300, -1e300, 1e-300, 5e-324, 100, 0.5]
NOT_NUMBERS = [float("nan"), float("inf"), float("-inf"), Raw("1e999"), Raw("9" * 5000)]
NESTED = [
    Raw("[" * 3000 + "]" * 3000),
    Raw("{a=" * 300 + "1" + "}" * 300),
    Raw("[" * 90 + "]" * 90),
]
TYPES = [True, "", [], [1], [[], {}], {}, {"a": 1}, date(1970, 1, 1), ["x"] * 1000]
TEXTS = [
    "x",
    "\0",
    "a\0b",
    "x" * 300,
    "x" * 100_000,
    "é\u202e\ud7ff",
    "../../x",
    "/dev/zero",
    ".",
    "%s%n{0}{x}",
    "a b",
    "[red]x[/blue]",
    "<script>",
    "nan",
]
QUANTITIES = ["1 us", "0 s", "-1 s", "1e300 s", "1 furlong", "9**9**9 s", "inf s", "1 rpm", "2 % %"]
EQUATIONS = [
    "1" * 310,
    "+".join(["1"] * 450),
    "-" * 900 + "1",
    "1/0",
    "sqrt(-1)",
    "exp(exp(exp(9)))",
    "(" * 200 + "1" + ")" * 200,
    "9**9**9",
    "__import__('os')",
    "x if x else",
    "1e999",
    "0x10",
    "1j",
    "lambda: 0",
]
FACTORS = [0, -1, 1e-9, 1e-3, 0.5, 2, 100, 1e9, 1e300]


def hostile_value(rng: Random, value: object = None) -> Any:
    """Return a value to put in the place of `value`; half of them are of its own kind."""
    near = _near(rng, value)
    if near is not None and rng.random() < 0.5:
        return near
    pool = rng.choice([NUMBERS, NOT_NUMBERS, NESTED, TYPES, TEXTS, QUANTITIES, EQUATIONS])
    return deepcopy(rng.choice(pool))  # the pools stay as they are, whatever changes the file next


def _near(rng: Random, value: object) -> object:
    match value:
        case bool():
            return not value
        case int() | float():
            return value * rng.choice(FACTORS)
        case str() if found := re.match(r"[-+.\deE]+", value):
            try:
                number = float(found[0]) * rng.choice(FACTORS)
            except ValueError:
                return None
            return f"{number!r}{value[found.end() :]}"
        case str():
            return rng.choice([value[::-1], value * 2, value + " ", value.upper(), value[:-1]])
        case list():
            return rng.choice([value * 2, value[:-1], value[::-1], value * 200])
        case dict():
            return dict(list(value.items())[:-1])
    return None


# Files


def damaged_file(rng: Random, data: bytes, toml: bool) -> bytes:
    """Return the bytes of a file after one mutation: by key or value, by word, or by bytes."""
    ways: list[Callable[[Random, bytes], bytes]] = [_by_bytes, _by_words]
    if toml:
        ways += [_by_keys] * 6
    elif b"\0" not in data:
        ways += [_by_words] * 3
    return rng.choice(ways)(rng, data)


def _by_bytes(rng: Random, data: bytes) -> bytes:
    text = bytearray(data)
    for _ in range(rng.randint(1, 5)):
        at, length = rng.randrange(len(text) + 1), rng.randint(0, 40)
        match rng.randrange(6):
            case 0 if at < len(text):
                text[at] ^= 1 << rng.randrange(8)
            case 1:
                del text[at : at + length]
            case 2 if rng.random() < 0.3:
                del text[at:]
            case 3:
                text[at:at] = rng.choice(NASTY)
            case 4:
                text[at:at] = text[at : at + length] * rng.randint(1, 20)
            case _:
                text[at : at + length] = rng.randbytes(length)
    return bytes(text)


def _by_words(rng: Random, data: bytes) -> bytes:
    lines = data.split(b"\n")
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(lines))
        match rng.randrange(5):
            case 0:
                del lines[at : at + rng.choice([1, len(lines)])]
                lines = lines or [b""]
            case 1:
                lines[at:at] = [lines[at]] * rng.choice([1, 3, 100])
            case 2:
                rng.shuffle(lines)
            case _:
                lines[at] = _word_replaced(rng, lines[at])
    return b"\n".join(lines)


def _word_replaced(rng: Random, line: bytes) -> bytes:
    words = list(re.finditer(rb"[\w.+-]+", line))
    if not words:
        return rng.choice(NASTY)
    word = rng.choice(words)
    new = rng.choice([*NUMBERS, *NOT_NUMBERS, *TEXTS, "9" * 200_000])
    return line[: word.start()] + str(new).encode("utf-8", "replace") + line[word.end() :]


def _by_keys(rng: Random, data: bytes) -> bytes:
    tree = tomllib.loads(data.decode())
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        _change_one(rng, tree)
    return _written(tree).encode()


def _change_one(rng: Random, tree: dict[str, Any]) -> None:
    places = list(_places(tree))
    if not places:
        return
    parent, key = rng.choice(places)
    match rng.randrange(10):
        case 0:
            del parent[key]
        case 1 if isinstance(parent, dict):
            parent[rng.choice(["x", "value", "name", "", "a\0b", "k" * 300])] = deepcopy(
                parent[key]
            )
        case 2 if isinstance(parent, list):
            parent.insert(rng.randrange(len(parent) + 1), deepcopy(parent[key]))
        case 3:
            other, at = rng.choice(places)
            parent[key] = other[at] if not isinstance(other[at], dict | list) else 1
        case _:
            parent[key] = hostile_value(rng, parent[key])


def _places(tree: Any) -> Iterator[tuple[Any, Any]]:
    keys = list(tree) if isinstance(tree, dict) else range(len(tree))
    for key in keys:
        yield tree, key
        if isinstance(tree[key], dict | list):
            yield from _places(tree[key])


def _written(tree: dict[str, Any]) -> str:
    raw: dict[str, str] = {}

    def marked(value: Any) -> Any:
        if isinstance(value, Raw) or (isinstance(value, int) and abs(value) >= 2**63):
            raw[mark := f"raw-{len(raw)}-raw"] = str(value)
            return mark
        if isinstance(value, dict):
            return {key: marked(inner) for key, inner in value.items()}
        return [marked(inner) for inner in value] if isinstance(value, list) else value

    text = tomli_w.dumps(marked(tree))
    for mark, written in raw.items():
        text = text.replace(f'"{mark}"', written)
    return text


# Paths


def hostile_input(rng: Random, folder: Path, name: str) -> str:
    """Return a path in the place of `name` that should be read: not a file that can be used."""
    suffix = Path(name).suffix
    match rng.randrange(14):
        case 0:
            os.mkfifo(folder / f"fifo{suffix}")
            return f"fifo{suffix}"
        case 1:
            (folder / f"folder{suffix}").mkdir()
            return f"folder{suffix}"
        case 2:
            (folder / f"loop{suffix}").symlink_to(f"loop{suffix}")
            return f"loop{suffix}"
        case 3:
            (folder / f"empty{suffix}").touch()
            return f"empty{suffix}"
        case 4:
            with (folder / f"sparse{suffix}").open("wb") as file:
                file.truncate(SPARSE)
            return f"sparse{suffix}"
        case 5:
            (folder / f"secret{suffix}").touch(mode=0)
            return f"secret{suffix}"
    return rng.choice(
        [
            "/dev/zero",
            "/dev/full",
            "/proc/self/mem",
            "/usr",
            f"missing{suffix}",
            "x" * 300 + suffix,
            "",
            f"{name}/x",
            os.fsdecode(b"\xff\xfe") + suffix,
        ]
    )


def hostile_output(rng: Random, folder: Path, name: str) -> str:
    """Return a path in the place of `name` that should be written; always below `folder`.

    No FIFO: to wait for its reader is what a writer should do.
    """
    suffix = Path(name).suffix
    (folder / "there").write_bytes(b"kept")
    match rng.randrange(10):
        case 0:
            (folder / f"full{suffix}").mkdir()
            (folder / f"full{suffix}" / "kept").write_bytes(b"kept")
            return f"full{suffix}"
        case 1:
            (folder / f"loop_out{suffix}").symlink_to(f"loop_out{suffix}")
            return f"loop_out{suffix}{rng.choice(['', '/x'])}"
    return rng.choice(
        [
            "there",
            f"there/x{suffix}",
            "x" * 300 + suffix,
            f"a/b/c/out{suffix}",
            "",
            ".",
            f"{name}.nonsense",
            f"out put{suffix}",
            os.fsdecode(b"out\xff") + suffix,
        ]
    )
