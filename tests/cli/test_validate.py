"""``pkm-gym validate``: indices against simulated motors."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.stats import rankdata

import pkm_gym
from pkm_gym.studies.twins.validation import scatter, validate


@pytest.fixture(scope="module")
def found():
    return validate(pkm_gym.make_problem("diamond", cycle=True), 8, seed=0)


def test_the_peak_torque_index_is_what_the_motors_give(found):
    least, median, largest = found.ratio("tau_peak")
    assert 0.9 < least <= median <= largest < 1.1
    assert found.errors.max() < 1e-3


def test_rank_correlation_is_that_of_the_ranks(found):
    for name, values in found.predicted.items():
        ranks = np.corrcoef(rankdata(values), rankdata(found.peaks))[0, 1]
        assert found.rank(name) == pytest.approx(ranks, abs=1e-12)


def test_the_plot_shows_every_design_in_both_panels(found):
    for axes in scatter(found).axes:
        assert len(axes.collections[0].get_offsets()) == 8


def test_table_and_json_say_the_same(run, tmp_path):
    words = ("validate", "diamond", "--designs", 3, "--seed", 2)
    content = json.loads(run(*words, "--json").stdout)
    assert list(tmp_path.iterdir()) == []
    text = run(*words).stdout
    for values in content["rows"]:
        assert f"{values['rank_correlation']:.4f}" in text
        assert f"{values['measured_over_index']['median']:.4g}" in text
    assert (tmp_path / "runs/diamond/validate.png").exists()


def test_a_problem_without_torque_indices_is_refused(refused):
    assert refused("validate", "spr3") == "spr3 has no tau_G and no tau_peak to validate"
