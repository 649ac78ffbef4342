"""Designers found by name, shipped or the user's own; and those of training runs, by their file."""

from __future__ import annotations

from pathlib import Path

from platformdirs import user_data_path

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


def own_folder() -> Path:
    """Return the folder of the user's own designers."""
    return user_data_path("pkm_gym", appauthor=False) / "designers"


def known() -> dict[str, Path]:
    """Return the shipped designers and the user's own, which have other names: name -> file."""
    return shipped() | {path.stem: path for path in sorted(own_folder().glob(f"*{CONFIG}"))}


def designer_path(model: str) -> Path:
    """Return the file of a designer: a name that is known, a ``.json`` file, or a run's folder.

    Raises:
        ValueError: with the closest match, if there is none.
    """
    files = known()
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
        model: name of a designer, such as "DiamondFamily", its ``.json`` file or the folder of a
            training run.

    Raises:
        ValueError: in one sentence, if it is unknown, damaged, edited or of another version.

    Example:
        >>> session = load_designer("DiamondFamily").design({"payload": 1.5}, budget=12)
        >>> session.answer.designs[0]
    """
    return read_designer(designer_path(model))[0]


def designer_for(problem: DesignProblem) -> Designer:
    """Return the designer of a problem: the shipped one, or the user's own.

    Raises:
        ValueError: if none was trained for it, with these options.
    """
    return trained_for(problem)[0]


def trained_for(problem: DesignProblem) -> tuple[Designer, Origin]:
    """Return the designer of a problem, and where it comes from.

    Raises:
        ValueError: if none was trained for it, with these options.
    """
    designers = [read_designer(path) for path in known().values()]
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
