"""Input errors have one form: what, where, expected, found, remedy."""


class InputError(Exception):
    """An input that slipbench cannot use and that the user can correct.

    Every command prints the message alone and exits with status 2; nothing else is caught.
    """

    def __init__(
        self, what: str, *, where: str = "", expected: str = "", found: str = "", remedy: str = ""
    ) -> None:
        """Compose the message from its parts; empty parts are omitted."""
        self.what, self.where, self.expected = what, where, expected
        self.found, self.remedy = found, remedy
        super().__init__(self._message())

    def _message(self) -> str:
        head = f"{self.where}: {self.what}" if self.where else self.what
        parts = [("expected", self.expected), ("found", self.found), ("remedy", self.remedy)]
        lines = [f"\n  {name}: {readable(text, 500)}" for name, text in parts if text]
        return readable(head, 2000) + "".join(lines)


def readable(text: str, longest: int) -> str:
    """Text for a terminal: control characters escaped, and at most `longest` characters of it."""
    shown = "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in text[:longest])
    return shown if len(text) <= longest else f"{shown}... ({len(text):,} characters)"


def is_interrupt(fault: BaseException | None) -> bool:
    """Whether an exception is Ctrl-C, itself or as a cause.

    Ctrl-C at a call into compiled code arrives as the cause of a SystemError, which may be the
    cause of another one.
    """
    while fault is not None and not isinstance(fault, KeyboardInterrupt):
        fault = fault.__cause__
    return fault is not None
