"""pkm_gym: a gymnasium for designing parallel kinematic machines.

``problems()`` names the design problems and ``make_problem(name)`` makes one; importing the package
registers its Gymnasium environments, ``PKM/...``.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from pkm_gym.envs.registration import register_environments

if TYPE_CHECKING:
    from pkm_gym.core.pool import Pool
    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.solve import polish, solve_tasks
    from pkm_gym.envs.design import DesignEnv
    from pkm_gym.envs.vector import DesignVectorEnv
    from pkm_gym.envs.wrappers import DesignGrid, FixedTasks
    from pkm_gym.mechanisms import make_problem, problems, register

_HOMES = {
    "DesignEnv": "pkm_gym.envs.design",
    "DesignGrid": "pkm_gym.envs.wrappers",
    "DesignProblem": "pkm_gym.core.problem",
    "DesignVectorEnv": "pkm_gym.envs.vector",
    "FixedTasks": "pkm_gym.envs.wrappers",
    "Pool": "pkm_gym.core.pool",
    "make_problem": "pkm_gym.mechanisms",
    "polish": "pkm_gym.core.solve",
    "problems": "pkm_gym.mechanisms",
    "register": "pkm_gym.mechanisms",
    "solve_tasks": "pkm_gym.core.solve",
}

__all__ = [
    "DesignEnv",
    "DesignGrid",
    "DesignProblem",
    "DesignVectorEnv",
    "FixedTasks",
    "Pool",
    "make_problem",
    "polish",
    "problems",
    "register",
    "solve_tasks",
]

register_environments()


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
