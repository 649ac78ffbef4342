"""What the paper says under its Figs 3-8 and in section 3.4, each computed, with a verdict.

Over the paper's lattice, where its own averages are from, and beside them over one box that all of
its designs reach.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pkm_gym.core.reference import Claim, Reference
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pus6.atlas import FIVE, LENGTHS, RADII, Atlas, lattice_atlas
from pkm_gym.mechanisms.pus6.mechanism import NAMES

FIGURES = dict(zip(NAMES, range(3, 9), strict=True))  # index -> number of its figure
NEAR = 0.0101  # m, that still counts as near a region: a step of the grid
FLAT = 0.05  # share of the mean, that still counts as no change
SQUARE = (len(LENGTHS), len(RADII))
TENTH = 0.1  # m, a characteristic length of the platform's size


class Region(NamedTuple):
    """Where the paper sees the best of an index, m."""

    L: tuple[float, float]
    R: tuple[float, float]

    def __str__(self) -> str:
        return f"L {_span(self.L)}, R {_span(self.R)} cm"


BEST = {
    "eta_omega": Region((0.465, 0.495), (0.195, 0.195)),
    "eta_v": Region((0.45, 0.48), (0.19, 0.19)),
    "eta_alpha": Region((0.45, 0.47), (0.16, 0.20)),
    "eta_a": Region((0.45, 0.48), (0.195, 0.195)),
    "eta_F": Region((0.45, 0.46), (0.10, 0.10)),
    "eta_I": Region((0.45, 0.48), (0.195, 0.195)),
}
FINAL = Region((0.45, 0.47), (0.19, 0.19))  # of section 3.4


@dataclass(frozen=True)
class Maps:
    """What the statements are about.

    Attributes:
        atlas: of the 121 designs over the paper's lattice.
        box: array (121, 6), the means over one box.
        reference: what the paper prints.
    """

    atlas: Atlas
    box: FloatArray
    reference: Reference

    def over_lattice(self, name: str) -> FloatArray:
        """Return the means (11, 11) of an index over the lattice, rows L, columns R."""
        return self.atlas[name].reshape(SQUARE)

    def over_box(self, name: str) -> FloatArray:
        """Return the means (11, 11) of an index over one box."""
        return self.box[:, NAMES.index(name)].reshape(SQUARE)

    def printed(self) -> dict[tuple[float, float], dict[str, float]]:
        """Return Table 2: (L, R), cm, -> index -> printed value."""
        columns = self.reference.table("table2.columns", list[str])
        numbers = self.reference.table("table2.rows", list[list[float]])
        rows = (dict(zip(columns, row, strict=True)) for row in numbers)
        return {(row["L"], row["R"]): row for row in rows}


def claims(maps: Maps) -> tuple[Claim, ...]:
    """Return all statements, figure by figure."""
    return tuple(_claims(maps))


def best_of(values: FloatArray) -> tuple[float, float]:
    """Return L and R, m, of the largest of values (11, 11)."""
    row, column = np.unravel_index(values.argmax(), SQUARE)
    return float(LENGTHS[row]), float(RADII[column])


def rising_steps(values: FloatArray, axis: int) -> float:
    """Return which share of the grid's steps along an axis raises values (11, 11)."""
    return float((np.diff(values, axis=axis) > 0.0).mean())


def spread(values: FloatArray) -> FloatArray:
    """Return (largest - least)/mean over L of values (11, 11), for each R (11,)."""
    return np.asarray((values.max(axis=0) - values.min(axis=0)) / values.mean(axis=0))


def _claims(maps: Maps) -> Iterator[Claim]:
    yield _flat_in_length(maps, "eta_omega", 11, "where R changes little")
    yield _rises(maps, "eta_omega", 1)
    for name in ("eta_omega", "eta_v", "eta_alpha"):
        yield _best(maps, name)
    yield _largest(maps)
    yield _best(maps, "eta_a")
    yield _flat_in_length(maps, "eta_F", 4, "for R < 14 cm")
    yield _best(maps, "eta_F")
    yield _isotropy(maps)
    yield _rises(maps, "eta_I", 0)
    yield _rises(maps, "eta_I", 1)
    yield _best(maps, "eta_I")
    yield _balanced(maps)
    yield _weak_force(maps)
    yield _no_best(maps)


def _best(maps: Maps, name: str) -> Claim:
    """Judge where an index is best."""
    values, region = maps.over_lattice(name), BEST[name]
    L, R = best_of(values)
    in_L, in_R = _near(L, region.L), _near(R, region.R)
    across = spread(values)[np.abs(RADII - R).argmin()]
    verdict = "holds" if in_L and in_R else "contradicted"
    if in_R and not in_L and across < FLAT:
        verdict = "holds for R; no L stands out"
    own = best_of(maps.over_box(name))
    ours = (
        f"largest, {values.max():.4f}, at {_place(L, R)}; over all L at that R {across:.1%} apart; "
        f"over one box largest at {_place(*own)}"
    )
    return Claim(f"Fig. {FIGURES[name]}: {name} is best near {region}.", ours, verdict)


def _flat_in_length(maps: Maps, name: str, count: int, where: str) -> Claim:
    """Judge whether an index hardly depends on L for the first ``count`` radii."""
    apart, radii = spread(maps.over_lattice(name))[:count], 100.0 * RADII[:count]
    flat = radii[apart < FLAT]
    verdict = "holds" if len(flat) == len(radii) else f"holds for R {_range(flat)} cm only"
    ours = (
        f"over all L {apart[0]:.1%} apart at R = {radii[0]:.0f} cm, {apart[-1]:.1%} at "
        f"{radii[-1]:.0f} cm"
    )
    claim = f"Fig. {FIGURES[name]}: {name} hardly depends on L {where}."
    return Claim(claim, ours, verdict if len(flat) else "contradicted")


def _rises(maps: Maps, name: str, axis: int) -> Claim:
    """Judge whether an index gets better with L (axis 0) or R (axis 1)."""
    lattice = rising_steps(maps.over_lattice(name), axis)
    box = rising_steps(maps.over_box(name), axis)
    letter, verdict = "LR"[axis], "contradicted"
    if lattice == 1.0:
        verdict = "holds" if box == 1.0 else "holds over the different workspaces only"
    ours = f"rises in {lattice:.0%} of the steps of {letter}, over one box in {box:.0%}"
    if axis == 0:
        (first, second), radius, printed = _table_pair(maps, name)
        ours += f"; Table 2 at R = {radius:g} cm: {printed[0]:.3f}, {printed[1]:.3f} for L = "
        ours += f"{first:g}, {second:g} cm"
        if lattice == 0.0 and printed[1] < printed[0]:
            verdict = "contradicted, by Table 2 too"
    return Claim(f"Fig. {FIGURES[name]}: {name} gets better with growing {letter}.", ours, verdict)


def _table_pair(maps: Maps, name: str) -> tuple[tuple[float, float], float, tuple[float, float]]:
    """Return two L with the same R of Table 2, that R, cm, and what it prints of an index."""
    printed = maps.printed()
    pairs = ((one, other) for one in printed for other in printed if one[0] < other[0])
    one, other = next((a, b) for a, b in pairs if a[1] == b[1])
    return (one[0], other[0]), one[1], (printed[one][name], printed[other][name])


def _largest(maps: Maps) -> Claim:
    """Judge the printed maximum of eta_alpha."""
    ours = maps.atlas["eta_alpha"].max()
    printed = maps.reference["eta_alpha_largest"].printed or np.nan
    off = ours / printed - 1.0
    return Claim(
        f"Fig. 5: the largest eta_alpha of the 121 designs is {printed:g}.",
        f"{ours:.5f}, {off:+.1%}; not used in the calibration of the lattice",
        "reproduced" if abs(off) < 0.03 else "not reproduced",
    )


def _isotropy(maps: Maps) -> Claim:
    """Judge what eta_F = 1 would mean."""
    return Claim(
        "Fig. 7: where eta_F = 1, force and torque are isotropic.",
        "with Frobenius norms |G||G^-1| >= 6, so that eta_F is at most 1/6; the largest of the "
        f"averages is {maps.atlas['eta_F'].max():.4f}",
        "can't be",
    )


def _balanced(maps: Maps) -> Claim:
    """Judge whether the five other indices are relatively good together where the paper says."""
    order = np.argsort(-maps.atlas.balanced)
    first = maps.atlas.designs[order[0], :2]
    ours = ", ".join(
        f"{maps.atlas.balanced[i]:.4f} at {_place(*maps.atlas.designs[i, :2])}" for i in order[:3]
    )
    inside = _near(first[0], FINAL.L) and _near(first[1], FINAL.R)
    return Claim(
        f"Section 3.4: near {FINAL} all indices but eta_F are relatively good.",
        f"the least of the five normalised indices is largest there: {ours}",
        "holds, as max-min of the paper's averages" if inside else "contradicted",
    )


def _weak_force(maps: Maps) -> Claim:
    """Judge whether the printed design is weak in force and torque."""
    other = lattice_atlas(characteristic_length=TENTH)
    at = int(np.flatnonzero(np.isclose(other.designs[:, :2], (0.46, 0.19)).all(axis=1))[0])
    shares = [atlas["eta_F"][at] / atlas["eta_F"].max() - 1.0 for atlas in (maps.atlas, other)]
    ranks = [int((a["eta_F"] > a["eta_F"][at]).sum()) + 1 for a in (maps.atlas, other)]
    return Claim(
        "Section 3.4: force and torque are not good at the printed design.",
        f"rank {ranks[0]} of 121, {shares[0]:.1%}, with angular rows in 1/cm; rank {ranks[1]}, "
        f"{shares[1]:.1%}, with a characteristic length of 10 cm",
        "depends on the unit of length",
    )


def _no_best(maps: Maps) -> Claim:
    """Judge whether one design is best in everything."""
    places = {best_of(maps.over_lattice(name)) for name in NAMES}
    six, five = (int(maps.atlas.pareto(names).sum()) for names in (NAMES, FIVE))
    return Claim(
        "Section 3.4: in general no design is best in all indices.",
        f"the six are best at {len(places)} different designs; {six} of 121 are not dominated in "
        f"six, {five} in the five without eta_F",
        "holds" if len(places) > 1 else "contradicted",
    )


def _near(value: float, span: tuple[float, float]) -> bool:
    return span[0] - NEAR <= value <= span[1] + NEAR


def _span(span: tuple[float, float]) -> str:
    low, high = (f"{100.0 * end:g}" for end in span)
    return low if low == high else f"{low}–{high}"


def _range(radii: FloatArray) -> str:
    return f"{radii[0]:.0f}–{radii[-1]:.0f}" if len(radii) > 1 else f"{radii.sum():.0f}"


def _place(L: float, R: float) -> str:
    return f"({100.0 * L:.0f}, {100.0 * R:.0f})"
