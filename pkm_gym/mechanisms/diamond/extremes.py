"""Extremes of the Diamond's indices over its workspace: exact, and continuous in the design.

Samples show the peaks, Newton's steps climb them. Limb 2 is the mirror image of limb 1: its torque
at (x, y) is that of limb 1 at (-x, y), so that over the whole rectangle each index is smooth.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pkm_gym.core.compile import formula, kernel
from pkm_gym.core.indices import squared_torque_index
from pkm_gym.core.planar import conditioning
from pkm_gym.core.quadratic import clipped, highest_in_rectangle
from pkm_gym.core.types import FloatArray

NEAR = 0.01  # of the highest sample: the lower peaks that are climbed too
STEPS = 20
CLOSE = 3e-3  # of the samples' spacing: a shorter step is the last one
STENCIL = 1e-3  # of the samples' spacing: the step of the finite differences
NUDGE = 1e-5  # of the samples' spacing: where a corner is compared with its sides

# The layers of the samples, each highest where its index is at its extreme.
LAYERS = 6
SIGMA_MAX, SIGMA_MIN, CONDITION, SINE, TORQUE_1, TORQUE_2 = range(LAYERS)


class Workspace(NamedTuple):
    """What the indices depend on: lengths in metres, and eta = m l1^2 / I_A."""

    e: float
    l1: float
    l2: float
    H: float
    b: float
    h: float
    eta: float


@formula
def place(u: float, v: float, w: Workspace) -> tuple[float, float]:
    """Return x, y of a point of the rectangle: u from -1 (left) to 1, v from 0 (top) to 1."""
    return 0.5 * w.b * u, -w.H - w.h * v


@formula
def heights(u: float, v: float, w: Workspace) -> tuple[float, float, float, float, float, float]:
    """Return the layers at a point: sigma_max^2, -sigma_min^2, their ratio (eq. 18), -sin alpha.

    And (tau l1 / I_A)^2 of both limbs (eq. 12).
    """
    x, y = place(u, v, w)
    larger, smaller, sin_alpha, sin2_1, sin2_2 = conditioning(x, y, w.e, w.l1, w.l2)
    sin2_alpha = sin_alpha * sin_alpha
    torque_1 = squared_torque_index(w.eta, sin2_alpha, sin2_1)
    torque_2 = squared_torque_index(w.eta, sin2_alpha, sin2_2)
    return larger, -smaller, larger / smaller, -sin_alpha, torque_1, torque_2


@kernel
def sample(w: Workspace, u: FloatArray, v: FloatArray, layers: FloatArray) -> None:
    """Fill ``layers`` (6, rows, columns) on the right half: the left one is its mirror image."""
    for row in range(v.shape[0]):
        for k in range(u.shape[0]):
            larger, smaller, ratio, sine, torque_1, torque_2 = heights(u[k], v[row], w)
            layers[SIGMA_MAX, row, k] = larger
            layers[SIGMA_MIN, row, k] = smaller
            layers[CONDITION, row, k] = ratio
            layers[SINE, row, k] = sine
            layers[TORQUE_1, row, k] = torque_1
            layers[TORQUE_2, row, k] = torque_2


@kernel
def highest_sample(layers: FloatArray, layer: int) -> float:
    """Return the highest sample of a layer."""
    top = -math.inf
    for row in range(layers.shape[1]):
        for k in range(layers.shape[2]):
            top = max(top, layers[layer, row, k])
    return top


@formula
def sides(layers: FloatArray, row: int, k: int) -> tuple[bool, bool]:
    """Return whether a sample lies at the top or bottom of the rectangle, and at its right."""
    return row == 0 or row == layers.shape[1] - 1, k == layers.shape[2] - 1


@kernel
def is_peak(layers: FloatArray, layer: int, row: int, k: int) -> bool:
    """Return whether no neighbour of a sample is higher, on a side of the rectangle along it.

    A corner is no such neighbour: it may be a peak of its own.
    """
    _, rows, columns = layers.shape
    level, upright = sides(layers, row, k)
    up, down = (row, row + 1) if level and not upright else (max(0, row - 1), min(rows, row + 2))
    left, right = (k, k + 1) if upright and not level else (max(0, k - 1), min(columns, k + 2))
    peak = True
    for i in range(up, down):
        for j in range(left, right):
            corner = sides(layers, i, j) == (True, True)
            peak = peak and (corner or layers[layer, i, j] <= layers[layer, row, k])
    return peak


@kernel
def summit(
    w: Workspace, u: FloatArray, v: FloatArray, layers: FloatArray, layer: int, top: float
) -> float:
    """Return the highest value of a layer over the rectangle; ``top``: its highest sample."""
    enough = top - NEAR * abs(top)
    side = -1.0 if layer == TORQUE_2 else 1.0
    climbed = TORQUE_1 if layer == TORQUE_2 else layer
    spacing = u[1] - u[0], v[1] - v[0]
    for row in range(v.shape[0]):
        for k in range(u.shape[0]):
            height = layers[layer, row, k]
            if height < enough or not is_peak(layers, layer, row, k):
                continue
            start = side * u[k], v[row]
            corner = sides(layers, row, k) == (True, True)
            if corner and falls(w, climbed, start, spacing, height):
                continue
            height, forked = climb(w, climbed, start, spacing, False)
            top = max(top, height)
            if forked:
                top = max(top, climb(w, climbed, start, spacing, True)[0])
    return top


@formula
def falls(
    w: Workspace,
    layer: int,
    corner: tuple[float, float],
    spacing: tuple[float, float],
    height: float,
) -> bool:
    """Return whether a layer falls from a corner of the rectangle along both of its sides."""
    u, v = corner
    du, dv = NUDGE * spacing[0], NUDGE * spacing[1]
    inward_u = u + (du if u < 0.0 else -du)
    inward_v = v + (dv if v < 0.5 else -dv)
    return heights(inward_u, v, w)[layer] < height and heights(u, inward_v, w)[layer] < height


@kernel
def climb(
    w: Workspace,
    layer: int,
    start: tuple[float, float],
    spacing: tuple[float, float],
    v_first: bool,
) -> tuple[float, bool]:
    """Return the height of the peak near a point of the rectangle, and whether two ways lead up.

    Newton's method within the rectangle, with a model of finite differences between points of it.
    """
    u, v = start
    cu, cv = spacing
    du, dv = STENCIL * cu, STENCIL * cv
    top, forked = -math.inf, False
    for step in range(STEPS):
        mu, mv = clipped(u, du - 1.0, 1.0 - du), clipped(v, dv, 1.0 - dv)
        middle = heights(mu, mv, w)[layer]
        east, west = heights(mu + du, mv, w)[layer], heights(mu - du, mv, w)[layer]
        low, high = heights(mu, mv + dv, w)[layer], heights(mu, mv - dv, w)[layer]
        corner = heights(mu + du, mv + dv, w)[layer]
        top = max(top, middle, east, west, low, high)
        huu = (east - 2.0 * middle + west) / (du * du)
        hvv = (low - 2.0 * middle + high) / (dv * dv)
        huv = (corner - east - low + middle) / (du * dv)
        if step == 0:
            forked = huu < 0.0 and hvv < 0.0 and huu * hvv < huv * huv
        su, sv = highest_in_rectangle(
            0.5 * (east - west) / du, 0.5 * (low - high) / dv, huu, huv, hvv,
            max(-1.0 - mu, -cu), min(1.0 - mu, cu), max(-mv, -cv), min(1.0 - mv, cv), v_first,
        )  # fmt: skip
        before_u, before_v = u, v
        u, v = mu + su, mv + sv
        if abs(u - before_u) < CLOSE * cu and abs(v - before_v) < CLOSE * cv:
            break
    return max(top, heights(u, v, w)[layer]), forked


@kernel
def workspace_indices(
    w: Workspace, u: FloatArray, v: FloatArray, layers: FloatArray
) -> tuple[float, float, float, float, float]:
    """Return sigma_max, sigma_min, largest condition number, smallest sin alpha, tau_G l1 / I_A.

    The samples lie at ``u`` and ``v``, of [0, 1] and equally spaced; ``layers`` (6, v, u) is
    scratch. Where the rods become collinear within the workspace nothing but sin alpha has an
    extreme: then the others are those of the samples.
    """
    sample(w, u, v, layers)
    sine = summit(w, u, v, layers, SINE, highest_sample(layers, SINE))
    larger = highest_sample(layers, SIGMA_MAX)
    smaller = highest_sample(layers, SIGMA_MIN)
    ratio = highest_sample(layers, CONDITION)
    torque = max(highest_sample(layers, TORQUE_1), highest_sample(layers, TORQUE_2))
    if sine < 0.0:
        larger = summit(w, u, v, layers, SIGMA_MAX, larger)
        smaller = summit(w, u, v, layers, SIGMA_MIN, smaller)
        ratio = summit(w, u, v, layers, CONDITION, ratio)
        torque = summit(w, u, v, layers, TORQUE_1, torque)
        torque = summit(w, u, v, layers, TORQUE_2, torque)
    return math.sqrt(larger), math.sqrt(-smaller), math.sqrt(ratio), -sine, math.sqrt(torque)
