"""Errors that a user can correct, in one form: what, where, expected, found, remedy."""


class InputError(Exception):
    """An input cannot be used, and the user can correct it.

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
        return head + "".join(f"\n  {name}: {text}" for name, text in parts if text)
