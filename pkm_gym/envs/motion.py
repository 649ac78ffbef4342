"""MotionEnv: drive the MuJoCo twin of a design along its task's path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.error import ResetNeeded

from pkm_gym.core.names import check_known
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.checks import check_arguments, check_whole, finite
from pkm_gym.envs.motion_opening import MotionOpening
from pkm_gym.envs.motion_rules import NOTHING, MotionRules
from pkm_gym.envs.motion_view import View, motion_layout
from pkm_gym.envs.rendering import Frame
from pkm_gym.mechanisms import make_problem
from pkm_gym.twin.camera import Camera
from pkm_gym.twin.rig import Rig

Observation = npt.NDArray[np.float32]
Info = dict[str, Any]

REASONS = ("finished", "off the path", "assembly mode", "loop open", "unstable")


class MotionEnv(gym.Env[Observation, npt.NDArray[Any]]):
    """An episode is one run along the path, the twin's motors driven by the agent.

    ## Description
    A design's MuJoCo twin stands at the start of its task's path: the Diamond's pick-and-place
    cycle, the 3-SPR's way down, across and up, the leg's step, the 6-PUS's engraving, or the
    5-PSS/UPU's Lissajous figure. The agent's actions are the motors' forces; it is to keep the tool
    on the path, which moves on whether the tool follows or not.

    MuJoCo takes ``frame_skip`` steps in each step of the environment, during which the forces are
    held. ``speed`` is how many times as fast as planned the path is run.

    | id | path | speed | step | steps |
    |---|---|---:|---:|---:|
    | PKM/DiamondMotion-v0 | 0.30 s | 1 | 1 ms | 300 |
    | PKM/SPR3Motion-v0 | 2.95 s; other designs have paths of other lengths | 20 | 5 ms | 590 |
    | PKM/StrokeLegMotion-v0 | 4 s, a step of ours | 0.5 | 6 ms | 667 |
    | PKM/PUS6Motion-v0 | 12.6 s, a spiral of ours on a tilted plane | 1 | 10 ms | 1263 |
    | PKM/PSS5UPUMotion-v0 | 4 s, a Lissajous figure of ours in five coordinates | 1 | 5 ms | 800 |

    ## Action Space
    ``Box(-1, 1, (k,), float32)`` for ``k`` motors: the force (N) or torque (N m) over
    ``force_limit``, in the order of the mechanism's joints. Values beyond are clipped, NaN and
    infinity are refused. By default the limit is three times what the paper's printed design needs
    on the path of the task, so that it is the same for all designs: a design that needs more
    has too weak motors.

    ## Observation Space
    ``Box(-1, 1, (size,), float32)``, clipped. ``observation_layout`` holds the slice of each part;
    t is the size of the twist, the *range* of a quantity what it takes on the path. Where a twist
    has angular velocities, turns (rotation vectors, rad) come before ways, at a lever of 0.1 m, in
    all that is t long and in the tool's distance from the path.

    | part | size | content |
    |---|---|---|
    | joints | k | from the middle of their ranges, over the widest range |
    | rates | k | over twice the largest rate on the path |
    | pose | p | from the middle of its ranges, over each range (at least a tenth of the widest) |
    | velocity | t | of the tool, over twice the path's largest speed |
    | error | t | tanh((path now - tool) / 5 mm) |
    | error_rate | t | tanh of the velocity that the tool lacks, over a tenth of the largest speed |
    | acceleration | t | that the path has now, over its largest |
    | path | 5 t | points 1, 2, 4, 8, 16 steps ahead less the one now, over the way at full speed |
    | time_left | 1 | share of the steps that are left |
    | design | d | its variables, the box to +-1 |
    | task | m | as a design environment shows it |

    ## Rewards
    The sum of three terms, each in ``info``:

    | term | of a step |
    |---|---|
    | reward_tracking | 1 - log(1 + e/1 mm) / log(1 + error_limit/1 mm), e = the tool's distance |
    | reward_effort | -effort_weight * mean of the squared actions |
    | reward_limit | -limit_weight * mean of max(0, (abs(action) - 0.9) / 0.1) |

    The first is 1 on the path, 0.82 at 1 mm and 0 at the error limit; it is 0 in a step that fails.

    ## Starting State
    At rest at the start of the path, or with ``start="anywhere"`` at a random step of it, moving
    with it. With ``start_offset`` each joint is off by a random share, up to that one, of the way
    to where the machine stands best. ``reset(options={"design": ..., "task":
    ...})`` gives the design, a mapping of the variables or an array (d,), and the task, a mapping
    of the fields that differ from the paper's or packed (m,), both in SI units, for this episode.

    ## Episode End
    ``terminated``, with ``info["reason"]``: "finished" at the end of the path, which the
    observation shows; "off the path" beyond ``error_limit``; "assembly mode" when the machine has
    left the modes that it was assembled in; "loop open" by more than ``loop_limit``; "unstable"
    when MuJoCo breaks down, where the last observation stays. ``truncated`` never.

    ## Info
    ``error`` (m), ``loop_gap`` (m), ``forces`` by joint (N or N m) and the terms of the reward;
    ``reason``, empty until the end; ``task``, ``design`` and their ``units``, ``force_limit`` (N or
    N m), ``steps`` and ``dt`` (s). The keys are always the same; after a reset forces and terms are
    0.

    ## Arguments
    See ``__init__``. Given as Python's numbers, strings, lists and mappings, or as a Task, they
    survive ``EnvSpec.to_json``; Gymnasium doesn't write arrays, paths, sets and enums.

    ## Version History
    * v0: initial version

    ## References
    The twins: docs/twins.md. The baselines and their scores: docs/environments/motion.md.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012 (Gymnasium's convention)

    rig: Rig  # the twin that is driven
    force_limit: float  # N or N m, what an action of 1 means
    _design: FloatArray
    _named: dict[str, dict[str, Any]]  # the info's task, design and their units
    _task: FloatArray = np.empty(0)
    _view: View

    def __init__(
        self,
        problem: str,
        *,
        design: Mapping[str, float] | Sequence[float] | FloatArray | None = None,
        speed: float | None = None,
        frame_skip: int | None = None,
        force_limit: float | None = None,
        error_limit: float = 0.05,
        loop_limit: float = 1e-3,
        effort_weight: float = 0.05,
        limit_weight: float = 0.1,
        start: str = "beginning",
        start_offset: float = 0.0,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        **arguments: Any,
    ) -> None:
        """Make the environment of a design problem whose mechanism has a twin.

        Args:
            problem: name of the problem, such as "diamond".
            design: the machine that is driven, by default the printed one: a mapping of the
                variables or an array (d,), SI units.
            speed: how many times as fast as planned; None: as the problem declares, or 1.
            frame_skip: steps of MuJoCo in a step; None: as the problem declares, or 5.
            force_limit: N or N m, what an action of 1 means; None: three times what the printed
                design needs on the path.
            error_limit: m, how far from the path the episode ends.
            loop_limit: m, how far open a loop may be.
            effort_weight: of the effort in the reward.
            limit_weight: of the torque limit in the reward.
            start: "beginning" of the path, or "anywhere" on it, which helps to learn.
            start_offset: from 0 to 0.1, the largest share of the way home that a joint starts off.
            render_mode: "rgb_array" or None; what the twin's camera sees, which needs OpenGL.
            width: of a picture, pixels.
            height: of a picture, pixels.
            arguments: of the problem, see ``pkm_gym.make_problem``; ``task`` among them.

        Raises:
            ValueError: for an unknown name, with its closest match, an illegal value, or a design
                that has no twin or can't follow the path.
        """
        check_arguments(problem, arguments, MotionEnv)
        if render_mode is not None:
            check_known("render_mode", [render_mode], self.metadata["render_modes"])
        check_whole("width", width)
        check_whole("height", height)
        self.problem = make_problem(problem, **arguments)
        usual = {"speed": 1.0, "frame_skip": 5} | dict(self.problem.declared.motion or {})
        self.rules = MotionRules(
            usual["speed"] if speed is None else speed,
            usual["frame_skip"] if frame_skip is None else frame_skip,
            force_limit, error_limit, loop_limit, effort_weight, limit_weight,
            start, start_offset,
        )  # fmt: skip
        self.render_mode = render_mode
        self.opening = MotionOpening(self.problem, self.rules, design)
        self._camera = Camera(width, height)
        self._build(*self.opening.chosen(None))
        self.observation_layout = motion_layout(self.problem, self.rig.twin.mechanism)
        size = self.observation_layout["task"].stop
        self.observation_space = spaces.Box(-1.0, 1.0, (size,), np.float32)
        motors = (len(self.rig.twin.motors),)
        self.action_space = spaces.Box(-1.0, 1.0, motors, np.float32)
        self.steps_done = 0
        self.error = 0.0  # m, how far the tool is from where the path is now
        self._over = True

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Info]:
        """Put the machine at the start of its path; see "Starting State" for the options.

        Raises:
            ValueError: for an unknown option, an illegal value, or a design that has no twin or
                can't follow the path; nothing has changed then but the seed.
        """
        super().reset(seed=seed)
        design, task = self.opening.chosen(options)
        if not (np.array_equal(design, self._design) and np.array_equal(task, self._task)):
            self._build(design, task)
        self.steps_done = self.opening.place(self.rig, self.np_random)
        self.error, self._over = self._distance(), False
        idle = np.zeros(len(self.rig.twin.motors))
        return self._view.see(self.steps_done), self._info("", idle)

    def step(self, action: npt.NDArray[Any]) -> tuple[Observation, float, bool, bool, Info]:
        """Let the motors give the action's forces for one step.

        Raises:
            ValueError: for a wrong shape or type, NaN or infinity; nothing has changed then.
            ResetNeeded: before the first reset and after the end of the episode.
        """
        action = np.clip(finite("action", action, self.action_space.shape or ()), -1.0, 1.0)
        if self._over:
            raise ResetNeeded("the episode is over or has not begun: call reset()")
        forces = self.force_limit * action
        self.rig.drive(forces)
        self.steps_done += 1
        self.error = self._distance()
        reason = self._reason()
        terms = self.rules.terms(self.error, action, failed=reason not in ("", "finished"))
        self._over = reason != ""
        info = self._info(reason, forces, terms)
        return self._view.see(self.steps_done), sum(terms.values()), self._over, False, info

    def render(self) -> Frame | None:
        """Return what the twin's camera sees (height, width, 3)."""
        if self.render_mode is None:
            gym.logger.warn("render() draws nothing: make the environment with a render_mode")
            return None
        return self._camera.shot(self.rig.twin)

    def close(self) -> None:
        """Close the camera."""
        self._camera.close()

    def save(self) -> FloatArray:
        """Return what the episode goes on from."""
        return np.concatenate([[self.steps_done], self.rig.save()])

    def load(self, saved: FloatArray) -> Observation:
        """Go on from what ``save`` returned, of the same design; return what is seen there."""
        self.steps_done, self._over = int(saved[0]), False
        self.rig.load(saved[1:])
        self.error = self._distance()
        return self._view.see(self.steps_done)

    def _distance(self) -> float:
        """Return how far the tool is from where the path is now, m."""
        return float(np.linalg.norm(self.rig.off(2 * self.steps_done)))

    def _reason(self) -> str:
        """Return why the episode ends, "" if it goes on."""
        if not self.rig.stable:
            return "unstable"
        if self.rig.state.gap > self.rules.loop_limit:
            return "loop open"
        if not self.rig.assembled:
            return "assembly mode"
        if self.error > self.rules.error_limit:
            return "off the path"
        return "finished" if self.steps_done == self.rig.path.steps else ""

    def _build(self, design: FloatArray, task: FloatArray) -> None:
        """Build the machine of a design, and what depends on the task."""
        rig = self.opening.rig(design, task)
        if not np.array_equal(task, self._task):
            self.force_limit = self.opening.force_limit(task)
        self._design, self._task, self.rig = design, task, rig
        self._view = View(rig, self.problem, design, task)
        units = {v.name: v.unit for v in self.problem.task_variables}
        self._named = {
            "task": dict(zip(units, task.tolist(), strict=True)),
            "design": self.problem.named(design),
            "units": units | {v.name: v.unit for v in self.problem.all_variables},
        }

    def _info(self, reason: str, forces: FloatArray, terms: Mapping[str, float] = NOTHING) -> Info:
        """Return what is said of a step, or of a reset, which earns nothing."""
        names = self.rig.twin.mechanism.joint_names
        return {
            "error": self.error,
            "loop_gap": self.rig.state.gap,
            "forces": dict(zip(names, forces.tolist(), strict=True)),
            **terms,
            "reason": reason,
            **{name: value.copy() for name, value in self._named.items()},
            "force_limit": self.force_limit,
            "steps": self.rig.path.steps,
            "dt": self.rig.dt,
        }
