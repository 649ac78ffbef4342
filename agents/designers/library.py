"""The designers that are shipped, found by name; and those of training runs, by their file."""

from __future__ import annotations

from pathlib import Path

from pkm_gym.agents.designers.designer import Designer
from pkm_gym.agents.designers.files import read_designer
from pkm_gym.agents.runs.files import CONFIG, Origin
from pkm_gym.agents.runs.run import BEST
from pkm_gym.core.names import unknown
from pkm_gym.core.problem import DesignProblem

ZOO = Path(__file__).parents[1] / "zoo"


def shipped() -> dict[str, Path]:
    """Return the shipped designers: name -> file."""
    return {path.stem: path for path in sorted(ZOO.glob(f"*{CONFIG}"))}


def designer_path(model: str) -> Path:
    """Return the file of a designer: a shipped one's name, a ``.json`` file, or a run's folder.

    Raises:
        ValueError: with the closest match, if there is none.
    """
    files = shipped()
    if model in files:
        return files[model]
    path = Path(model)
    if (path / BEST).is_file():
        return path / BEST
    if path.suffix == CONFIG:
        return path
    raise ValueError(
        f"{unknown('designer', model, files)}; a run's folder or a .json file will do, too"
    )


def load_designer(model: str) -> Designer:
    """Load a trained designer; nothing is unpickled.

    Args:
        model: name of a shipped designer, such as "DiamondFamily", the ``.json`` file of one's own
            or the folder of a training run.

    Raises:
        ValueError: in one sentence, if it is unknown, damaged, edited or of another version.

    Example:
        >>> session = load_designer("DiamondFamily").design({"payload": 1.5}, budget=12)
        >>> session.answer.designs[0]
    """
    return read_designer(designer_path(model))[0]


def designer_for(problem: DesignProblem) -> Designer:
    """Return the shipped designer of a problem.

    Raises:
        ValueError: if none was trained for it, with these options.
    """
    return trained_for(problem)[0]


def trained_for(problem: DesignProblem) -> tuple[Designer, Origin]:
    """Return the shipped designer of a problem, and where it comes from.

    Raises:
        ValueError: if none was trained for it, with these options.
    """
    designers = [read_designer(path) for path in shipped().values()]
    own = [item for item in designers if item[0].problem.name == problem.name]
    if not own:
        raise ValueError(
            f"no designer of {problem.name} is shipped: train one with `pkm-gym train`, and give "
            "its folder as --model"
        )
    for designer, origin in own:
        if designer.problem.hash() == problem.hash():
            return designer, origin
    words = problem.declared.family_words
    raise ValueError(
        f"the designer of {problem.name} was trained with other variables, bounds or options: "
        f"{f'take those of its Family ({words})' if words else 'leave them as they come'}, or "
        "train one with `pkm-gym train`"
    )
