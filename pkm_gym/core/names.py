"""Names: unknown ones are answered with the closest match, "module:attribute" is imported."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from difflib import get_close_matches
from importlib import import_module
from types import ModuleType
from typing import Any


def unknown(kind: str, name: object, known: Iterable[str]) -> str:
    """Return the sentence that refuses ``name`` and offers what is known."""
    names = sorted(known)
    close = get_close_matches(str(name), names, n=1, cutoff=0.5)
    hint = f"did you mean {close[0]!r}?" if close else f"known: {', '.join(names)}"
    return f"unknown {kind} {name!r}; {hint}"


def check_known(kind: str, names: Iterable[object], known: Iterable[str]) -> None:
    """Refuse the first of ``names`` that is not ``known``.

    Raises:
        ValueError: naming the unknown one and its closest match.
    """
    allowed = set(known)
    for name in names:
        if name not in allowed:
            raise ValueError(unknown(kind, name, allowed))


def module_of_yours(name: str) -> ModuleType:
    """Import a module that a user names; the current folder is the last place that is looked at.

    An installed command doesn't have that folder on its path.
    """
    if "" not in sys.path:
        sys.path.append("")
    return import_module(name)


def imported(where: str) -> Any:
    """Return what is named "module:attribute", its module imported now."""
    module, _, attribute = where.partition(":")
    return getattr(import_module(module), attribute)
