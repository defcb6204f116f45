"""Residual and effect responses of a fit with the nuisances projected out, for score tests."""

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
"""By output group and record: (T, m), in any precision; empty where nothing changes."""


@dataclass(frozen=True, eq=False)
class Linearization:
    """Linearization of a fit, computed once for all score tests.

    residuals: residuals and prior terms with the nuisances projected out (see
    `Nuisances.project_out`). clusters: time segment of each of its rows.
    """

    fit: Fit
    nuisances: Nuisances
    residuals: Floats
    clusters: Integers
    runs: Runs = field(default_factory=dict)

    @classmethod
    def of(cls, fit: Fit) -> "Linearization":
        """Linearize a fit; the parameters of its effects are nuisances as well."""
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
        """Predicted outputs, simulated with the coarse steps of the effect responses.

        (T, m) by output group and record, in the unit of each output.
        """
        return predict(self.fit.model.coarse, self.fit.point, runs=self.runs)

    def effect_response(self, candidate: Candidate) -> Floats:
        """Whitened change of all outputs by a candidate, shape (rows,).

        Zeros where it cannot be run.
        """
        return self.effect_responses([candidate])[:, 0]

    def effect_responses(self, candidates: Sequence[Candidate | Effect]) -> Floats:
        """Return the whitened responses of several candidates, shape (rows, candidates)."""
        return self.whitened(self.changes(candidates))

    def changes(self, candidates: Sequence[Candidate | Effect]) -> list[Series]:
        """Return the change of all outputs by each candidate, (T, m); empty if none."""
        base = self.coarse  # computed before the threads start, which share it
        return in_threads(lambda one: self._change(one, base), candidates)

    def whitened(self, changes: Sequence[Changes]) -> Floats:
        """Return changes, of this or another fit of the same records, as responses.

        changes: (T, m) by output group and record, each; gives shape (rows, k).
        """
        model = self.fit.model
        stacked = [[np.zeros((*m.shape, len(changes))) for m in ms] for ms in model.measured]
        for i, of_one in enumerate(changes):
            for target, changed in zip(stacked, of_one, strict=True):
                for r, one in enumerate(changed):
                    if one.size:
                        target[r][:, :, i] = one
        return np.nan_to_num(
            whiten_and_stack(model, self.fit.noise, stacked), posinf=0.0, neginf=0.0
        )

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
        """Energy of projected responses, and their correlation with the residual, (k,) each.

        The nuisances are projected out. rows: mask of the rows used, (rows,); the others count as
        zero. Default: all.
        """
        residual, nuisances = self.residuals[: len(columns)], self.nuisances.columns
        if rows is not None:
            columns, residual, nuisances = columns[rows], residual[rows], nuisances[rows]
        products = nuisances.T @ columns
        total = np.einsum("ij,ij->j", columns, columns)
        energy = total - np.einsum("ij,ij->j", products, self.nuisances.solve(products))
        return energy, columns.T @ residual
