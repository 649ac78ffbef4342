"""Search a design space with Optuna, resumable, in batches, by workers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from optuna import Study
from optuna_dashboard import get_note  # type: ignore[attr-defined]  # has no __all__
from rich.console import Console

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.units import show as show_value
from pkm_gym.studies.cli.runs import if_full
from pkm_gym.studies.cli.terminal import counter
from pkm_gym.studies.dashboard.graphs import write_graphs
from pkm_gym.studies.dashboard.notes import write_note
from pkm_gym.studies.dashboard.pictures import Pictures
from pkm_gym.studies.report.rows import known_rows
from pkm_gym.studies.search.runner import Report, Runner, answer
from pkm_gym.studies.search.samplers import check_sampler, sampler_for, values_for
from pkm_gym.studies.search.starts import enqueue, warm_designs
from pkm_gym.studies.storage.storages import artifact_folder, default_storage, open_storage, quiet
from pkm_gym.studies.storage.studies import count_finished, fail_stale, open_study, version_note

TRIALS = 500
KEPT = "every finished trial is kept, and the same command goes on from there"


@dataclass(frozen=True)
class SearchResult:
    """What came of a search.

    Attributes:
        study: Optuna's study.
        best: the evaluation of the answer, one design.
        trial: number of its trial.
        storage: where the study is.
        finished: how many trials have values.
        stopped: whether Ctrl-C ended it early.
        note: what is worth saying of the study, or nothing.
    """

    study: Study
    best: Evaluation
    trial: int
    storage: str
    finished: int
    stopped: bool
    note: str


def search(
    problem: DesignProblem,
    *,
    sampler: str = "tpe",
    trials: int = TRIALS,
    seed: int = 0,
    storage: str | None = None,
    name: str | None = None,
    warm_start: Sequence[str] = (),
    batch: int = 1,
    jobs: int = 1,
    worker: int = 0,
    command: str = "",
    report: Report | None = None,
) -> SearchResult:
    """Search until the study has ``trials`` finished trials; a study that exists is resumed.

    Args:
        problem: what is searched, with its task.
        sampler: "tpe", "cmaes", "gp", "nsga2", "nsga3", "qmc", "random", or "designer": a trained
            one.
        trials: the target total.
        seed: of the sampler.
        storage: a journal file or a database URL; the problem's journal under runs/ by default.
        name: of the study; problem and sampler by default.
        warm_start: "paper", "grid", "designer:4" (the first four designs of a trained one) or names
            of studies in the storage, tried first.
        batch: designs an ``evaluate``.
        jobs: threads.
        worker: number of this process among those that share the study.
        command: kept with a new study.
        report: called after each batch with the finished trials and the best design.

    Raises:
        ValueError: in one sentence, for what isn't possible; the study is as it was then.
    """
    check_sampler(sampler, len(problem.objectives))
    for what, number in (("trials", trials), ("batch", batch), ("jobs", jobs)):
        if number < 1:
            raise ValueError(f"{what} is {number}: it must be at least 1")
    if sampler == "designer" and max(batch, jobs) > 1:
        raise ValueError(
            "the sampler designer proposes one design at a time: leave --batch and --jobs at 1"
        )
    where, values = storage or default_storage(problem.name), values_for(sampler)
    folder = artifact_folder(where)
    with quiet(), if_full(KEPT, folder):
        starts = [warm_designs(problem, source, where) for source in warm_start]
        sampler_for(problem, sampler, seed=seed)  # what it refuses leaves nothing behind
        store = open_storage(where)
        study = open_study(
            problem, store, name or f"{problem.name}-{sampler}", values=values, command=command
        )
        fail_stale(study, worker)
        begun = len(study.get_trials(deepcopy=False))
        study.sampler = sampler_for(problem, sampler, seed=seed, start=begun, worker=worker)
        if sampler == "cmaes" and begun == 0:
            # Its first trial belongs to no generation: let it be the mean of the first one.
            starts.insert(0, 0.5 * (problem.low + problem.high)[None])
        if count_finished(study) < trials:
            enqueue(study, problem, starts)
        pictures = Pictures(problem, study, folder)
        runner = Runner(
            study,
            problem,
            trials=trials,
            values=values,
            batch=batch,
            worker=worker,
            pictures=pictures,
            report=report,
        )
        stopped = runner.run(jobs)
        best, trial = answer(study, problem)
        title = f"best, trial {trial}"
        if runner.ran or title not in get_note(study):
            addresses = pictures.draw(study.get_trials(deepcopy=False)[trial], best.designs[0])
            write_note(study, best, title, addresses)
            write_graphs(study, problem, known_rows(problem))
    return SearchResult(
        study, best, trial, where, count_finished(study), stopped, version_note(study)
    )


@contextmanager
def search_bar(screen: Console, problem: DesignProblem, trials: int) -> Iterator[Report]:
    """Give the report of a search that moves a bar and shows the best value so far."""
    progress = counter(screen, "trials")
    first = problem.objectives[0]
    line = progress.add_task("starting", total=trials)

    def report(count: int, best: Evaluation) -> None:
        value = f"best {first.name} {show_value(best.objectives[0, 0], first.unit)}"
        words = value if best.feasible[0] else "none feasible yet"
        progress.update(line, completed=count, description=words)

    with progress:
        yield report
