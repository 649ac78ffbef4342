"""The registry: name -> design problem. A sixth mechanism is a folder and one line here."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from pkm_gym.core.names import check_known

if TYPE_CHECKING:
    from pkm_gym.core.problem import DesignProblem

REGISTRY = {
    "diamond": "pkm_gym.mechanisms.diamond.problem:DiamondProblem",
    "spr3": "pkm_gym.mechanisms.spr3.problem:Spr3Problem",
    "spr3_cylinder": "pkm_gym.mechanisms.spr3.cylinder:Spr3CylinderProblem",
}


def problems() -> tuple[str, ...]:
    """Return the names of the registered design problems."""
    return tuple(REGISTRY)


def problem_type(name: str) -> type[DesignProblem]:
    """Return the class of a registered design problem.

    Raises:
        ValueError: for an unknown name, with its closest match.
    """
    check_known("mechanism", [name], REGISTRY)
    module, _, attribute = REGISTRY[name].partition(":")
    found: type[DesignProblem] = getattr(import_module(module), attribute)
    return found


def make_problem(name: str, **arguments: Any) -> DesignProblem:
    """Make a design problem.

    Args:
        name: one of ``problems()``.
        arguments: ``task``, ``objective``, ``free``, ``fixed``, ``bounds`` and the mechanism's
            options; see ``DesignProblem`` and the mechanism's page.

    Raises:
        ValueError: for an unknown name, with its closest match, or an illegal value.

    Example:
        >>> problem = make_problem("diamond", task={"payload": 1.0})
        >>> evaluation = problem.evaluate(np.array([[0.6, 2.56, 0.41]]))
        >>> evaluation.indices["tau_G"]
    """
    return problem_type(name)(**arguments)
