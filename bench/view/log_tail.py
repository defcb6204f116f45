"""New lines of a file that another process appends to; a reader that falls behind may skip ahead."""

from pathlib import Path


class LogTail:
    """Reader of a growing file of lines. It never waits, and it never touches the writer."""

    def __init__(self, path: Path, most: int = 1_000_000, lag: float = 0) -> None:
        """Begin at the start of the file, which need not exist yet.

        most  bytes that one call reads
        lag   bytes beyond them that may wait for the next calls; of more, the oldest are skipped
        """
        self._path, self._most, self._lag = path, most, lag
        self._done, self._torn = 0, b""
        self.skipped = 0

    @property
    def behind(self) -> int:
        """Bytes that were appended and not read."""
        return self._path.stat().st_size - self._done if self._path.exists() else 0

    def read(self) -> bytes:
        """Whole lines that were appended since the last call; bytes before them may be skipped."""
        if not self._path.exists():
            return b""
        with self._path.open("rb") as file:
            if self._skip(self._path.stat().st_size):
                file.seek(self._done - 1)
                self._done += len(file.readline()) - 1  # end of a line whose start was skipped
            file.seek(self._done)
            text = file.read(self._most)
        self._done += len(text)
        lines, _, self._torn = (self._torn + text).rpartition(b"\n")
        return lines + b"\n" if lines else b""

    def _skip(self, size: int) -> bool:
        """Skip what is more than one read behind; whether something was."""
        behind = size - self._done - self._most
        if behind <= self._lag:
            return False
        self._done += behind
        self._torn = b""
        self.skipped += behind
        return True
