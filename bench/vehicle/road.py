"""The road that the virtual motorcycle meets: stretches with less grip, or that carry less load."""

from collections.abc import Sequence

from slipbench.protocol.trial_file import Stretch


class Road:
    """Stretches by their place, m from the button; where several lie, their factors multiply."""

    def __init__(self, stretches: Sequence[Stretch]) -> None:
        """Know the whole road."""
        self._stretches = tuple(stretches)

    def factors(self, place: float) -> tuple[float, float]:
        """Return the factors of grip and of rear load at a place, m."""
        grip = load = 1.0
        for stretch in self._stretches:
            if stretch.start <= place < stretch.end:
                grip *= stretch.factor if stretch.of == "grip" else 1.0
                load *= stretch.factor if stretch.of == "load" else 1.0
        return grip, load
