"""Road of the virtual motorcycle: segments with other tyre grip or other rear load."""

from collections.abc import Sequence

from slipbench.protocol.trial_file import Stretch


class Road:
    """Segments of the road by distance, m from the button; factors of overlapping ones multiply."""

    def __init__(self, segments: Sequence[Stretch]) -> None:
        """Store the segments of the whole road."""
        self._segments = tuple(segments)

    def factors(self, distance: float) -> tuple[float, float]:
        """Factors of grip and of rear load, 1, at a distance, m from the button."""
        grip = load = 1.0
        for segment in self._segments:
            if segment.start <= distance < segment.end:
                grip *= segment.factor if segment.of == "grip" else 1.0
                load *= segment.factor if segment.of == "load" else 1.0
        return grip, load
