"""Each statement of the 5-PSS/UPU's paper that a model can judge gets its verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.composite import Composite
from pkm_gym.mechanisms.pss5_upu.atlas import LARGE, NAMES
from pkm_gym.mechanisms.pss5_upu.claims import claims
from pkm_gym.mechanisms.pss5_upu.facts import Facts


@pytest.fixture(scope="module")
def facts():
    return Facts.of(pkm_gym.make_problem("pss5_upu"))


def verdict(found, *words):
    """The verdict on the only statement that has these words."""
    matching = [c.verdict for c in found if all(word in c.claim for word in words)]
    assert len(matching) == 1, words
    return matching[0]


def test_each_statement_of_the_paper_gets_its_verdict(facts):
    found = claims(facts)
    assert len(found) == 17
    for words, expected in (
        (("all performances",), "contradicted by our atlas"),
        (("redundant",), "contradicted: what is redundant counts more"),
        (("five freedoms",), "holds away from home only"),
        (("alpha = 0",), "contradicted"),
        (("eta_i",), "a slip: 0 <= eta_i <= 1"),
        (("four atlases",), "holds, but K_v and K_eta say the same"),
        (("different units",), "contradicted by Tables 1 and 2"),
        (("all four", "positively"), "holds of Table 3, not of our atlas"),
        (("stand for all",), "contradicted by Table 4"),
        (("map of F",), "contradicted by section 5 and by our atlas"),
        (("F is largest",), "not reproducible"),
        (("each single index",), "contradicted by Table 5"),
        (("rows 1 and 2",), "contradicted: row 2 doesn't either"),
        (("symmetric",), "reproduced"),
        (("nearer to the centre",), "holds of F, which hides that the centre is singular"),
        (("nearer a size",), "not reproducible"),
        (("less on experience",), "the samples take its place"),
    ):
        assert verdict(found, *words) == expected


def test_no_statement_is_told_twice(facts):
    told = [claim.claim for claim in (*claims(facts), *facts.reference.claims)]
    assert len(set(told)) == len(told)


def test_a_verdict_on_correlations_follows_table_3(facts):
    R = 0.9 * np.ones((4, 4)) + 0.1 * np.eye(4)
    alike = Composite.from_correlation(R, NAMES, directions=LARGE, population="alike")
    assert verdict(claims(replace(facts, printed=alike)), "stand for all") == "holds"
    R[0, 1] = R[1, 0] = -0.9
    R[2:, 2:], R[:2, 2:], R[2:, :2] = np.eye(2), 0.0, 0.0
    against = Composite.from_correlation(R, NAMES, directions=LARGE, population="against")
    found = claims(replace(facts, printed=against))
    assert verdict(found, "all four", "positively") == "contradicted by Table 3"


def test_a_verdict_on_machines_follows_their_order(facts):
    turned = replace(facts, rows=facts.rows[::-1])
    assert verdict(claims(turned), "nearer a size") == "holds"


def test_a_machine_without_the_singularity_has_five_freedoms(facts):
    skewed = replace(facts.rows[0], a3=0.45, b2=0.74, b3=-0.16)
    assert skewed.rank(skewed.home) == 6.0
    other = replace(facts, rows=(skewed, *facts.rows[1:]))
    assert verdict(claims(other), "five freedoms") == "holds"


def test_the_yaw_of_the_upu_limb_is_its_formula(facts):
    machine = facts.true
    x, y, z, beta, _ = machine.search_poses().T
    del x
    largest = np.degrees(np.arcsin(np.abs(y / z * np.tan(beta))).max())
    (said,) = (c.ours for c in claims(facts) if "alpha" in c.claim)
    assert f"{largest:.2f} deg" in said
