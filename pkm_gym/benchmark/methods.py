"""Methods: what competes in the benchmark, each under its name and in its track."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Literal, TypeAlias

from pkm_gym.benchmark.evaluator import Evaluator
from pkm_gym.benchmark.record import Cost
from pkm_gym.core.names import check_known
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

Start: TypeAlias = Literal["free", "given"]
Knowledge: TypeAlias = Literal["scratch", "transfer"]

Search: TypeAlias = Callable[[Evaluator], None]
Propose: TypeAlias = Callable[[DesignProblem, FloatArray, Evaluator], FloatArray]
Prepare: TypeAlias = Callable[[DesignProblem, Pool], Search]
Training: TypeAlias = Callable[[str], Cost]
Files: TypeAlias = Callable[[str], Sequence[Path]]

# name -> where the method is, imported when asked for
METHODS = {
    "random": "pkm_gym.benchmark.scratch:random",
    "sobol": "pkm_gym.benchmark.scratch:sobol",
    "start+cobyqa": "pkm_gym.benchmark.scratch:start_cobyqa",
    "cobyqa": "pkm_gym.benchmark.scratch:cobyqa",
    "slsqp": "pkm_gym.benchmark.scratch:slsqp",
    "de": "pkm_gym.benchmark.scratch:de",
    "tpe": "pkm_gym.studies.benchmark.opponents:tpe",
    "tpe-4": "pkm_gym.studies.benchmark.opponents:tpe_4",
    "cmaes": "pkm_gym.studies.benchmark.opponents:cmaes",
    "nsga2": "pkm_gym.studies.benchmark.opponents:nsga2",
    "gp": "pkm_gym.studies.benchmark.opponents:gp",
    "neighbours": "pkm_gym.benchmark.transfer:neighbours",
    "interpolated": "pkm_gym.benchmark.transfer:interpolated",
    "interpolated+cobyqa": "pkm_gym.benchmark.transfer:interpolated_cobyqa",
    "designer": "pkm_gym.agents.designers.opponents:designer",
    "neighbours+cmaes": "pkm_gym.studies.benchmark.opponents:neighbours_cmaes",
    "neighbours+tpe": "pkm_gym.studies.benchmark.opponents:neighbours_tpe",
}


@dataclass(frozen=True)
class Method:
    """A way to design for a task.

    Attributes:
        prepare: given the problem and the solved training tasks (none of them in the *scratch*
            track), returns the search that is then run on each task.
        start: the track "given" (the stored start is handed over) or "free" (it is not).
        knowledge: the track "transfer" (knows the training tasks) or "scratch" (knows nothing).
        evaluations: how many designs of a task it may evaluate at most.
        tasks: how many tasks of a split a quick run spends on it; None: as many as on the others.
        training: returns what it cost before the first task of a problem, besides the pool.
        files: returns what else its results on a problem depend on, such as weights.
    """

    prepare: Prepare
    start: Start = "free"
    knowledge: Knowledge = "scratch"
    evaluations: int = 300
    tasks: int | None = None
    training: Training | None = None
    files: Files | None = None

    @property
    def track(self) -> str:
        """The track's name: methods of different tracks are never ranked in one table."""
        return f"{self.start}, {self.knowledge}"


def method(
    *,
    start: Start = "free",
    knowledge: Knowledge = "scratch",
    evaluations: int = 300,
    tasks: int | None = None,
    training: Training | None = None,
    files: Files | None = None,
) -> Callable[[Prepare], Method]:
    """Make a method of the function below: ``prepare(problem, pool) -> search``."""
    return lambda prepare: Method(prepare, start, knowledge, evaluations, tasks, training, files)


def proposing(propose: Propose) -> Search:
    """Return the search that evaluates what ``propose(problem, task, history)`` returns.

    ``task`` is packed (m,); ``history`` is the Evaluator with all that was evaluated so far.
    """

    def search(evaluator: Evaluator) -> None:
        while True:
            evaluator.evaluate(propose(evaluator.problem, evaluator.task, evaluator))

    return search


def find_method(name: str) -> Method:
    """Return a method by its name, or by "module:attribute" for one of your own.

    Raises:
        ValueError: in one sentence, for an unknown name (with its closest match), a module that
            cannot be imported or an attribute that is no method.
    """
    if ":" not in name:
        check_known("method", [name], METHODS)
    where = METHODS.get(name, name)
    module, _, attribute = where.partition(":")
    try:
        chosen = getattr(import_module(module), attribute, None)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module}.".startswith(f"{error.name}."):
            raise
        raise ValueError(f"method {name!r}: there is no module {error.name!r}") from None
    if type(chosen) is not Method:
        raise ValueError(
            f"method {name!r}: {module} has no method {attribute!r}, as "
            "pkm_gym.benchmark.method makes one"
        )
    return chosen
