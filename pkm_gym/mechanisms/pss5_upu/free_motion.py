"""What the singularity at home means: a push moves the platform of the paper's layout.

At home five-fold layouts leave the platform two freedoms that the sliders don't hold: there only
the second order of the rods' motion resists, so that a force F moves it by about (F / k)^(1/3) in
metres where the servos have the stiffness k. With locked sliders nothing moves at all.

MuJoCo is imported when something is pushed: who draws it chooses before that how.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu

if TYPE_CHECKING:
    from pkm_gym.mechanisms.pss5_upu.pushed_twin import Pushed

FORCE = 100.0  # N
STIFFNESSES = (2e5, 2e6, 2e7, 2e8)  # N/m, of the servos
STIFFNESS = 2e6


class FreeMotion(NamedTuple):
    """How a machine at home gives way to a push, a row a stiffness.

    Stiffnesses (n,), N/m; displacements of the platform's centre (n,), m, its turns (n,), rad, and
    how far the sliders gave way (n, 5), m.
    """

    stiffnesses: FloatArray
    displacements: FloatArray
    turns: FloatArray
    deflections: FloatArray


def free_motion(
    machine: Pss5Upu, stiffnesses: Iterable[float] = STIFFNESSES, force: float = FORCE
) -> FreeMotion:
    """Push a machine's twin at home sideways, along x, with servos of each stiffness.

    Args:
        machine: the machine; its twin has the yaw that the UPU limb gives, and no weight.
        stiffnesses: N/m.
        force: N.

    Raises:
        ValueError: for a machine that isn't assembled at home, or a number that isn't positive.
        RuntimeError: for one that doesn't come to rest.
    """
    from pkm_gym.core.twin import rotation_vector

    chosen = np.array(list(stiffnesses), dtype=float)
    for name, values in (("stiffnesses", chosen), ("force", np.array([force]))):
        if not (len(values) and np.isfinite(values).all() and (values > 0.0).all()):
            raise ValueError(f"{name} are {values.tolist()}: they must be finite and positive")
    found = [pushed(machine, np.array([force]), stiffness) for stiffness in chosen]
    frames = np.array([each.frames[0] for each in found])
    moved = np.linalg.norm(frames[..., 3] - machine.home[:3], axis=1)
    turns = np.linalg.norm(rotation_vector(frames[..., :3]), axis=1)
    return FreeMotion(chosen, moved, turns, np.array([each.deflections[0] for each in found]))


def pushed(machine: Pss5Upu, forces: FloatArray, stiffness: float = STIFFNESS) -> Pushed:
    """Return where a machine's twin, built at home, rests under forces (n,), N, along x.

    Raises:
        ValueError: for a machine that isn't assembled at home.
        RuntimeError: for one that doesn't come to rest.
    """
    from pkm_gym.core.twin import twin_module
    from pkm_gym.mechanisms.pss5_upu.pushed_twin import rest_under

    module: Any = twin_module(machine)
    along = np.asarray(forces, dtype=float)[:, None] * np.array([1.0, 0.0, 0.0])
    return rest_under(module.build(machine, machine.home), machine.joint_names, stiffness, along)
