"""Forces of the drives that hold a load on the platform: statics of links without weight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.names import check_known
from pkm_gym.core.types import FloatArray

ANY = {"force": "N", "torque": "N m"}  # of any direction
UNITS = {"m": "N", "rad": "N m"}  # of a joint's coordinate -> of its force


def load_units(machine: Mechanism) -> dict[str, str]:
    """Return what a load on a machine's platform may be made of, name -> unit.

    Its components as ``fx`` beside the velocity ``vx`` and ``mx`` beside ``wx``, then the size of a
    ``force``, and of a ``torque`` where the twist has angular velocities, of any direction.
    """
    angular = set(machine.twist_names[: machine.turning])
    units = {
        f"{'m' if name in angular else 'f'}{name[1:]}": "N m" if name in angular else "N"
        for name in machine.twist_names
    }
    return units | {k: unit for k, unit in ANY.items() if k == "force" or angular}


def holding_forces(machine: Mechanism, pose: FloatArray, load: npt.ArrayLike) -> FloatArray:
    """Return the drives' forces that hold a load: tau = -J^T load, from the virtual work.

    Args:
        machine: with a Jacobian, twist = J @ joint rates.
        pose: array (..., k).
        load: array (..., twist), what acts on the platform, in the order of ``twist_names``: N m
            beside angular velocities, N beside others.

    Returns:
        Array (..., joints), N of a slider, N m of a hinge; NaN out of reach.
    """
    wrench = np.asarray(load, dtype=float)
    return -np.einsum("...ij,...i->...j", machine.jacobian(pose), wrench)


def largest_holding_forces(
    machine: Mechanism, pose: FloatArray, force: float, torque: float = 0.0
) -> FloatArray:
    """Return the sizes of the drives' forces (..., joints) under the worst of all loads.

    A load of a size has any direction: each drive then holds the norm of its column of the Jacobian
    times it.

    Args:
        machine: with a Jacobian.
        pose: array (..., k).
        force: on the platform, N.
        torque: on the platform, N m.
    """
    jacobian, turning = machine.jacobian(pose), machine.turning
    turned = np.linalg.norm(jacobian[..., :turning, :], axis=-2)
    moved = np.linalg.norm(jacobian[..., turning:, :], axis=-2)
    with np.errstate(invalid="ignore"):  # a Jacobian that is infinite, where it is singular
        return np.asarray(torque * turned + force * moved)


@dataclass(frozen=True)
class Holding:
    """What a drive holds over a workspace.

    Attributes:
        joint: its name.
        unit: of its force, "" where the mechanism doesn't say what its joints are.
        largest: the force of the largest size, infinite where the machine is singular; a size where
            the load has any direction.
        place: where, in words.
        middle: at the pose that stands for the machine.
    """

    joint: str
    unit: str
    largest: float
    place: str
    middle: float


def check_load(machine: Mechanism, load: Mapping[str, float]) -> None:
    """Refuse a load that a machine's platform can't bear.

    Raises:
        ValueError: for an unknown component (with its closest match), none, a size that is
            negative, or one beside components.
    """
    units = load_units(machine)
    check_known("load", load, units)
    sizes = [name for name in load if name in ANY]
    if not load or (sizes and len(sizes) < len(load)):
        raise ValueError(
            f"the load is {', '.join(load) or 'empty'}: it must have components "
            f"({', '.join(name for name in units if name not in ANY)}), or the size of a "
            f"{' and a '.join(name for name in units if name in ANY)} of any direction"
        )
    for name in sizes:
        if load[name] < 0.0:
            raise ValueError(
                f"the load's {name} is {load[name]:g}: of any direction, it has a size"
            )


def held(machine: Mechanism, load: Mapping[str, float]) -> tuple[Holding, ...]:
    """Return what each drive holds, looked for over the workspace; see ``load_units``.

    Args:
        machine: with a Jacobian.
        load: component or size -> N or N m; components that aren't given are 0.

    Raises:
        ValueError: for a load that the platform can't bear.
    """
    check_load(machine, load)
    poses = np.concatenate([machine.sample_poses()[:1], machine.search_poses()])
    if load.keys() & ANY.keys():
        forces = largest_holding_forces(
            machine, poses, load.get("force", 0.0), load.get("torque", 0.0)
        )
    else:
        names = [name for name in load_units(machine) if name not in ANY]
        forces = holding_forces(machine, poses, [load.get(name, 0.0) for name in names])
    reached = np.asarray(np.isfinite(machine.inverse_kinematics(poses)).all(axis=1))
    if not reached.any():
        raise ValueError("no pose of the workspace is within reach: there is nothing to hold")
    forces = np.where(np.isfinite(forces), forces, np.inf)
    worst = np.where(reached[:, None], np.abs(forces), -1.0).argmax(axis=0)
    unit = UNITS.get(machine.joint_unit, "")
    return tuple(
        Holding(name, unit, float(forces[at, j]), machine.place(poses[at]), float(forces[0, j]))
        for j, (name, at) in enumerate(zip(machine.joint_names, worst, strict=True))
    )
