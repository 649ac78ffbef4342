"""``pkm-gym new``: a mechanism of one's own, begun as a small package that passes its tests."""

from __future__ import annotations

import re
from collections.abc import Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable
from importlib.util import find_spec
from keyword import iskeyword
from pathlib import Path
from string import Template
from typing import Annotated

import typer

from pkm_gym.core.declaration import environment_name
from pkm_gym.mechanisms import addresses
from pkm_gym.studies.cli.options import output_option

TEMPLATE = "template"
SUFFIX = ".txt"  # of a template's files, after that of what they become
PACKAGE = "package"  # the folder that gets the mechanism's name


def command(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="Of the mechanism and its package: five_bar.")
    ],
    output: Annotated[
        Path | None, output_option("Where it goes; ./NAME if not said.", "FOLDER")
    ] = None,
) -> None:
    """Begin a mechanism of your own: a package with a planar example that is yours to replace.

    It passes its own tests, and every verb, environment and benchmark takes it.

    Example: pkm-gym new five_bar
    """
    check_name(name)
    folder = output or Path(name)
    if folder.exists():
        raise ValueError(f"{str(folder)!r} exists: choose another folder with -o")
    for place, text in written(name):
        path = folder / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        print(path)
    print(f"\ncd {folder}\npython -m pytest\npkm-gym evaluate {name}.problem:{class_name(name)}")


def check_name(name: str) -> None:
    """Refuse what is no name of a mechanism, or one that something else has.

    Raises:
        ValueError: in one sentence, with a name that would do.
    """
    if re.fullmatch(r"[a-z][a-z0-9_]*", name) is None or iskeyword(name):
        plain = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_0123456789")
        close = f"; did you mean {plain!r}?" if plain and not iskeyword(plain) else ""
        raise ValueError(
            f"{name!r} is no name of small letters, digits and _ that begins with a letter{close}"
        )
    taken = addresses().get(name) or (name if find_spec(name) else "")
    if taken:
        raise ValueError(f"{name!r} is taken by {taken}: choose another name, such as 'my_{name}'")


def class_name(name: str) -> str:
    """Return the name of the problem's class."""
    return f"{environment_name(name)}Problem"


def written(name: str) -> Iterator[tuple[Path, str]]:
    """Yield the files of a mechanism's package: where each goes, and its text."""
    words = {"name": name, "Name": environment_name(name)}
    root = files("pkm_gym.studies") / TEMPLATE
    for place, text in sorted(_texts(root, Path())):
        parts = [name if part == PACKAGE else part for part in place.parts]
        yield Path(*parts), Template(text).substitute(words)


def _texts(folder: Traversable, place: Path) -> Iterator[tuple[Path, str]]:
    for item in folder.iterdir():
        if item.is_dir():
            yield from _texts(item, place / item.name)
        else:
            yield place / item.name.removesuffix(SUFFIX), item.read_text(encoding="utf-8")
