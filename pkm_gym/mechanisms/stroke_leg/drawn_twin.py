"""How the leg's twin looks, and what it weighs: aluminium links, barrels and rods of steel.

What turns about one axis lies in layers, so that nothing runs through anything else: bars in the
middle between pairs of bars, the cylinder AB in the middle too, in front of all that the crank OD
and then the cylinder CD.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import mujoco
import numpy as np

from pkm_gym.core.planar_twin import add_box
from pkm_gym.core.twin import ALUMINIUM, STEEL, add_bar, add_cylinder
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.stroke_leg.mechanism import Leg

# In thicknesses; planes are from the middle towards who looks at the leg.
MIDDLE, PAIR = (0.0,), (-1.9, 1.9)
CRANK, CYLINDER = 3.2, 4.9  # of D
PLATE, BRACKET = (-3.6, -2.9), (6.3, 6.9)  # of the frame, behind and in front
FOOT = 1.7  # radius
ROUND = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)


class Chain(NamedTuple):
    """One of the two: its crank's end and its hinges, the joint at the hip, its layers, colour."""

    letters: str
    joint: str
    crank: tuple[float, ...]
    upper: tuple[float, ...]
    middle: tuple[float, ...]
    lower: tuple[float, ...]
    color: str


CHAINS = (
    Chain("AFJ", "beta", PAIR, PAIR, MIDDLE, PAIR, "rod"),
    Chain("DEH", "alpha", (CRANK,), MIDDLE, PAIR, MIDDLE, "arm"),
)


def thickness(machine: Leg) -> float:
    """Return how thick links are drawn, m."""
    return 0.05 * machine.l


def draw_chain(
    links: tuple[mujoco.MjsBody, mujoco.MjsBody, mujoco.MjsBody],
    look: Chain,
    l: float,
    crank: FloatArray,
    thick: float,
) -> None:
    """Draw the links of a chain, whose crank ends at a point (2,); the foot is on the inner one."""
    upper, middle, lower = links
    origin = np.zeros(2)
    _draw_bars(upper, (origin, crank), look.crank, 0.5 * thick, thick, look.color)
    for body, length, planes in (
        (upper, l, look.upper), (middle, 2.0 * l, look.middle), (lower, l, look.lower),
    ):  # fmt: skip
        radius = (0.9 if planes == MIDDLE else 0.6) * thick
        _draw_bars(body, (origin, np.array([length, 0.0])), planes, radius, thick, look.color)
    for x in (0.0, l, 2.0 * l):
        _draw_pin(middle, (x, 0.0), (-2.75 * thick, 2.75 * thick), thick)
    if look.lower == MIDDLE:
        across = [(l, 0.0, -1.15 * thick), (l, 0.0, 1.15 * thick)]
        add_cylinder(lower, across, FOOT * thick, "platform", density=ALUMINIUM)
        _draw_pin(lower, (l, 0.0), (-2.75 * thick, 2.75 * thick), thick)
    end = (2.75 if look.crank == PAIR else CYLINDER + 0.85) * thick
    _draw_pin(upper, crank, (-end if look.crank == PAIR else CRANK * thick, end), thick)


def draw_cylinder(
    barrel: mujoco.MjsBody, rod: mujoco.MjsBody, shortest: float, z: float, thick: float
) -> None:
    """Draw a cylinder in the plane z, whose rod is all in at its shortest length, m."""
    long = 0.8 * shortest
    add_cylinder(barrel, [(0.0, 0.0, z), (long, 0.0, z)], 1.05 * thick, "base", density=STEEL)
    for x in (0.12 * long, 0.97 * long):
        ends = [(x - 0.03 * long, 0.0, z), (x + 0.03 * long, 0.0, z)]
        add_cylinder(barrel, ends, 1.2 * thick, "metal")
    _draw_eye(barrel, (0.0, 0.0), z, 0.9 * thick, 1.3 * thick, "base")
    add_bar(rod, [(-0.92 * shortest, 0.0, z), (0.0, 0.0, z)], 0.45 * thick, "metal", density=STEEL)
    _draw_eye(rod, (0.0, 0.0), z, 0.75 * thick, 0.95 * thick, "metal")


def draw_frame(
    spec: mujoco.MjSpec,
    base: mujoco.MjsBody,
    corners: tuple[FloatArray, FloatArray, FloatArray],
    height: float,
    thick: float,
) -> None:
    """Draw the hip: a plate with the pins at O, C and B, a bracket in front, a stand behind."""
    o, c, b = corners
    _draw_plate(spec, base, "plate", corners, PLATE, 1.9 * thick, thick)
    _draw_plate(spec, base, "bracket", (o, c), BRACKET, 1.1 * thick, thick)
    for point, end in ((o, BRACKET[1]), (c, BRACKET[1]), (b, 1.3)):
        _draw_pin(base, point, (PLATE[0] * thick, (end + 0.15) * thick), 1.4 * thick)
    behind, low, middle = -6.5 * thick, -height + 0.8 * thick, 0.5 * c[0]
    top, half = b[1] + 1.9 * thick, 1.15 * (0.5 * c[0] + 0.25 * height)
    add_box(base, (middle, 0.5 * top, behind), (0.5 * c[0] + 4.0 * thick, 0.5 * top, 2.9 * thick))
    add_box(base, (middle, 0.6 * top, behind), (half, 1.7 * thick, 1.7 * thick))
    for x in (middle - half, middle + half):
        post = 0.6 * top + 1.7 * thick - low
        add_box(base, (x, low + 0.5 * post, behind), (1.7 * thick, 0.5 * post, 1.7 * thick))
        add_box(base, (x, low - 0.4 * thick, behind), (3.0 * thick, 0.4 * thick, 3.6 * thick))


def _draw_bars(
    body: mujoco.MjsBody, ends: tuple[FloatArray, FloatArray], planes: Iterable[float],
    radius: float, thick: float, color: str,
) -> None:  # fmt: skip
    """Draw a bar in each of some planes, with an eye at either end."""
    for z in (plane * thick for plane in planes):
        add_bar(body, [(*end, z) for end in ends], radius, color, density=ALUMINIUM)
        for end in ends:
            _draw_eye(body, end, z, radius, 1.15 * thick, color)


def _draw_eye(
    body: mujoco.MjsBody, at: FloatArray | tuple[float, float], z: float, half: float,
    radius: float, color: str,
) -> None:  # fmt: skip
    add_cylinder(body, [(*at, z - half), (*at, z + half)], radius, color)


def _draw_pin(
    body: mujoco.MjsBody,
    at: FloatArray | tuple[float, float],
    between: tuple[float, float],
    thick: float,
) -> None:
    add_cylinder(body, [(*at, z) for z in between], 0.45 * thick, "metal")


def _draw_plate(
    spec: mujoco.MjSpec, base: mujoco.MjsBody, name: str, corners: Iterable[FloatArray],
    between: tuple[float, float], radius: float, thick: float,
) -> None:  # fmt: skip
    """Draw the convex plate around circles about its corners (2,)."""
    circle = radius * np.stack([np.cos(ROUND), np.sin(ROUND)], axis=-1)
    outline = np.concatenate([corner + circle for corner in corners])
    sides = [np.column_stack([outline, np.full(len(outline), z * thick)]) for z in between]
    spec.add_mesh(name=name, uservert=np.concatenate(sides).ravel())
    base.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, material="metal", density=0.0, contype=0,
        conaffinity=0,
    )  # fmt: skip
