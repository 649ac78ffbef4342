"""What the paper's statements are about: its numbers, our grid, the machines of Table 5."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np

from pkm_gym.core.composite import Composite
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reference import Reference
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.atlas import NAMES, printed_composite, space_grid
from pkm_gym.mechanisms.pss5_upu.declared import WEIGHTS
from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu


@dataclass(frozen=True)
class Facts:
    """What the statements are about.

    Attributes:
        reference: what the paper prints.
        printed: the composite of its correlation matrix.
        evaluation: of our grid of designs.
        rows: the machines of Table 5, each with the default task's box.
        true: that of its first row with the yaw of a UPU limb.
    """

    reference: Reference
    printed: Composite
    evaluation: Evaluation
    rows: tuple[Pss5Upu, ...]
    true: Pss5Upu

    @classmethod
    def of(cls, problem: DesignProblem) -> Self:
        """Measure a problem, ``pss5_upu`` with its default task and options."""
        return cls(
            reference=problem.reference,
            printed=printed_composite(problem.reference),
            evaluation=problem.evaluate(space_grid()),
            rows=tuple(table_5(problem)),
            true=type(problem)(yaw="upu").mechanism(problem.printed_design()),  # type: ignore[arg-type]
        )

    @property
    def table_5(self) -> FloatArray:
        """The printed indices (3, 4)."""
        return np.array(self.reference.data["table5"]["indices"])


def table_5(problem: DesignProblem) -> Iterator[Pss5Upu]:
    """Yield the machines of the rows of Table 5."""
    for r, R, L, theta in problem.reference.data["table5"]["dimensions"]:
        n = (r + R + L) / 3.0
        asked = type(problem)(free="all", task={"n": n})
        lam0 = problem.reference.design["lam0"]
        machine = asked.mechanism(
            asked.design({"n2": R / n, "n3": L / n, "theta": theta, "lam0": lam0})
        )
        assert isinstance(machine, Pss5Upu)
        yield machine


def composite_map(machine: Pss5Upu, pose: FloatArray) -> FloatArray:
    """Return F (...) of poses (..., 5), with the printed weights, of raw indices."""
    local = machine.local_indices(pose)
    return np.asarray(sum(w * local[name] for w, name in zip(WEIGHTS, NAMES, strict=True)))


def level(machine: Pss5Upu, count: int = 40) -> FloatArray:
    """Return level poses (count, count, 5) at home height over the box, none at its centre."""
    return machine.workspace_grid(count, count)
