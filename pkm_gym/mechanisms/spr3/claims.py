"""What the paper says of its simulations and of the workspace, each computed, with a verdict."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from pkm_gym.core.reference import Claim
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.path import GatePath, Motion, motion
from pkm_gym.mechanisms.spr3.workspace import Envelope, envelope, volume_by_quadrature

if TYPE_CHECKING:
    from pkm_gym.core.twin import PistonSpeeds
    from pkm_gym.mechanisms.spr3.mechanism import Spr3

SAME = 1e-3  # share of the largest speed, or of R, that still counts as agreement
PLANNED = 20_001  # instants of the plan, between which it is interpolated


@dataclass(frozen=True)
class Run:
    """The twin whose legs are driven along a path by the lengths of inverse kinematics.

    Attributes:
        path: what O_A is to follow.
        plan: its motion and the legs', as they are planned.
        speeds: the legs' speeds in the simulation, and the analytic ones.
        positions: array (n, 3), m, of O_A in the simulation.
        wanted: array (n, 3), m, where the plan has it then.
    """

    path: GatePath
    plan: Motion
    speeds: PistonSpeeds
    positions: FloatArray
    wanted: FloatArray

    @property
    def off(self) -> FloatArray:
        """How far O_A is from where the plan has it (n,), m."""
        return np.asarray(np.linalg.norm(self.positions - self.wanted, axis=-1))


@cache
def driven(machine: Spr3, haste: float = 1.0) -> Run:
    """Drive a machine's twin along the largest path that fits, at ``haste`` times v_max."""
    twin: Any = import_module(machine.twin_module)
    path, speed, acceleration = twin.planned_path(machine)
    plan = motion(machine, path, haste * speed, haste**2 * acceleration, PLANNED)
    speeds = twin.piston_speeds(machine, haste)
    middles = speeds.times - 0.5 * twin.SOLVER.timestep  # of the steps that its poses are of
    wanted = [np.interp(middles, plan.times, axis) for axis in plan.positions.T]
    return Run(path, plan, speeds, machine.position(speeds.poses), np.stack(wanted, axis=-1))


def claims(machine: Spr3, run: Run) -> tuple[Claim, ...]:
    """Return the statements that are computed, section by section."""
    return tuple(_claims(machine, run))


def _claims(machine: Spr3, run: Run) -> Iterator[Claim]:
    yield _spin(run.plan)
    yield _closed(machine, envelope(machine))
    yield _speeds(run)
    yield _trajectory(run)


def _spin(plan: Motion) -> Claim:
    """Judge whether limbs turn about themselves."""
    most = np.degrees(np.abs(plan.spins).max(axis=0))
    turning = most > 1e-6
    return Claim(
        "Section 2: each limb turns about its own axis while the mechanism moves.",
        f"up to {', '.join(f'{x:.3f}' for x in most)} deg/s along the path at v_max",
        "holds" if turning.all() else "holds, but not for a limb in whose plane the path lies",
    )


def _closed(machine: Spr3, surface: Envelope) -> Claim:
    """Judge whether the six families of surfaces enclose a body."""
    edges = np.sort(surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    closed = (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    quadrature = volume_by_quadrature(machine)
    off = surface.volume / quadrature - 1.0
    return Claim(
        "Section 3: the surfaces W1 to W6 form a regular body, the workspace (Fig. 6).",
        f"{'closed' if closed else 'open'}; it holds {surface.volume:.9f} m^3 with steps of 5 mm, "
        f"{abs(off):.0e} off the integral of 1/det J",
        "holds for the printed dimensions" if closed and abs(off) < SAME else "contradicted",
    )


def _speeds(run: Run) -> Claim:
    """Judge whether the legs' speeds of theory and simulation agree."""
    planned = np.abs(run.speeds.twin - run.speeds.planned).max()
    analytic = np.abs(run.speeds.twin - run.speeds.analytic).max()
    largest = np.abs(run.plan.rates).max()
    return Claim(
        "Sections 4, 5: leg speeds of the simulation are those of the theory (Fig. 4).",
        f"of up to {1e3 * largest:.2f} mm/s, the twin's are within {1e6 * planned:.1f} um/s of J "
        f"along the plan, and within {1e9 * analytic:.0f} nm/s of J at O_A's simulated motion",
        "holds" if max(planned, analytic) < SAME * largest else "contradicted",
    )


def _trajectory(run: Run) -> Claim:
    """Judge whether O_A follows its path where the legs have the theoretical lengths."""
    off = run.off.max()
    return Claim(
        "Section 5: driven by the theoretical lengths, O_A stays very near its path (Fig. 3).",
        f"within {1e6 * off:.1f} um on the largest path of that shape that fits, R "
        f"{1e3 * run.path.radius:.1f} mm; the printed path doesn't fit",
        "holds" if off < SAME * run.path.radius else "contradicted",
    )
