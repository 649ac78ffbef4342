"""What drives hold of a load: against virtual work by inverse kinematics, and all directions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.statics import held, holding_forces, largest_holding_forces, load_units

STEP = 1e-6


@pytest.fixture(scope="module")
def machine(problem: DesignProblem, design: np.ndarray) -> Mechanism:
    return problem.mechanism(design)


def inner_poses(machine: Mechanism, rng: np.random.Generator, n: int) -> np.ndarray:
    """Poses between the workspace's and its middle, where the machine is not singular."""
    known = machine.search_poses()
    known = known[np.isfinite(machine.inverse_kinematics(known)).all(axis=1)]
    chosen = known[rng.integers(0, len(known), 4 * n)]
    chosen = 0.5 * (chosen + machine.sample_poses()[0])
    jacobian = machine.jacobian(chosen)
    usable = np.isfinite(jacobian).all(axis=(1, 2)) & (np.abs(jacobian).max(axis=(1, 2)) < 20.0)
    return chosen[usable][:n]


def test_the_drives_do_the_virtual_work_of_the_load(
    machine: Mechanism, rng: np.random.Generator
) -> None:
    poses = inner_poses(machine, rng, 20)
    assert len(poses) > 5
    rates = rng.normal(size=poses.shape)
    ahead, behind = (machine.inverse_kinematics(poses + s * STEP * rates) for s in (1.0, -1.0))
    joint_rates = (ahead - behind) / (2.0 * STEP)
    twists = machine.twist(poses, rates)
    loads = rng.normal(size=twists.shape)
    forces = holding_forces(machine, poses, loads)
    of_drives, of_load = (forces * joint_rates).sum(axis=1), (loads * twists).sum(axis=1)
    size = np.abs(forces * joint_rates).sum(axis=1) + np.abs(loads * twists).sum(axis=1)
    assert (np.abs(of_drives + of_load) / size).max() < 1e-6


def test_no_direction_of_a_load_asks_for_more(machine: Mechanism, rng: np.random.Generator) -> None:
    pose, turning = inner_poses(machine, rng, 1), machine.turning
    ways = rng.normal(size=(20_000, len(machine.twist_names)))
    for part in (slice(turning), slice(turning, None)):
        ways[:, part] /= np.linalg.norm(ways[:, part], axis=1, keepdims=True)
    force, torque = 30.0, 2.0 if turning else 0.0
    loads = ways * np.where(np.arange(ways.shape[1]) < turning, torque, force)
    found = np.abs(holding_forces(machine, pose, loads)).max(axis=0)
    bound = largest_holding_forces(machine, pose, force, torque)[0]
    assert (found <= bound * (1.0 + 1e-12)).all()
    assert (found > 0.8 * bound).all()


class Slider:
    """A tool that a slider moves the faster the nearer it is to x = 0: J = 1 / x."""

    twist_names, joint_names, joint_unit, turning = ("vx",), ("q",), "m", 0

    def __init__(self, nearest: float) -> None:
        self.x = np.array([[nearest], [0.5], [-1.0], [np.nan]])

    def sample_poses(self) -> np.ndarray:
        return np.array([[0.5]])

    def search_poses(self) -> np.ndarray:
        return self.x

    def inverse_kinematics(self, pose: np.ndarray) -> np.ndarray:
        return np.square(pose)

    def jacobian(self, pose: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore"):
            return 1.0 / pose[..., None]

    def place(self, pose: np.ndarray) -> str:
        return f"at {pose[0]:g}"


def test_the_largest_force_is_looked_for_where_the_machine_reaches() -> None:
    slider: Any = Slider(-0.25)
    (drive,) = held(slider, {"fx": 3.0})
    assert (drive.joint, drive.unit) == ("q", "N")
    assert (drive.largest, drive.place, drive.middle) == (12.0, "at -0.25", -6.0)
    (drive,) = held(slider, {"force": 3.0})
    assert (drive.largest, drive.middle) == (12.0, 6.0)


def test_a_singular_machine_holds_with_no_finite_force() -> None:
    slider: Any = Slider(0.0)
    (drive,) = held(slider, {"force": 3.0})
    assert (drive.largest, drive.place) == (np.inf, "at 0")


def test_a_machine_that_reaches_nothing_holds_nothing() -> None:
    slider: Any = Slider(1.0)
    slider.inverse_kinematics = lambda pose: pose + np.nan
    with pytest.raises(ValueError, match="no pose of the workspace is within reach"):
        held(slider, {"fx": 3.0})


def test_a_load_has_the_components_of_the_twist(machine: Mechanism) -> None:
    units = load_units(machine)
    components = [name for name in units if name not in ("force", "torque")]
    twist = [{"m": "w", "f": "v"}[name[0]] + name[1:] for name in components]
    assert tuple(twist) == machine.twist_names
    assert ("torque" in units) == (machine.turning > 0)
    assert all(units[name] == "N m" for name in units if name.startswith(("m", "t")))


@pytest.mark.parametrize(
    ("load", "sentence"),
    [
        ({"fq": 1.0}, "unknown load 'fq'"),
        ({"forse": 1.0}, "unknown load 'forse'; did you mean 'force'"),
        ({}, r"the load is empty: it must have components \(fx\), or the size of a force of any"),
        ({"fx": 1.0, "force": 2.0}, "the load is fx, force: it must"),
        ({"force": -2.0}, "the load's force is -2: of any direction, it has a size"),
    ],
)
def test_what_is_no_load_is_refused(load: Mapping[str, float], sentence: str) -> None:
    slider: Any = Slider(1.0)
    with pytest.raises(ValueError, match=sentence):
        held(slider, load)
