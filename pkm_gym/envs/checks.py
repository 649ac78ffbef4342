"""What is given from outside is checked before anything changes."""

from __future__ import annotations

from collections.abc import Mapping
from inspect import signature
from typing import Any

import numpy as np

from pkm_gym.core.names import check_known
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import problem_type


def finite(what: str, given: Any, *shapes: tuple[int, ...]) -> FloatArray:
    """Return finite numbers of one of the shapes as a new float64 array.

    Raises:
        ValueError: naming what was given and what is allowed.
    """
    try:
        array = np.asarray(given)
    except ValueError:  # nested lists of unequal lengths
        array = np.asarray(None)
    if array.dtype.kind not in "fiu" or array.shape not in shapes:
        allowed = " or ".join(map(str, dict.fromkeys(shapes)))
        raise ValueError(
            f"{what} must be numbers of shape {allowed}: got {array.dtype} of shape {array.shape}"
        )
    bad = ~np.isfinite(array)
    if bad.any():
        at = tuple(np.argwhere(bad)[0].tolist())
        raise ValueError(f"{what} must be finite: {array[at]} stands at {at}")
    return np.array(array, dtype=float)


def check_whole(what: str, given: Any) -> None:
    """Refuse what isn't a whole number of at least 1.

    Raises:
        ValueError: naming what was given.
    """
    if not isinstance(given, int) or isinstance(given, bool) or given < 1:
        raise ValueError(f"{what} is {given!r}: it must be a whole number of at least 1")


def check_arguments(problem: str, given: Mapping[str, Any], *takers: type) -> None:
    """Refuse an argument that neither an environment of these classes nor its problem takes.

    Raises:
        ValueError: naming it and its closest match, or for an unknown problem.
    """
    own = {name for taker in takers for name in signature(taker).parameters}
    known = (own - {"problem", "arguments"}) | problem_type(problem).argument_names()
    check_known("argument", given, known)
