"""Methods: what competes in the benchmark, each under its name and in its track."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

from pkm_gym.benchmark.record import TRACKS, Cost
from pkm_gym.benchmark.session import Session
from pkm_gym.benchmark.splits import closed_to
from pkm_gym.benchmark.view import View
from pkm_gym.core.names import check_known, module_of_yours
from pkm_gym.core.tally import TALLY
from pkm_gym.core.types import FloatArray

Start: TypeAlias = Literal["free", "given"]
Knowledge: TypeAlias = Literal["scratch", "transfer"]

Search: TypeAlias = Callable[[Session], None]
Propose: TypeAlias = Callable[[Session], FloatArray]
Prepare: TypeAlias = Callable[[View, Any], Search]  # a Training, or None
TrainingCost: TypeAlias = Callable[[str], Cost]
Files: TypeAlias = Callable[[str], Sequence[Path]]

# name -> where the method is, imported when asked for
METHODS = {
    "random": "pkm_gym.benchmark.scratch:random",
    "sobol": "pkm_gym.benchmark.scratch:sobol",
    "start+cobyqa": "pkm_gym.benchmark.scratch:start_cobyqa",
    "cobyqa": "pkm_gym.benchmark.scratch:cobyqa",
    "slsqp": "pkm_gym.benchmark.scratch:slsqp",
    "slsqp-margin": "pkm_gym.benchmark.scratch:slsqp_margin",
    "cobyla": "pkm_gym.benchmark.scratch:cobyla",
    "de": "pkm_gym.benchmark.scratch:de",
    "tpe": "pkm_gym.studies.benchmark.opponents:tpe",
    "tpe-4": "pkm_gym.studies.benchmark.opponents:tpe_4",
    "cmaes": "pkm_gym.studies.benchmark.opponents:cmaes",
    "cma-al": "pkm_gym.studies.benchmark.augmented:cma_al",
    "nsga2": "pkm_gym.studies.benchmark.opponents:nsga2",
    "gp": "pkm_gym.studies.benchmark.opponents:gp",
    "neighbours": "pkm_gym.benchmark.transfer:neighbours",
    "interpolated": "pkm_gym.benchmark.transfer:interpolated",
    "interpolated+cobyqa": "pkm_gym.benchmark.transfer:interpolated_cobyqa",
    "interpolated+slsqp": "pkm_gym.benchmark.transfer:interpolated_slsqp",
    "task-model": "pkm_gym.benchmark.task_model:task_model",
    "designer": "pkm_gym.agents.designers.opponents:designer",
    "neighbours+cmaes": "pkm_gym.studies.benchmark.opponents:neighbours_cmaes",
    "neighbours+tpe": "pkm_gym.studies.benchmark.opponents:neighbours_tpe",
}


@dataclass(frozen=True)
class Method:
    """A way to design for a task.

    Its track and what it cost before are what whoever enters it states.

    Attributes:
        prepare: given the view of the problem and the solved training tasks (None in the *scratch*
            track), returns the search that is then run on each task's session.
        start: the track "given" (the stored start is handed over) or "free" (it is not).
        knowledge: the track "transfer" (knows the training tasks) or "scratch" (knows nothing).
        evaluations: how many designs of a task it may evaluate at most.
        tasks: how many tasks of a split a quick run spends on it; None: as many as on the others.
        training: returns what it cost before the first task of a problem, besides the pool, for
            one that was trained before; the whole pool counts as its own then.
        files: returns what else its results on a problem depend on than its module and what that
            imports from its own folder, such as weights.
    """

    prepare: Prepare
    start: Start = "free"
    knowledge: Knowledge = "scratch"
    evaluations: int = 300
    tasks: int | None = None
    training: TrainingCost | None = None
    files: Files | None = None

    def __post_init__(self) -> None:
        """Refuse a track that there isn't, or that contradicts a training.

        Raises:
            ValueError: in one sentence.
        """
        for name, allowed in TRACKS.items():
            check_known(name, [getattr(self, name)], allowed)
        if self.training and self.knowledge == "scratch":
            raise ValueError(
                "a method with a training knows of other tasks: its knowledge is 'transfer', not "
                "'scratch'"
            )

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
    training: TrainingCost | None = None,
    files: Files | None = None,
) -> Callable[[Prepare], Method]:
    """Make a method of the function below: ``prepare(view, training) -> search``."""
    return lambda prepare: Method(prepare, start, knowledge, evaluations, tasks, training, files)


def proposing(propose: Propose) -> Search:
    """Return the search that evaluates what ``propose(session)`` returns.

    The session tells the task and all that was evaluated so far.
    """

    def search(session: Session) -> None:
        while True:
            session.evaluate(propose(session))

    return search


# module -> how many designs were evaluated while a method of it was looked up
_on_import: dict[str, int] = {}


def evaluated_on_import(name: str) -> int:
    """Return how many designs a method's module evaluated when ``find_method`` imported it."""
    return _on_import.get(method_module(name), 0)


def method_module(name: str) -> str:
    """Return the name of the module that a method is in."""
    return _place(name)[0]


def find_method(name: str) -> Method:
    """Return a method by its name, or by "module:attribute" for one of your own.

    Raises:
        ValueError: in one sentence, for an unknown name (with its closest match), a module that
            cannot be imported or an attribute that is no method.
    """
    if ":" not in name:
        check_known("method", [name], METHODS)
    module, attribute = _place(name)
    before = TALLY.designs
    try:
        with closed_to(name):
            chosen = getattr(module_of_yours(module), attribute, None)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module}.".startswith(f"{error.name}."):
            raise
        raise ValueError(f"method {name!r}: there is no module {error.name!r}") from None
    except ValueError:
        raise
    except Exception as error:  # whatever somebody's module does
        said = f"{type(error).__name__}: {(str(error).splitlines() or [''])[0]}"
        raise ValueError(f"method {name!r}: {module} can't be imported: {said}") from error
    _on_import[module] = _on_import.get(module, 0) + TALLY.designs - before
    if type(chosen) is not Method:
        raise ValueError(
            f"method {name!r}: {module} has no method {attribute!r}, as "
            "pkm_gym.benchmark.method makes one"
        )
    return chosen


def _place(name: str) -> tuple[str, str]:
    """Return module and attribute of a method."""
    module, _, attribute = METHODS.get(name, name).partition(":")
    return module, attribute
