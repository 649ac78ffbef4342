"""Each statement under Figs 3-8 and in section 3.4 of the paper gets its verdict."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym
from pkm_gym.mechanisms.pus6.atlas import Atlas, lattice_atlas
from pkm_gym.mechanisms.pus6.claims import Maps, claims
from pkm_gym.mechanisms.pus6.mechanism import NAMES


@pytest.fixture(scope="module")
def maps():
    problem = pkm_gym.make_problem("pus6")
    indices = problem.evaluate(problem.grid()).indices
    box = np.stack([indices[name] for name in NAMES], axis=-1)
    return Maps(lattice_atlas(), box, problem.reference)


def test_each_statement_of_the_paper_gets_its_verdict(maps):
    found = claims(maps)
    verdicts = {claim.claim: claim.verdict for claim in found}

    def verdict(*words):
        matching = [v for said, v in verdicts.items() if all(word in said for word in words)]
        assert len(matching) == 1, words
        return matching[0]

    assert verdict("Fig. 8", "growing L") == "contradicted, by Table 2 too"
    assert verdict("Fig. 8", "growing R") == "holds over the different workspaces only"
    assert verdict("Fig. 3", "growing R") == "holds over the different workspaces only"
    assert verdict("Fig. 3", "best near") == "holds for R; no L stands out"
    for figure in ("Fig. 4", "Fig. 5", "Fig. 6", "Fig. 7", "Fig. 8"):
        assert verdict(figure, "best near") == "holds"
    assert verdict("Fig. 3", "hardly depends") == "holds for R 15–20 cm only"
    assert verdict("Fig. 7", "hardly depends") == "holds for R 10–11 cm only"
    assert verdict("Fig. 5", "largest") == "reproduced"
    assert verdict("Fig. 7", "isotropic") == "can't be"
    assert verdict("relatively good") == "holds, as max-min of the paper's averages"
    assert verdict("force and torque are not") == "depends on the unit of length"
    assert verdict("no design is best") == "holds"


@pytest.mark.parametrize("reverse", ["eta_v", "eta_I"])
def test_a_verdict_follows_the_averages(maps, reverse):
    k, turned = NAMES.index(reverse), maps.atlas
    means = turned.means.copy()
    means[:, k] = -means[:, k]
    other = Atlas(
        turned.designs, means, turned.poses, turned.different, turned.beyond, means.min(axis=0),
        means.max(axis=0),
    )  # fmt: skip
    found = claims(Maps(other, maps.box, maps.reference))
    best = next(claim for claim in found if claim.claim.startswith(f"Fig. {3 + k}") and
                "best near" in claim.claim)  # fmt: skip
    assert best.verdict == "contradicted"
