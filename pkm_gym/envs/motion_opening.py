"""MotionOpening: which machine is driven, on which task's path, and from where."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.names import check_known
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.motion_rules import MotionRules
from pkm_gym.envs.opening import OPTIONS, given_designs, given_tasks
from pkm_gym.twin.rig import Rig

RESERVE = 3.0  # the motors' limit over what the printed design needs on the path
HALVINGS = 20  # of an offset that leads out of reach, before there is none


class MotionOpening:
    """Builds the machines of a problem's designs and puts them on their paths.

    Args:
        problem: the design problem.
        rules: of the runs.
        design: that is driven where none is given; the printed one if None.

    Raises:
        ValueError: for an illegal design.
    """

    def __init__(self, problem: DesignProblem, rules: MotionRules, design: Any) -> None:
        self.problem, self.rules = problem, rules
        self.home = problem.printed_design() if design is None else _design(problem, design)

    def chosen(self, options: Mapping[str, Any] | None) -> tuple[FloatArray, FloatArray]:
        """Return the design (d,) and the packed task (m,) of a reset's options.

        Raises:
            ValueError: for an unknown option or an illegal value.
        """
        given = options or {}
        check_known("reset option", given, OPTIONS)
        design, task = self.home, self.problem.pack(None)
        if given.get("design") is not None:
            design = _design(self.problem, given["design"])
        if given.get("task") is not None:
            task = given_tasks(self.problem, given["task"], 1)[0]
        return design, task

    def rig(self, design: FloatArray, task: FloatArray) -> Rig:
        """Return the twin of a design (d,) on the path of a packed task (m,).

        Raises:
            ValueError: for a design that has no twin or can't follow the path.
        """
        wanted = self.problem.unpack(task)
        try:
            machine = self.problem.mechanism(design, wanted)
            return Rig(machine, wanted, speed=self.rules.speed, frame_skip=self.rules.frame_skip)
        except ValueError as error:
            named = ", ".join(f"{k} = {v:g}" for k, v in self.problem.named(design).items())
            raise ValueError(f"the design {named} can't be driven: {error}") from error

    def force_limit(self, task: FloatArray) -> float:
        """Return what an action of 1 means on a packed task (m,), N or N m.

        Raises:
            ValueError: where it follows from the printed design, which can't follow the path.
        """
        if self.rules.force_limit is not None:
            return float(self.rules.force_limit)
        try:
            return RESERVE * self.rig(self.problem.printed_design(), task).peak_force()
        except ValueError as error:
            raise ValueError(
                f"give force_limit: it follows from the printed design, but {error}"
            ) from error

    def place(self, rig: Rig, generator: np.random.Generator) -> int:
        """Put a machine where its run begins; return the step of the path there.

        As much is drawn whatever the rules say.
        """
        mechanism, rules = rig.twin.mechanism, self.rules
        place, *shares = generator.random(1 + len(mechanism.joint_names))
        step = int(place * rig.path.steps) if rules.start == "anywhere" else 0
        if step == 0 and rules.start_offset == 0.0:
            rig.reset()
            return 0
        pose = rig.path.poses[2 * step]
        if rules.start_offset > 0.0:
            ends = np.stack([pose, mechanism.sample_poses()[0]])
            joints, home = mechanism.inverse_kinematics(ends)
            pose = _beside(mechanism, pose, rules.start_offset * np.array(shares) * (home - joints))
        rig.reset(pose, rig.path.velocities[2 * step])
        return step


def _beside(mechanism: Mechanism, pose: FloatArray, offset: FloatArray) -> FloatArray:
    """Return the pose with the joints off by an offset, halved until the machine reaches it."""
    joints = mechanism.inverse_kinematics(pose)
    for _ in range(HALVINGS):
        found = mechanism.forward_kinematics(joints + offset, pose)
        if np.isfinite(mechanism.inverse_kinematics(found)).all():
            return found
        offset = 0.5 * offset
    return pose


def _design(problem: DesignProblem, given: Any) -> FloatArray:
    values = given if isinstance(given, Mapping) else np.asarray(given)
    design: FloatArray = given_designs(problem, values, 1)[0]
    return design
