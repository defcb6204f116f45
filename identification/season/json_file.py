"""JSON files of results: read within limits, with faults that name the file and the key."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from slipbench.protocol.errors import InputError
from slipbench.protocol.user_file import read_user_file

LARGEST = 200_000_000  # bytes; an identification with all its responses has 1 MB


def read_json(path: Path) -> dict[str, Any]:
    """Content of a JSON file. Raises InputError where it cannot be read or is no object."""
    try:
        found = json.loads(read_user_file(path, LARGEST))
    except (ValueError, RecursionError) as cause:
        raise InputError("this is no JSON", where=str(path), found=str(cause)) from cause
    if not isinstance(found, dict):
        raise InputError("this is no result of slipbench", where=str(path), expected="an object")
    return found


def text_at(tree: Mapping[str, Any], key: str) -> str:
    """Text at a key; "" where there is none."""
    found = tree.get(key)
    return found if isinstance(found, str) else ""


def number(value: object) -> float | None:
    """A finite number; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if math.isfinite(value) else None
