"""What a fit leaves, made ready to be judged: signatures off the nuisances, and how they push."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.sensitivity import change, coordinates_of
from slipbench.identification.mismatch.fit.stack import Integers, Nuisances, whiten_and_stack
from slipbench.identification.mismatch.simulation.model import Runs, Series, predict
from slipbench.identification.mismatch.simulation.once import once
from slipbench.identification.mismatch.simulation.threads import in_threads
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

Changes = Sequence[Sequence[npt.NDArray[np.floating[Any]]]]
"""By block and record: (T, m), in any precision; empty where nothing changes."""


@dataclass(frozen=True, eq=False)
class Linearization:
    """Everything that scoring needs, made once for a fit.

    residuals: what the nuisances leave of residuals and beliefs (see `Nuisances.off`), and clusters: the
    stretch of time of each of its rows.
    """

    fit: Fit
    nuisances: Nuisances
    residuals: Floats
    clusters: Integers
    runs: Runs = field(default_factory=dict)

    @classmethod
    def of(cls, fit: Fit) -> "Linearization":
        """Prepare to judge what a fit leaves; the dials of its effects may vary as well."""
        nuisances, z = fit.nuisances, coordinates_of(fit.point)
        if fit.candidates:
            nuisances = Nuisances(np.concatenate((nuisances.columns, fit.effect_columns), axis=1))
            z = np.concatenate((z, np.zeros(fit.effect_columns.shape[1])))
        return cls(
            fit,
            nuisances,
            nuisances.projected_residuals(fit.whitened_residuals, z),
            nuisances.clustered(fit.clusters),
        )

    @once
    def coarse(self) -> Series:
        """What sensors would show, simulated with the coarse steps of the signatures."""
        return predict(self.fit.model.coarse, self.fit.point, runs=self.runs)

    def effect_response(self, candidate: Candidate) -> Floats:
        """Whitened change of all outputs that a candidate brings; zeros where it cannot be run."""
        return self.effect_responses([candidate])[:, 0]

    def effect_responses(self, tried: Sequence[Candidate | Effect]) -> Floats:
        """Return the signatures of several candidates side by side, (rows, candidates)."""
        return self.whitened(self.changes(tried))

    def changes(self, tried: Sequence[Candidate | Effect]) -> list[Series]:
        """Return what each of several candidates changes in all outputs; empty where nothing."""
        base = self.coarse  # made before the threads, which share it
        return in_threads(lambda one: self._change(one, base), tried)

    def whitened(self, changes: Sequence[Changes]) -> Floats:
        """Return changes, of this fit or of another beside the same records, as signatures here."""
        model = self.fit.model
        found = [[np.zeros((*m.shape, len(changes))) for m in ms] for ms in model.measured]
        for i, of_one in enumerate(changes):
            for into, changed in zip(found, of_one, strict=True):
                for r, one in enumerate(changed):
                    if one.size:
                        into[r][:, :, i] = one
        return np.nan_to_num(whiten_and_stack(model, self.fit.noise, found), posinf=0.0, neginf=0.0)

    def _change(self, one: Candidate | Effect, base: Series) -> Series:
        fit = self.fit
        try:
            effect = one.effect() if isinstance(one, Candidate) else one
            others = (e for e in fit.point.effects if e.key != effect.key)
            effects = (*others, effect)
            return change(fit.model.coarse, fit.point, effects, base, self.runs)
        except PlantError:
            return [[np.empty(0)] * len(fit.model.records) for _ in fit.model.partition.groups]

    def energy_and_correlation(
        self, columns: Floats, rows: npt.NDArray[np.bool_] | None = None
    ) -> tuple[Floats, Floats]:
        """Energy of signatures off the nuisances and what is left on them, (k,) each.

        rows: where they count, (rows,); elsewhere they are taken as zero. Default: everywhere.
        """
        left, nuisances = self.residuals[: len(columns)], self.nuisances.columns
        if rows is not None:
            columns, left, nuisances = columns[rows], left[rows], nuisances[rows]
        inside = nuisances.T @ columns
        whole = np.einsum("ij,ij->j", columns, columns)
        energy = whole - np.einsum("ij,ij->j", inside, self.nuisances.solve(inside))
        return energy, columns.T @ left
