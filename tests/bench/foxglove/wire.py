"""A server without clients, for tests of what is sent and when."""


class Wire:
    """Stands for the server. It does not imitate clients: it keeps what is sent."""

    def __init__(self, wanted=None):
        self.schemas, self.sent, self.times, self.cleared = {}, [], [], 0
        self.warnings = []
        self._wanted = wanted

    def advertise(self, schemas):
        self.schemas = dict(schemas)

    def wanted(self):
        return set(self.schemas) if self._wanted is None else self._wanted

    def send(self, topic, time_ns, data):
        self.sent.append((time_ns, topic, data))

    def set_time(self, time_ns):
        self.times.append(time_ns)

    def clear(self):
        self.cleared += 1

    def warn(self, text):
        self.warnings.append(text)

    def withdraw(self, text):
        self.warnings.remove(text)
