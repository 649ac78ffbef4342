"""What several of the figures show: our atlas, the designs that matter, two layouts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import make_problem
from pkm_gym.mechanisms.pss5_upu.atlas import NAMES, to_plane
from pkm_gym.mechanisms.pss5_upu.declared import LEAST_SHARE
from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from pkm_gym.core.problem import DesignProblem

WIDTH = 7.2  # inches, a page's two columns
WIDE = 10.0
COLORS = dict(zip(NAMES, ("#0072b2", "#e69f00", "#009e73", "#d55e00"), strict=True))
COLUMNS, ROWS = 60, 90  # of the maps over X and Y
X_LABEL, Y_LABEL = r"$X = (2 n_2 + n_3)/\sqrt{3}$", "$Y = n_3$"

# A layout of ours that works, rounded to mm and deg, with n = 0.5 m; see ``pss5_upu_skew``.
BEST = {
    "n2": 1.266, "n3": 1.018, "theta": np.radians(56.2), "lam0": 0.97,
    "a2": np.radians(5.0), "a3": np.radians(26.0), "b2": np.radians(42.0), "b3": np.radians(-10.0),
}  # fmt: skip


@dataclass(frozen=True)
class Space:
    """What the default problem says of designs over the space model.

    Attributes:
        X: array (rows, columns).
        Y: array (rows, columns).
        evaluation: of the rows x columns designs, row by row.
    """

    X: FloatArray
    Y: FloatArray
    evaluation: Evaluation

    def index(self, name: str) -> FloatArray:
        """Return an index (rows, columns), NaN where a pose of the box is out of reach."""
        return self.evaluation.indices[name].reshape(self.X.shape)

    def violation(self) -> FloatArray:
        """Return the worst constraint (rows, columns), NaN where a pose is out of reach."""
        worst = np.where(
            self.evaluation.unreached > 0.0, np.nan, self.evaluation.constraints.max(1)
        )
        return worst.reshape(self.X.shape)


@cache
def space() -> Space:
    """Return the default problem over the triangle, as far as n1, n3 keep the least share."""
    along, Y = np.meshgrid(np.linspace(1e-6, 1.0, COLUMNS), np.linspace(LEAST_SHARE, 2.8, ROWS))
    n2 = 0.5 * (3.0 - Y) + along * (0.5 * (3.0 - Y) - LEAST_SHARE)  # from n1 = n2 to n1 = 0.1
    designs = np.stack([n2, Y], axis=-1)
    X = to_plane(designs)[..., 0]
    return Space(X, Y, make_problem("pss5_upu").evaluate(designs.reshape(-1, 2)))


def matters(problem: DesignProblem) -> dict[str, tuple[float, float]]:
    """Return X, Y of the paper's optimum, as printed, and of ours, by what they are called."""
    reference = problem.reference
    X, Y = reference["X"].printed or 0.0, reference["Y"].printed or 0.0
    design = reference.optima["F"].design
    ours = to_plane([design["n2"], design["n3"]])
    return {
        f"paper's ({X:.2f}, {Y:.2f})": (X, Y),
        f"our optimum ({ours[0]:.2f}, {ours[1]:.2f})": (float(ours[0]), float(ours[1])),
    }


def printed(problem: DesignProblem) -> Pss5Upu:
    """Return the machine of Table 5's row 1."""
    machine = problem.mechanism(problem.printed_design())
    assert isinstance(machine, Pss5Upu)
    return machine


def skew() -> Pss5Upu:
    """Return the machine of a layout that works, with the yaw of a UPU limb."""
    problem = make_problem("pss5_upu_skew")
    machine = problem.mechanism(problem.design(BEST))
    assert isinstance(machine, Pss5Upu)
    return machine


def mark(axes: Axes, points: dict[str, tuple[float, float]]) -> None:
    """Mark designs by name: a star for the paper's, a dot for ours."""
    for name, place in points.items():
        star = name.startswith("paper")
        axes.plot(
            *place, linestyle="none", label=name, zorder=7, marker="*" if star else "o",
            markersize=11.0 if star else 6.0, color="#d55e00" if star else "white",
            markeredgecolor=plots.STYLE["ink"], markeredgewidth=0.9,
        )  # fmt: skip
