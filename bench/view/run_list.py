"""The runs of a session, or the one run of a trial, and which of them is recorded now."""

from pathlib import Path
from typing import Any

from slipbench.bench.view.outcome_file import EndOfRun
from slipbench.protocol.recording.run_folder import DESCRIPTION, FRAMES

RUNS = "runs"


class RunList:
    """Run folders below a folder, which need not exist yet."""

    def __init__(self, root: Path) -> None:
        """Watch `root`: the folder of a session, or a run folder."""
        self._root = root
        self._ends: dict[Path, EndOfRun] = {}

    def folders(self) -> list[Path]:
        """Run folders that are described, the oldest recording first."""
        inside = self._root / RUNS
        found = sorted(inside.iterdir()) if inside.is_dir() else [self._root]
        return sorted((each for each in found if (each / DESCRIPTION).exists()), key=_recorded_at)

    def current(self) -> Path | None:
        """Run folder whose frames are the newest; None before the first."""
        folders = self.folders()
        return folders[-1] if folders else None

    def rows(self) -> list[dict[str, Any]]:
        """One row for each run: its name, whether it ended, its verdict with the reason."""
        return [self._row(folder) for folder in self.folders()]

    def _row(self, folder: Path) -> dict[str, Any]:
        end = self._ends.setdefault(folder, EndOfRun(folder))
        end.read()
        return {
            "name": folder.name,
            "state": end.look.get("verdict") or end.outcome.get("phase", "no end"),
            "reason": end.look.get("reason") or end.outcome.get("detail", ""),
        }


def _recorded_at(folder: Path) -> int:
    """Time of the last frame that was written, or of the description, ns since 1970."""
    for name in (FRAMES, DESCRIPTION):
        try:
            return (folder / name).stat().st_mtime_ns
        except OSError:
            continue
    return 0
