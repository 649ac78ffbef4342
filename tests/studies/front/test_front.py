"""The front of several objectives: gathered from studies, its hypervolume, what is preferred."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.studies.front.front import front, hypervolume, losses_of, objectives_searched
from pkm_gym.studies.front.report import content, marked
from pkm_gym.studies.front.weighing import (
    preferred,
    principal_components,
    tolerance_weighted,
    weighted_sum,
)
from pkm_gym.studies.storage.storages import default_storage
from pkm_gym.studies.storage.studies import designs_of

BOTH = ("tau_G", "sigma_min")  # one is minimised, one maximised
WHERE = default_storage("diamond")


@pytest.fixture
def both() -> DesignProblem:
    """The Diamond with two objectives, of both directions."""
    return pkm_gym.make_problem("diamond", objective=BOTH)


@pytest.fixture
def found(searched, both):
    """A random search for two objectives, and its front."""
    study = searched(both, trials=70, batch=70, warm_start=["paper"]).study
    return study, front(both, WHERE)


# Hypervolume --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("losses", "reference", "volume"),
    [
        ([[1.0, 2.0]], [3.0, 3.0], 2.0),
        ([[1.0, 2.0], [2.0, 1.0]], [3.0, 3.0], 3.0),
        ([[1.0, 2.0], [2.0, 1.0], [2.5, 2.5], [4.0, 0.0]], [3.0, 3.0], 3.0),
        ([[0.0, 0.0, 0.0], [-1.0, 0.5, 0.5]], [1.0, 1.0, 1.0], 1.0 + 0.25),
        ([[3.0, 1.0]], [3.0, 3.0], 0.0),
    ],
)
def test_the_hypervolume_of_a_few_points_is_the_one_counted_by_hand(losses, reference, volume):
    assert hypervolume(np.array(losses), np.array(reference)) == pytest.approx(volume, rel=1e-12)


def test_the_hypervolume_is_the_share_of_random_points_that_the_front_dominates(rng):
    losses, points = rng.random((12, 3)), rng.random((20000, 3))
    share = (losses[:, None] <= points).all(axis=2).any(axis=0).mean()
    assert hypervolume(losses, np.ones(3)) == pytest.approx(share, abs=4.0 / np.sqrt(20000))


# Gathering ----------------------------------------------------------------------------------------


def test_the_front_is_the_feasible_designs_that_no_other_beats(found, both):
    study, known = found
    evaluation = both.evaluate(designs_of(study, both))
    losses = losses_of(evaluation)[evaluation.feasible]
    best = [x for x in losses if not ((losses <= x).all(1) & (losses < x).any(1)).any()]
    np.testing.assert_array_equal(known.losses, sorted(best, key=lambda row: row[0]))
    assert len(known.feasible) == evaluation.feasible.sum()
    assert known.finished == 70
    for (name, number), design in zip(known.trials, known.found.designs, strict=True):
        assert name == study.study_name
        assert list(study.trials[number].params.values()) == design.tolist()


def test_a_design_found_twice_stands_on_the_front_once(searched, both):
    searched(both, trials=30, name="a", seed=3)
    searched(both, trials=30, name="b", seed=3)
    known = front(both, WHERE)
    assert known.finished == 60
    assert {name for name, _ in known.trials} == {"a"}
    assert len(known.found) == len(front(both, WHERE, name="b").found)


def test_studies_of_the_same_objectives_in_another_order_count(searched, both):
    searched(both, trials=40, name="a", seed=3)
    searched(both.with_objectives(*reversed(BOTH)), trials=40, name="b", seed=4)
    searched(both.with_task({"payload": 1.0}), trials=40, name="c", seed=5)
    assert front(both, WHERE).finished == 80


def test_the_reference_lies_a_tenth_beyond_the_optima_and_is_kept(found, both):
    known = found[1]
    rows = [both.evaluate(both.design(row.design)[None]) for row in known.optima.values()]
    values = np.array([row.objectives[0] for row in rows])
    expected = [values[:, 0].max() + 0.1 * np.ptp(values[:, 0])]
    expected += [values[:, 1].min() - 0.1 * np.ptp(values[:, 1])]
    assert list(known.reference.values()) == pytest.approx(expected, rel=1e-12)
    other = {"tau_G": 0.5, "sigma_min": 0.6}
    assert front(both, WHERE, reference=other).reference == other
    again = front(both, WHERE)
    assert again.reference == other
    assert again.hypervolume > known.hypervolume
    box = (0.5 - known.optima["tau_G"].value) * (known.optima["sigma_min"].value - 0.6)
    assert again.share == pytest.approx(again.hypervolume / box, rel=1e-12)
    assert 0.0 < again.share < 1.0


def test_what_was_searched_is_known_where_it_is_one_set(searched, both):
    kind = type(both)
    searched(both.with_objectives("tau_G"), trials=2, name="one")
    with pytest.raises(ValueError, match="no study has searched several objectives: `pkm-gym"):
        objectives_searched(kind, WHERE)
    searched(both, trials=2, name="two")
    assert objectives_searched(kind, WHERE) == list(BOTH)
    searched(both.with_objectives("tau_G", "condition"), trials=2, name="three")
    with pytest.raises(ValueError, match="choose with --objective"):
        objectives_searched(kind, WHERE)


@pytest.mark.parametrize(
    ("objectives", "arguments", "said"),
    [
        (("tau_G",), {}, "a front needs two objectives or more: diamond has tau_G, "),
        (("tau_G", "condition"), {}, "no study has searched several objectives"),
        (BOTH, {"name": "aa"}, "unknown study 'aa'"),
        (BOTH, {"name": "one"}, "the study 'one' searches tau_G, not tau_G and sigma_min"),
        (BOTH, {"reference": {"tau": 1.0}}, "unknown objective 'tau'; did you mean 'tau_G'"),
        (BOTH, {"reference": {"tau_G": 1.0}}, "the reference point lacks sigma_min"),
    ],
)
def test_what_makes_no_front_is_refused(searched, both, objectives, arguments, said):
    searched(both, trials=20, seed=1)
    searched(both.with_objectives("tau_G"), trials=2, name="one")
    with pytest.raises(ValueError, match=said):
        front(both.with_objectives(*objectives), WHERE, **arguments)


def test_a_problem_of_one_objective_has_no_front():
    with pytest.raises(ValueError, match="spr3 has one objective, gci"):
        front(pkm_gym.make_problem("spr3"), WHERE)


# Weighing -----------------------------------------------------------------------------------------


def test_all_weight_on_one_objective_descends_to_its_optimum(found):
    known = found[1]
    for objective, row in known.optima.items():
        best = preferred(known, weighted_sum(known, {objective: 1.0}))
        assert best.feasible[0]
        assert best.indices[objective][0] == pytest.approx(row.value, rel=1e-6)


def test_what_is_preferred_is_feasible_and_no_worse_than_the_front(found):
    known = found[1]
    ways = [weighted_sum(known), tolerance_weighted(known), principal_components(known)]
    for way in ways:
        best = preferred(known, way)
        assert best.feasible[0]
        assert way(losses_of(best))[0] <= way(known.losses).min()
    tight = tolerance_weighted(known, {"tau_G": 1e-3, "sigma_min": 10.0})
    loose = tolerance_weighted(known, {"tau_G": 10.0, "sigma_min": 1e-3})
    ends = [preferred(known, way).indices["tau_G"][0] for way in (tight, loose)]
    assert ends[0] < ends[1]


def test_what_is_preferred_is_the_best_of_ever_finer_grids(found, both):
    way = tolerance_weighted(found[1])
    low, high = both.low, both.high
    for _ in range(9):
        axes = [np.linspace(*ends, 21) for ends in zip(low, high, strict=True)]
        grid = both.evaluate(np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3))
        number = np.where(grid.feasible, way(losses_of(grid)), np.inf)
        best, reach = grid.designs[number.argmin()], 0.2 * (high - low)
        low, high = np.maximum(best - reach, both.low), np.minimum(best + reach, both.high)
    answer = way(losses_of(preferred(found[1], way)))[0]
    assert number.min() * (1.0 - 1e-3) < answer <= number.min()


# Handing over -------------------------------------------------------------------------------------


def test_the_table_holds_the_front_and_what_is_beside_it_with_all_digits(found, both):
    known = found[1]
    marks = marked(known, [weighted_sum(known)])
    names = ["paper, our model", "optimum of tau_G", "optimum of sigma_min", "weighted"]
    assert [mark.name for mark in marks] == names
    told = content(known, marks)
    rows = told["rows"]
    assert [row["what"] for row in rows] == ["front"] * len(known.found) + names
    designs = np.array([[row["design"][name] for name in both.variable_names] for row in rows])
    again = both.evaluate(designs)
    found = [[row["objectives"][name] for name in BOTH] for row in rows]
    np.testing.assert_array_equal(found, again.objectives)
    assert told["reference_point"] == known.reference


def test_a_picture_shows_each_pair_of_objectives(searched, both):
    from pkm_gym.studies.front.picture import front_figure

    three = both.with_objectives(*BOTH, "condition")
    searched(three, trials=60, batch=60, warm_start=["paper"])
    known = front(three, WHERE)
    figure = front_figure(known, marked(known, []))
    assert len(figure.axes) == 3
    assert {axes.get_xlabel() for axes in figure.axes} == {
        r"$\tau_{G}$ (N·m/(m/s²))",
        r"$\sigma_{\mathrm{min}}$",
    }
    legend = [text.get_text() for text in figure.axes[-1].get_legend().get_texts()]
    assert legend[:4] == ["feasible trials", "front", "reference point", "paper, our model"]
    shown = [axes.lines[1].get_xydata() for axes in figure.axes]
    np.testing.assert_array_equal(shown[0], known.found.objectives[:, :2])
