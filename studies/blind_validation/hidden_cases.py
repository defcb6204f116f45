"""Ground truth of the hidden cases, stored with its fingerprint before the first analysis.

answers.sealed   ground truth, compressed so that it is not read by accident
answers.sha256   SHA-256 of the uncompressed ground truth, written first
"""

import base64
import hashlib
import json
import os
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from slipbench.protocol.errors import InputError

GROUND_TRUTH, FINGERPRINT = "answers.sealed", "answers.sha256"


def store_ground_truth(answers: Sequence[dict[str, Any]], folder: Path) -> str:
    """Fingerprint (SHA-256) of the ground truth, stored in a folder.

    Raises InputError where the folder contains the ground truth of another study.
    """
    plain = json.dumps(list(answers), sort_keys=True).encode()
    found = hashlib.sha256(plain).hexdigest()
    path = folder / FINGERPRINT
    if path.exists() and path.read_text(encoding="ascii").strip() != found:
        raise InputError(
            "the folder contains the ground truth of another study",
            where=str(path),
            expected=found,
            found=path.read_text(encoding="ascii").strip(),
            remedy="choose another folder with --out, or use the same --cases and --seed",
        )
    write_whole(path, found + "\n")
    write_whole(folder / GROUND_TRUTH, base64.b85encode(zlib.compress(plain, 9)).decode() + "\n")
    return found


def ground_truth(folder: Path) -> list[dict[str, Any]]:
    """Ground truth of a study. Raises InputError where it is missing or was changed."""
    try:
        plain = zlib.decompress(
            base64.b85decode((folder / GROUND_TRUTH).read_text("ascii").strip())
        )
        expected = (folder / FINGERPRINT).read_text("ascii").strip()
    except (OSError, ValueError, zlib.error) as fault:
        raise InputError(
            "ground truth not found or not readable", where=str(folder), found=str(fault)
        ) from fault
    found = hashlib.sha256(plain).hexdigest()
    if found != expected:
        raise InputError(
            "the ground truth was changed after it was stored: its fingerprint differs",
            where=str(folder),
            expected=expected,
            found=found,
            remedy="run the study again in another folder",
        )
    answers: list[dict[str, Any]] = json.loads(plain)
    return answers


def write_whole(path: Path, text: str) -> None:
    """Write a file atomically."""
    draft = path.with_name(path.name + ".part")
    with draft.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    draft.replace(path)
