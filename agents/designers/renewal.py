"""A designer of an older version of its problem, renewed if it still designs what it did."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from pkm_gym.agents.designers.files import read_designer
from pkm_gym.core.files import whole_file

CLOSE = 1e-6  # a share of the range: how near to the recorded ones its first designs must be


def renew(path: Path) -> bool:
    """Write a designer's configuration anew with its problem's hash; return whether it changed.

    Raises:
        ValueError: in one sentence, for a file that is missing or damaged, or a designer that
            doesn't reproduce its recorded designs; the file is as it was then.
    """
    designer, origin = read_designer(path, older=True)
    problem, recorded = designer.problem, origin.recorded
    designs = designer.design(np.array(recorded["tasks"])).designs[:, 0]
    off = np.abs(designs - recorded["designs"]) / (problem.high - problem.low)
    if not off.max() <= CLOSE:
        raise ValueError(
            f"the designer {path.stem!r} no longer designs what it did (off by {off.max():.1e} of "
            "the range): train it again"
        )
    config = json.loads(path.read_text(encoding="utf-8"))
    if config["hash"] == problem.hash():
        return False
    with whole_file(path) as part:
        renewed = {**config, "hash": problem.hash()}
        part.write_text(json.dumps(renewed, indent=2) + "\n", encoding="utf-8")
    return True
