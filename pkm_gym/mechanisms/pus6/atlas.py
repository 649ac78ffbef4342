"""The paper's atlas: the averages of its 121 designs over its lattice, and how they compare.

The averages are over different workspaces, see ``lattice``; the way to weigh them is ours: the
least of the five normalised indices without eta_F, which the paper gives up.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np

from pkm_gym.core.names import check_known
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.mechanisms.pus6.declared import CONVENTIONS, Pus6Options, Pus6Task
from pkm_gym.mechanisms.pus6.lattice import averages
from pkm_gym.mechanisms.pus6.mechanism import NAMES, Pus6

LENGTHS = np.arange(45, 56) / 100.0  # m, of the paper's grid: L
RADII = np.arange(10, 21) / 100.0  # R
FIVE = tuple(name for name in NAMES if name != "eta_F")
REST = (0.38, math.radians(15.0), math.radians(30.0))  # r_B, phi_A, phi_C


def paper_designs() -> FloatArray:
    """Return the complete designs (121, 5) of the paper's grid, numbered as in its Table 1."""
    L, R = np.meshgrid(LENGTHS, RADII, indexing="ij")
    rest = np.broadcast_to(REST, (L.size, len(REST)))
    return np.column_stack([L.ravel(), R.ravel(), rest])


def pareto(values: FloatArray) -> BoolArray:
    """Return which rows (n,) of values (n, k), larger is better, no other row dominates."""
    beaten = [((values >= row).all(axis=1) & (values > row).any(axis=1)).any() for row in values]
    return np.isfinite(values).all(axis=1) & ~np.array(beaten)


@dataclass(frozen=True)
class Atlas:
    """What designs have over the paper's lattice.

    Attributes:
        designs: array (n, 5), complete, m and rad.
        means: array (n, 6), of the indices in the order of ``NAMES``.
        poses: array (n,), how many are counted, Table 1.
        different: array (n,), how many of them differ in more than z.
        beyond: array (n,), which share of what is reached lies beyond the direct singularity.
        low: array (6,), the least means of the grid that they are normalised by.
        high: array (6,), the largest ones.
    """

    designs: FloatArray
    means: FloatArray
    poses: FloatArray
    different: FloatArray
    beyond: FloatArray
    low: FloatArray
    high: FloatArray

    def __getitem__(self, name: str) -> FloatArray:
        """Return the means (n,) of an index."""
        return self.means[:, NAMES.index(name)]

    @property
    def normalised(self) -> FloatArray:
        """Array (n, 6): (value - least)/(largest - least) of the grid."""
        return (self.means - self.low) / (self.high - self.low)

    @property
    def balanced(self) -> FloatArray:
        """Array (n,): the least of the five normalised indices without eta_F."""
        return self.normalised[:, columns_of(FIVE)].min(axis=1)

    def pareto(self, names: Iterable[str] = FIVE) -> BoolArray:
        """Return which designs (n,) no other of them dominates in the named indices."""
        return pareto(self.means[:, columns_of(names)])


def columns_of(names: Iterable[str]) -> list[int]:
    """Return the columns of named indices."""
    return [NAMES.index(name) for name in names]


def lattice_atlas(
    designs: FloatArray | None = None,
    *,
    characteristic_length: float = 0.01,
    convention: str = "influence",
    same_aspect: bool = False,
    tool: float = 0.0,
    over: Atlas | None = None,
    progress: Callable[[], None] = lambda: None,
) -> Atlas:
    """Return the atlas of designs.

    Args:
        designs: array (n, 5), complete; the paper's 121 by default.
        characteristic_length: unit of length of eta_F and eta_I, m.
        convention: "influence" or "symmetric", of the second-order coefficients.
        same_aspect: leave out the poses beyond the direct singularity.
        tool: length of the tool, m.
        over: the atlas by whose range the means are normalised; its own by default.
        progress: called after each design.
    """
    check_known("convention", [convention], CONVENTIONS)
    skew = 1.0 if convention == "influence" else 0.0
    designs = paper_designs() if designs is None else designs
    found = []
    for design in designs:
        L, R, r_B, phi_A, phi_C = design.tolist()
        layout = Pus6(L, R, r_B, phi_A, phi_C, tool).layout
        found.append(averages(layout, L, characteristic_length, skew, same_aspect))
        progress()
    means = np.array([each.means for each in found])
    poses, different, across = (
        np.array([float(getattr(each, name)) for each in found])
        for name in ("poses", "different", "beyond")
    )
    low, high = (means.min(axis=0), means.max(axis=0)) if over is None else (over.low, over.high)
    with np.errstate(invalid="ignore"):
        beyond = across / (poses + across if same_aspect else poses)
    return Atlas(designs, means, poses, different, beyond, low, high)


def columns(
    designs: FloatArray, task: Pus6Task, options: Pus6Options
) -> dict[str, tuple[FloatArray | BoolArray, str]]:
    """Return what the atlas of complete designs (n, 5) holds beside their indices."""
    measured = partial(
        lattice_atlas,
        characteristic_length=task.characteristic_length,
        convention=options.convention,
        same_aspect=options.same_aspect,
        tool=task.tool,
    )
    papers = measured()
    same = np.array_equal(designs, papers.designs)
    atlas = papers if same else measured(designs, over=papers)
    shares = {
        f"{name}_normalised": (values, f"{name}, 0 to 1 over the paper's grid")
        for name, values in zip(NAMES, atlas.normalised.T, strict=True)
    }
    return {
        "poses": (atlas.poses, "poses of the paper's lattice that are counted"),
        "different": (atlas.different, "how many of them differ in more than z"),
        "beyond": (atlas.beyond, "share of the reached poses beyond the direct singularity"),
        **shares,
        "balanced_atlas": (atlas.balanced, "least of the normalised indices without eta_F"),
        "pareto_5": (atlas.pareto(FIVE), "no design dominates it in the five without eta_F"),
        "pareto_6": (atlas.pareto(NAMES), "no design dominates it in all six"),
    }
