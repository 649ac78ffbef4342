"""The two design problems: their numbers, samples, limits and what they say."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.stats.qmc import Sobol

import pkm_gym
from pkm_gym.core.merit import TOLERANCE
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import solve_tasks
from pkm_gym.mechanisms.pss5_upu.declared import LEAST_COSINE, SAMPLINGS
from pkm_gym.mechanisms.pss5_upu.extremes import nodes
from pkm_gym.mechanisms.pss5_upu.indices import unit_poses
from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu
from pkm_gym.twin.check import random_designs

from .conftest import BEST, GOOD, around
from .model import Model

PROBLEMS = ("pss5_upu", "pss5_upu_skew")
NAMES = ("K_v", "K_w", "K_lambda", "K_eta")


def problem_of(name: str, **arguments: object) -> DesignProblem:
    return pkm_gym.make_problem(name, **arguments)


def design_of(of: dict, n: float = 0.5) -> np.ndarray:
    """A layout of the page as a design (1, 8) of the skew problem."""
    off = np.subtract([*of["q"], *of["b"]], [72.0, 144.0, 72.0, 144.0])
    angles = np.radians([of["theta"], *off])
    return np.array([[of["R"] / n, of["L"] / n, angles[0], of["lam0"], *angles[1:]]])


def drawn(problem: DesignProblem, count: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return problem.low + (problem.high - problem.low) * rng.random((count, len(problem.low)))


# The page's numbers -------------------------------------------------------------------------------


def test_the_papers_point() -> None:
    problem = problem_of("pss5_upu", sampling="fine")
    found = problem.evaluate(problem.printed_design()[None])
    expected = {"K_v": 0.0816, "K_w": 0.8414, "K_lambda": 0.6871, "K_eta": 0.2202, "gti": 0.2202}
    for name, value in expected.items():
        assert found.indices[name][0] == pytest.approx(value, rel=1e-3)
    assert found.indices["F"][0] == pytest.approx(1.849, rel=1e-3)
    assert 1e3 * found.indices["slider_low"][0] == pytest.approx(-82.0, abs=0.5)
    assert not found.feasible[0]
    assert "rail_start" in found.explain(0)


def test_a_share_of_the_papers_workspace_needs_sliders_behind_their_feet() -> None:
    problem = problem_of("pss5_upu")
    machine = problem.mechanism(problem.printed_design())
    sliders = machine.inverse_kinematics(machine.in_box(unit_poses(4096)))
    assert 100.0 * (sliders < 0.0).any(axis=1).mean() == pytest.approx(4.3, abs=0.1)


@pytest.mark.parametrize(
    ("of", "yaw", "gti", "gtw", "lti_min", "F"),
    [
        (BEST, "euler0", 0.8172, 1.0, 0.599, 3.229),
        (BEST, "upu", 0.8176, 1.0, 0.554, None),
        (GOOD, "euler0", 0.7994, 0.862, 0.473, 3.087),
    ],
)
def test_layouts_that_work(
    of: dict, yaw: str, gti: float, gtw: float, lti_min: float, F: float | None
) -> None:
    found = problem_of("pss5_upu_skew", yaw=yaw, sampling="fine").evaluate(design_of(of)).indices
    assert found["gti"][0] == pytest.approx(gti, rel=1e-3)
    assert found["gtw"][0] == pytest.approx(gtw, abs=3e-3)
    assert found["lti_min"][0] == pytest.approx(lti_min, abs=6e-4)
    if F is not None:
        assert found["F"][0] == pytest.approx(F, rel=1e-3)


def test_clearances_of_best() -> None:
    found = problem_of("pss5_upu_skew").evaluate(design_of(BEST)).indices
    assert 1e3 * found["rod_rod"][0] == pytest.approx(124.0, abs=0.5)
    assert 1e3 * found["rod_rail"][0] == pytest.approx(119.0, abs=1.0)
    assert 1e3 * found["slider_low"][0] == pytest.approx(2.3, abs=0.05)
    assert found["slider_high"][0] / 0.5 == pytest.approx(1.03, abs=0.01)


# Samples and nodes --------------------------------------------------------------------------------


def model_of(machine: Pss5Upu) -> Model:
    q = np.degrees([machine.a2, machine.a3]) + np.array([72.0, 144.0])
    b = np.degrees([machine.b2, machine.b3]) + np.array([72.0, 144.0])
    return Model(
        machine.r, machine.R, machine.L, float(np.degrees(machine.theta)),
        around(tuple(q)), around(tuple(b)), machine.upu > 0.5,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", PROBLEMS)
def test_means_are_those_of_the_models(name: str) -> None:
    problem = problem_of(name, sampling="coarse")
    evaluation = problem.evaluate(drawn(problem, 200))
    i = int(np.flatnonzero(evaluation.defined.all(axis=1))[0])
    machine = problem.mechanism(evaluation.designs[i])
    local = np.array([model_of(machine).local(p) for p in machine.in_box(unit_poses(256))])
    for name_, mean in zip(NAMES, local.mean(axis=0), strict=True):
        assert evaluation.indices[name_][i] == pytest.approx(mean, rel=1e-9)
    lti = local[:, 2:].min(axis=1)
    assert evaluation.indices["gti"][i] == pytest.approx(lti.mean(), rel=1e-9)
    assert evaluation.indices["gtw"][i] == (lti >= 0.7).mean()
    weighed = local.mean(axis=0) @ (1.06, 0.88, 0.91, 1.80)
    assert evaluation.indices["F"][i] == pytest.approx(weighed, rel=1e-9)


def test_the_nodes_are_half_of_all() -> None:
    unit = nodes()
    assert unit.shape == (135, 5)
    mirrored = unit * (1.0, -1.0, 1.0, 1.0, -1.0)
    every = {tuple(pose) for pose in np.concatenate([unit, mirrored]) + 0.0}
    assert every == set(itertools.product((-1.0, 0.0, 1.0), repeat=5))


@pytest.mark.slow
def test_finer_nodes_are_five_levels_and_never_allow_more() -> None:
    """Between three levels some random feasible designs are singular: machines aren't of those."""
    fine = problem_of("pss5_upu_skew", sampling="coarse", nodes="fine")
    default = problem_of("pss5_upu_skew", sampling="coarse")
    designs = random_designs(fine, 40, seed=0)
    assert default.evaluate(designs).feasible.all()
    drawn = random_designs(default, 40, seed=0)
    np.testing.assert_array_equal(designs, drawn)
    box = np.random.default_rng(0).uniform(-1.0, 1.0, (20_000, 8))
    box = 0.5 * (default.low + default.high) + 0.5 * (default.high - default.low) * box
    coarse = default.evaluate(box)
    found = box[coarse.feasible]
    close = fine.evaluate(found)
    assert 0.03 < 1.0 - close.feasible.mean() < 0.12
    worse = close.constraints - coarse.constraints[coarse.feasible]
    assert (worse >= -1e-9).all()
    k = int(np.argmax(close.constraints[:, fine.constraint_names.index("determinant")]))
    machine = default.mechanism(found[k])
    unit = nodes(5)
    assert np.ptp(np.sign(np.linalg.det(machine.system(machine.in_box(unit))))) == 2.0


@pytest.mark.slow
def test_extremes_at_the_nodes_are_the_models() -> None:
    problem = problem_of("pss5_upu_skew", sampling="coarse")
    evaluation = problem.evaluate(design_of(GOOD))
    machine = problem.mechanism(evaluation.designs[0])
    model, poses = model_of(machine), machine.search_poses()
    found = {name: values[0] for name, values in evaluation.indices.items()}
    sliders = np.array([model.sliders(pose) for pose in poses])
    assert found["slider_low"] == pytest.approx(sliders.min(), abs=1e-12)
    assert found["slider_high"] == pytest.approx(sliders.max(), abs=1e-12)
    local = np.array([model.local(pose) for pose in poses])
    assert found["lti_min"] == pytest.approx(local[:, 2:].min(), rel=1e-9)
    assert found["transmission"] == pytest.approx(local[:, 2].min(), rel=1e-9)
    values = np.array([model.singular_values(pose) for pose in poses])
    assert found["rcond"] == pytest.approx((values[:, 5] / values[:, 0]).min(), rel=1e-9)
    load = [np.abs(model.jacobian(pose)[2]).max() for pose in poses]
    assert found["force"] == pytest.approx(max(load), rel=1e-9)
    assert found["swing"] == pytest.approx(machine.swings(poses).max(), abs=1e-9)
    clear = machine.clearances(poses).min(axis=0)
    assert [found[n] for n in ("rod_rod", "rod_rail", "rod_upu")] == pytest.approx(clear)


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_sampling_errors_are_what_the_docs_say(name: str) -> None:
    """0.1 % of F at the default, relative rms over designs; of each index with the fine sample."""
    other = 2.0 * Sobol(5, scramble=True, seed=1).random(2**15) - 1.0
    problem = problem_of(name)
    evaluation = problem.evaluate(drawn(problem, 400))
    rows = np.flatnonzero(evaluation.defined.all(axis=1) & (evaluation.indices["K_eta"] > 0.05))[
        :12
    ]
    exact = []
    for i in rows:
        machine = problem.mechanism(evaluation.designs[i])
        local = machine.local_indices(machine.in_box(other))
        exact.append([local[n].mean() for n in NAMES])
    F = np.array(exact) @ (1.06, 0.88, 0.91, 1.80)
    off = evaluation.indices["F"][rows] / F - 1.0
    assert np.sqrt((off**2).mean()) < 1e-3
    fine = problem_of(name, sampling="fine").evaluate(evaluation.designs[rows])
    for k, index in enumerate(NAMES):
        off = fine.indices[index] / np.array(exact)[:, k] - 1.0
        assert np.sqrt((off**2).mean()) < 1e-3, index


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("objective", ["gti", "F"])
def test_stored_optima_hold_on_five_levels(name: str, objective: str) -> None:
    """What the 135 nodes miss at them: less than 0.1 mm of the sliders' range."""
    problem = problem_of(name, objective=objective)
    design = problem.design(problem.reference.optima[objective].design)
    found = problem.evaluate(design[None])
    assert found.feasible[0]
    machine = problem.mechanism(design)
    dense = machine.in_box(np.array(list(itertools.product(np.linspace(-1, 1, 5), repeat=5))))
    sliders = machine.inverse_kinematics(dense)
    assert found.indices["slider_low"][0] - sliders.min() < 1e-4
    assert machine.limbs(dense)[..., 6].min() > LEAST_COSINE - 1e-3
    if name == "pss5_upu_skew":
        missed = found.indices["rod_rod"][0] - machine.clearances(dense)[:, 0].min()
        assert missed < 0.01


@pytest.mark.parametrize("name", SAMPLINGS)
def test_a_sample_never_holds_the_centre(name: str) -> None:
    unit = unit_poses(SAMPLINGS[name])
    assert unit.shape == (SAMPLINGS[name], 5)
    assert (np.abs(unit).max(axis=1) > 0.05).all()


def test_pieces_are_the_limits_taken_apart(rng: np.random.Generator) -> None:
    """Their worst is the worst constraint, a force's by its logarithm."""
    problem = problem_of("pss5_upu_skew", sampling="coarse")
    designs, tasks = drawn(problem, 600), problem.draw_tasks(600, rng)
    evaluation, pieces = problem.evaluate(designs, tasks), problem.pieces(designs, tasks)
    assert np.isfinite(pieces).all()
    known = (evaluation.unreached <= 0.0) & (evaluation.constraints[:, 0] <= 0.0)
    assert known.sum() > 100
    broken = evaluation.constraints[known] + TOLERANCE
    force = problem.constraint_names.index("force")
    broken[:, force] = np.log1p(broken[:, force])
    np.testing.assert_allclose(pieces[known, 1:].max(axis=1), broken.max(axis=1), atol=1e-12)
    value = evaluation.objectives[known, 0]
    np.testing.assert_allclose(pieces[known, 0], -np.log(value), atol=1e-12)
    assert (pieces[~known] > 0.0).all()


# What is undefined, broken and said ---------------------------------------------------------------


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_broken_limit_leaves_the_indices_finite(name: str) -> None:
    problem = problem_of(name, sampling="coarse", free="all")
    tasks = problem.draw_tasks(3000, np.random.default_rng(1))  # smaller boxes among them
    evaluation = problem.evaluate(drawn(problem, 3000), tasks)
    made = (evaluation.unreached <= 0.0) & (evaluation.constraints[:, 0] <= 0.0)
    for constraint in problem.constraint_names:
        if constraint in (
            "dimensions", "reach", "determinant", "rcond", "height", "swing", "force",
        ):  # fmt: skip
            continue
        k = problem.constraint_names.index(constraint)
        broken = made & (evaluation.constraints[:, k] > 0.0)
        assert broken.any(), constraint
        assert all(np.isfinite(values[broken]).all() for values in evaluation.indices.values())


@pytest.mark.parametrize("name", PROBLEMS)
def test_out_of_reach_everything_is_undefined(name: str) -> None:
    problem = problem_of(name, sampling="coarse")
    evaluation = problem.evaluate(drawn(problem, 3000))
    out = (evaluation.unreached > 0.0) & np.isfinite(evaluation.unreached)
    assert out.any()
    assert np.isnan(evaluation.indices["gti"][out]).all()
    k = problem.constraint_names.index("reach")
    assert (evaluation.constraints[out, k] > 0.0).all()


@pytest.mark.parametrize(
    ("design", "words"),
    [
        ([1.5, 1.45], "share: the least of r, R and L over n is 0.05"),
        ([0.9, 0.6], "platform: the radius of the platform over the base's is 1.667"),
        ([np.nan, 1.0], "n2 = nan"),
    ],
)
def test_dimensions_in_words(design: list[float], words: str) -> None:
    assert words in problem_of("pss5_upu").evaluate(np.array([design])).explain(0)


def test_the_least_gap_of_joints() -> None:
    problem = problem_of("pss5_upu_skew")
    found = problem.evaluate(np.concatenate([design_of(BEST), design_of(GOOD)])).indices["gap"]
    expected = []
    for of in (BEST, GOOD):
        angles = [np.sort(around(of[key]) % 360.0) for key in ("q", "b")]
        gaps = [np.diff(np.append(some, some[0] + 360.0)).min() for some in angles]
        expected.append(min(gaps))
    np.testing.assert_allclose(np.degrees(found), expected, atol=1e-9)


def test_the_five_fold_layout_is_a_special_case_and_singular() -> None:
    problem = problem_of("pss5_upu_skew")
    design = np.array([[1.378, 1.039, np.radians(30.0), 0.8, 0.0, 0.0, 0.0, 0.0]])
    found = problem.evaluate(design)
    assert not found.feasible[0]
    assert found.indices["rcond"][0] < 1e-9
    assert "rcond" in found.explain(0)
    paper = problem_of("pss5_upu", yaw="upu").evaluate(design[:, :2])
    assert found.indices["gti"][0] == pytest.approx(paper.indices["gti"][0], rel=1e-12)


@pytest.mark.slow
def test_the_family_of_the_paper_tests_two_limits_only(rng: np.random.Generator) -> None:
    problem = problem_of("pss5_upu", sampling="coarse")
    solved = solve_tasks(problem, problem.draw_tasks(12, rng))
    assert solved.solvable.all()
    active = {problem.constraint_names[k] for k in np.flatnonzero(solved.active.any(axis=0))}
    assert active == {"transmission", "rail_start"}


@pytest.mark.slow
def test_that_searches_agree_is_no_proof() -> None:
    problem = pkm_gym.make_problem("pss5_upu_skew")
    solved = solve_tasks(problem, problem.pack(None)[None], effort=4)
    assert solved.certified[0]  # two of sixteen searches, 96 descents
    assert solved.optima[0] == pytest.approx(0.8096, abs=1e-4)
    known = problem.evaluate(problem.design(problem.reference.optima["gti"].design)[None])
    assert known.feasible[0]
    assert known.objectives[0, 0] > solved.optima[0] + 0.02
