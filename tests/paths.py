"""Where the project's own files lie, for tests."""

from pathlib import Path

from slipbench.examples import CONTROLLERS, MODELS, ROLES, TRIALS
from slipbench.plant.vehicles import DEMONSTRATION

__all__ = ["CONTROLLERS", "DEMONSTRATION", "MODELS", "ROLES", "ROOT", "TRIALS", "with_full_paths"]

ROOT = Path(__file__).parents[1]


def with_full_paths(trial: str) -> str:
    """Return the text of an example trial, its relative paths made absolute."""
    return trial.replace('"../', f'"{TRIALS.parent}/')
