"""design.toml: a design with its task and options, written by verbs that find one, read by all."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from importlib.metadata import version
from math import isfinite
from pathlib import Path
from typing import Any

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.files import whole_file
from pkm_gym.core.names import check_known
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reading import read_toml, shaped
from pkm_gym.mechanisms import address, called
from pkm_gym.studies.cli.words import evaluate_command, option_word

TABLES = ("task", "options", "design", "indices")


@dataclass(frozen=True)
class DesignFile:
    """What a file says, checked.

    Attributes:
        path: of the file.
        task: task fields in SI.
        options: of the problem, as ``--set`` takes them.
        design: variables in SI.
        objectives: names of what was optimised.
        values: the indices that were written beside them, in SI.
        notes: what the user should know of it.
    """

    path: Path
    task: dict[str, float]
    options: dict[str, str]
    design: dict[str, float]
    objectives: list[str]
    values: dict[str, float]
    notes: tuple[str, ...]

    def words(self, *, design: bool) -> dict[str, str]:
        """Return it as ``--set`` takes it, with or without the design."""
        words = {f"task.{name}": repr(value) for name, value in self.task.items()} | self.options
        return words | ({k: repr(x) for k, x in self.design.items()} if design else {})

    def differences(self, evaluation: Evaluation) -> tuple[str, ...]:
        """Say which of its indices the model doesn't give."""
        now = {name: float(values[0]) for name, values in evaluation.indices.items()}
        return tuple(
            f"{self.path} says {name} = {value:.9g}, the model {now[name]:.9g}"
            for name, value in self.values.items()
            if name in now and abs(now[name] - value) > 1e-9 * max(abs(value), 1e-300)
        )


def write_design(path: Path, best: Evaluation, found_by: str) -> Path:
    """Write the first design of an evaluation, its problem's task, options, dimensions, indices.

    Args:
        path: of the file; its folder is made.
        best: an evaluation of designs for the problem's own task; the first is written.
        found_by: the command that found it.
    """
    problem, design = best.problem, best.designs[0]
    indices = {name: float(values[0]) for name, values in best.indices.items()}
    sizes = problem.derived(design)
    content: dict[str, Any] = {
        "problem": called(problem),
        "version": problem.declared.version,
        "pkm_gym": version("pkm_gym"),
        "objectives": [objective.name for objective in problem.objectives],
        "feasible": bool(best.feasible[0]),
        "found_by": found_by,
        "evaluate": evaluate_command(problem, design),
        "task": asdict(problem.task),
        "options": {k: _plain(v) for k, v in asdict(problem.options).items() if v is not None},
        "design": problem.named(design),
        "dimensions": {k: {"value": x, "unit": unit} for k, (x, unit) in sizes.items()},
        "indices": {k: x for k, x in indices.items() if isfinite(x)},
    }
    import tomli_w

    with whole_file(path) as part:
        part.write_text(
            "# SI units: m, rad, kg, s, N m. Verbs read it with --design FILE.\n"
            f"{tomli_w.dumps(content)}",
            encoding="utf-8",
        )
    return path


def read_design(path: Path, kind: type[DesignProblem]) -> DesignFile:
    """Read a design of a problem.

    Raises:
        ValueError: in one sentence that names the file, for what is no design of the problem.
    """
    if not path.is_file():
        raise ValueError(f"there is no design file {str(path)!r}: `pkm-gym polish` writes one")
    content = read_toml(path, "design file")
    try:
        return _checked(path, content, kind)
    except (ValueError, TypeError) as error:  # a list in the place of a word can't be looked up
        raise ValueError(f"{str(path)!r}: {error}") from None


def _checked(path: Path, content: dict[str, Any], kind: type[DesignProblem]) -> DesignFile:
    name = content.get("problem")
    if name not in (kind.name, address(kind)):
        raise ValueError(f"it holds a design of {name!r}, not of {kind.name}")
    if missing := [f"[{table}]" for table in TABLES if table not in content]:
        raise ValueError(f"it lacks the table {', '.join(missing)}")
    numbers = {
        table: shaped(dict[str, float], content[table], table)
        for table in TABLES
        if table != "options"
    }
    design, options = numbers["design"], shaped(dict[str, Any], content["options"], "options")
    known = kind.options_type.of(options)
    kind.task_type.of(numbers["task"])
    names = [variable.name for variable in kind.all_variables]
    check_known("variable", design, names)
    if missing := [name for name in names if name not in design]:
        raise ValueError(f"its design lacks {', '.join(missing)}")
    objectives = content.get("objectives", [])
    if not isinstance(objectives, list) or not objectives:
        raise ValueError("its objectives must be a list of names")
    check_known("objective", objectives, [item.name for item in kind.all_objectives])
    written = content.get("version")
    notes: list[str] = []
    if written != kind.declared.version:
        now = kind.declared.version
        notes.append(f"{path} is of version {written!r} of {kind.name}, this is {now!r}")
    return DesignFile(
        path,
        numbers["task"],
        {key: option_word(getattr(known, key)) for key in options},
        numbers["design"],
        objectives,
        numbers["indices"],
        tuple(notes),
    )


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
