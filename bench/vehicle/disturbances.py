"""Disturbances of the virtual motorcycle: wind force and cycle-to-cycle variation of combustion."""

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class DisturbanceLevels:
    """Levels of the disturbances; all are zero on a test stand.

    wind         N, standard deviation of the force along the road
    wind_time    s, correlation time of the gusts
    combustion   N m, standard deviation of the torque, white at 1 kHz: 2 % of the 40 N m that hold
                 14 000 rpm, the cycle-to-cycle variation of indicated work of a healthy engine
                 (Heywood, Internal Combustion Engine Fundamentals, section 9.4)
    """

    wind: float = 12.0
    wind_time: float = 3.0
    combustion: float = 0.8


ON_THE_ROAD = DisturbanceLevels()


class Disturbances:
    """Disturbances of a trial, drawn every millisecond from a seeded random generator."""

    def __init__(self, disturbances: DisturbanceLevels, seed: int) -> None:
        """Draw the initial wind force from its stationary distribution."""
        self._roughness = disturbances
        self._random = np.random.default_rng(seed)
        self._wind = float(self._random.normal(0.0, disturbances.wind))

    def draw(self, step: float) -> tuple[float, float]:
        """Force along the road (N) and engine torque (N m) for the next `step` (s)."""
        keep = math.exp(-step / self._roughness.wind_time)
        gust = self._roughness.wind * math.sqrt(1.0 - keep * keep)
        self._wind = keep * self._wind + gust * float(self._random.standard_normal())
        return self._wind, self._roughness.combustion * float(self._random.standard_normal())
