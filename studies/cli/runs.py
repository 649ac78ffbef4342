"""Where the results of verbs go, and the command that asked for them."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pkm_gym.core.files import FULL
from pkm_gym.mechanisms import problem_type

RUNS = Path("runs")


def run_folder(name: str) -> Path:
    """Return the folder of a problem's results."""
    return RUNS / name


def output_path(out: Path | None, name: str, stem: str, forms: tuple[str, ...]) -> Path:
    """Return where to write: ``out``, or a file of the first form in the problem's folder.

    Args:
        out: the file, if one was said.
        name: of the problem, or "module:Class".
        stem: of the file in the problem's folder.
        forms: endings that the file's name may have.

    Raises:
        ValueError: for an unknown problem, or a file's name of another form.
    """
    path = out or run_folder(problem_type(name).name) / f"{stem}{forms[0]}"
    if path.suffix.lower() not in forms:
        raise ValueError(f"can't write {str(path)!r}: its name must end in {' or '.join(forms)}")
    return path


def file_name(text: str) -> str:
    """Return a text as the name of a file on any system."""
    return re.sub(r"[^A-Za-z0-9.=_+-]", "-", text)


def own_command() -> str:
    """Return the command line as it was typed, without passwords."""
    return redacted(shlex.join(["pkm-gym", *sys.argv[1:]]))


def redacted(text: str) -> str:
    """Return a text without the passwords of the URLs in it."""
    return re.sub(r"(://[^/@:\s]*):[^/\s]*@", r"\1:***@", text)


@contextmanager
def if_full(kept: str, place: Path) -> Iterator[None]:
    """Say what is kept all the same where no more can be written.

    Args:
        kept: a sentence's second half.
        place: where it was written, if the error doesn't say it.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in FULL:
            raise
        reason = f"{error.strerror}; {kept}"
        raise OSError(error.errno, reason, str(error.filename or place)) from error
