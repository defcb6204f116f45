"""Answers are drawn and sealed before anything is analysed: their SHA-256 lies open beside them.

answers.sealed   the answers, packed so that nobody reads them by accident
answers.sha256   fingerprint of the unpacked answers, written first
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

SEALED, FINGERPRINT = "answers.sealed", "answers.sha256"


def seal(answers: Sequence[dict[str, Any]], folder: Path) -> str:
    """Seal answers into a folder; where the same ones are sealed already, nothing changes.

    Returns their fingerprint. Raises InputError where other answers lie there.
    """
    plain = json.dumps(list(answers), sort_keys=True).encode()
    found = hashlib.sha256(plain).hexdigest()
    place = folder / FINGERPRINT
    if place.exists() and place.read_text(encoding="ascii").strip() != found:
        raise InputError(
            "another study lies there, with other answers",
            where=str(place),
            expected=found,
            found=place.read_text(encoding="ascii").strip(),
            remedy="give another folder with --out, or the same --cases and --seed",
        )
    write_whole(place, found + "\n")
    write_whole(folder / SEALED, base64.b85encode(zlib.compress(plain, 9)).decode() + "\n")
    return found


def unseal(folder: Path) -> list[dict[str, Any]]:
    """Return the answers. Raises InputError where they are not those that were sealed."""
    try:
        plain = zlib.decompress(base64.b85decode((folder / SEALED).read_text("ascii").strip()))
        told = (folder / FINGERPRINT).read_text("ascii").strip()
    except (OSError, ValueError, zlib.error) as fault:
        raise InputError("no sealed answers", where=str(folder), found=str(fault)) from fault
    found = hashlib.sha256(plain).hexdigest()
    if found != told:
        raise InputError(
            "the seal is broken: these are not the answers that were sealed",
            where=str(folder),
            expected=told,
            found=found,
            remedy="run the study again in another folder",
        )
    answers: list[dict[str, Any]] = json.loads(plain)
    return answers


def write_whole(path: Path, text: str) -> None:
    """Write a file whole or not at all."""
    draft = path.with_name(path.name + ".part")
    with draft.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    draft.replace(path)
