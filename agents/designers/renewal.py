"""A designer of an older version of its problem, renewed if it still designs what it did."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pkm_gym.agents.designers.designer import Designer
from pkm_gym.agents.designers.files import read_designer
from pkm_gym.agents.designers.shipping import recorded
from pkm_gym.core.files import whole_file

CLOSE = 1e-6  # a share of the range: how near to the recorded ones its first designs must be
MOVED = 0.05  # a share of a recorded median regret: by more than this it is measured anew


def renew(path: Path) -> bool:
    """Write a designer's configuration anew with its problem's hash; return whether it changed.

    The median regrets of a shipped one are recorded anew where they have moved: those after many
    evaluations are so small that the last bits of the problem count.

    Raises:
        ValueError: in one sentence, for a file that is missing or damaged, or a designer that
            doesn't reproduce its recorded designs, or has none; the file is as it was then.
    """
    designer, origin = read_designer(path, older=True)
    config = json.loads(path.read_text(encoding="utf-8"))
    changed = bool(config["hash"] != designer.problem.hash())
    if origin.recorded:
        _check(path, designer, origin.recorded)
        changed |= _remeasured(config, designer)
    elif changed:
        raise ValueError(
            f"the designer {path.stem!r} of another version of {designer.problem.name} records no "
            "designs, as shipped ones do, to be held against: train it again"
        )
    if not changed:
        return False
    with whole_file(path) as part:
        renewed = {**config, "hash": designer.problem.hash()}
        part.write_text(json.dumps(renewed, indent=2) + "\n", encoding="utf-8")
    return True


def _remeasured(config: dict[str, Any], designer: Designer) -> bool:
    """Put the median regrets that it has now into a configuration; return whether they moved."""
    kept, now = config["origin"]["recorded"]["regrets"], recorded(designer)["regrets"]
    moved = any(abs(now[k] - kept[k]) > MOVED * kept[k] for k in kept)
    if moved:
        config["origin"]["recorded"]["regrets"] = now
    return moved


def _check(path: Path, designer: Designer, kept: Mapping[str, Any]) -> None:
    designs = designer.design(np.array(kept["tasks"])).designs[:, 0]
    off = np.abs(designs - kept["designs"]) / (designer.problem.high - designer.problem.low)
    if not off.max() <= CLOSE:
        raise ValueError(
            f"the designer {path.stem!r} no longer designs what it did (off by {off.max():.1e} of "
            "the range): train it again"
        )
