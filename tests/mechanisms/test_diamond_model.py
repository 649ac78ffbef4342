"""The Diamond against a second model of it, and both against values computed with 34 digits.

The values are from loop closure and Lagrange multipliers in multiple precision, at the printed
design with the inertia as printed, for v = (1.5, -0.8) m/s and a = (30, -20) m/s^2.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import solve_tasks
from pkm_gym.mechanisms.diamond.mechanism import Diamond
from pkm_gym.mechanisms.diamond.region import reachable_region
from pkm_gym.mechanisms.diamond.transmission import least_angles, singular_value_bounds

from .diamond_model import Model

VELOCITY, ACCELERATION = np.array([1.5, -0.8]), np.array([30.0, -20.0])
Pair = tuple[float, float]


class Golden(NamedTuple):
    """At one pose: arm angles, J, arm accelerations, torques, eq. (11), eqs (12) and (18)."""

    angles: Pair
    jacobian: tuple[Pair, Pair]
    bends: Pair
    torques: Pair
    rows: tuple[Pair, Pair]
    local: dict[str, float]


GOLDEN = {
    (0.1, -0.5): Golden(
        angles=(0.28637055836809158, 3.4811331900737404),
        jacobian=(
            (2.4903122268963374, 4.9031222689633739),
            (3.5025183959790726, -3.0050367919581452),
        ),
        bends=(-47.214503509275049, 144.08016837615776),
        torques=(1.6757299135717991, 8.5134476633798158),
        rows=(
            (0.17009690040387558, 0.25700919539210014),
            (0.26106728134980471, -0.16860554616028616),
        ),
        local={
            "sigma_max": 1.4418478275130954,
            "sigma_min": 1.0688001942528866,
            "sin_alpha": 0.97153978737140018,
            "tau": 0.31077959326086145,
        },
    ),
    (-0.33, -0.55): Golden(
        angles=(-1.2516117200418966, 2.7831309506502232),
        jacobian=(
            (3.5550593525515292, 1.9901721747986272),
            (0.37433595621026552, -4.4117512449130776),
        ),
        bends=(54.144382293558548, 115.59807692441647),
        torques=(8.2414927259934478, 6.7663261971837793),
        rows=(
            (0.31804479330483239, 0.07657550353585071),
            (0.10736731236743471, -0.30171944258320403),
        ),
        local={
            "sigma_max": 1.2673981847164423,
            "sigma_min": 0.81017506606019295,
            "sin_alpha": 0.91074998411719726,
            "tau": 0.3271334563906337,
        },
    ),
    (0.4, -0.6125): Golden(
        angles=(0.11021581545798324, 4.8057620771574279),
        jacobian=(
            (-0.0095360533174054064, 4.0233633306276432),
            (4.295165929418949, -2.9650711486711023),
        ),
        bends=(-92.139514827941785, 265.45514740246045),
        torques=(0.72986652413956706, 13.484248195127645),
        rows=(
            (0.13644766333205265, 0.31622225903142297),
            (0.31167111568862897, -0.086639957942334629),
        ),
        local={
            "sigma_max": 1.4768716011498052,
            "sigma_min": 0.7301217828190771,
            "sin_alpha": 0.82160529104931464,
            "tau": 0.34440453239717034,
        },
    ),
}


@pytest.fixture(scope="module")
def problem() -> DesignProblem:
    return pkm_gym.make_problem("diamond")


@pytest.fixture(scope="module")
def machine(problem: DesignProblem) -> Diamond:
    made = problem.mechanism(problem.printed_design())
    assert isinstance(made, Diamond)
    return made


@pytest.fixture(scope="module")
def drawn(problem: DesignProblem, draw: Callable[[DesignProblem, int], Any]) -> Any:
    return draw(problem, 20)


def second(machine: Any) -> Model:
    return Model(machine.e, machine.l1, machine.l2, machine.I_A, machine.m, machine.mr_A)


def states(machine: Any, rng: np.random.Generator, n: int = 25) -> tuple[np.ndarray, ...]:
    corner = np.array([-0.5 * machine.b, -machine.H - machine.h])
    poses = corner + [machine.b, machine.h] * rng.random((n, 2))
    return poses, 3.0 * rng.normal(size=(n, 2)), 50.0 * rng.normal(size=(n, 2))


def turned(angles: np.ndarray) -> np.ndarray:
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)


# Golden values ------------------------------------------------------------------------------------


@pytest.mark.parametrize("pose", GOLDEN, ids=str)
def test_the_package_has_the_golden_values(machine: Diamond, pose: Pair) -> None:
    at, golden = np.array(pose), GOLDEN[pose]
    rate = machine.inverse_jacobian(at) @ VELOCITY
    bends = machine.inverse_jacobian(at) @ ACCELERATION
    bends += np.einsum("kij,i,j->k", machine.hessian(at), VELOCITY, VELOCITY)
    assert rate.shape == (2,)
    found = {
        "angles": machine.inverse_kinematics(at),
        "jacobian": machine.inverse_jacobian(at),
        "bends": bends,
        "torques": machine.inverse_dynamics(at, VELOCITY, ACCELERATION),
        "rows": machine.torque_rows(at),
    }
    for name, values in found.items():
        np.testing.assert_allclose(values, getattr(golden, name), rtol=1e-12, err_msg=name)
    local = machine.local_indices(at)
    for name, value in golden.local.items():
        assert local[name] == pytest.approx(value, rel=1e-12), name


@pytest.mark.parametrize("pose", GOLDEN, ids=str)
def test_the_second_model_has_the_golden_values(machine: Diamond, pose: Pair) -> None:
    model, at, golden = second(machine), np.array([pose]), GOLDEN[pose]
    angles, _, bends = model.motion(at, VELOCITY[None], ACCELERATION[None])
    full_turns = np.round((angles[0, :, 0] - golden.angles) / (2.0 * np.pi))
    np.testing.assert_allclose(
        angles[0, :, 0] - 2.0 * np.pi * full_turns, golden.angles, rtol=1e-12
    )
    np.testing.assert_allclose(model.jacobian(at)[0], golden.jacobian, rtol=1e-12)
    np.testing.assert_allclose(bends[0, :, 0], golden.bends, rtol=1e-12)
    torques = model.torques(at, VELOCITY[None], ACCELERATION[None])
    np.testing.assert_allclose(torques[0], golden.torques, rtol=1e-12)
    np.testing.assert_allclose(model.torque_rows(at)[0], golden.rows, rtol=1e-11)
    local = model.local(at)
    for name, value in golden.local.items():
        assert local[name][0] == pytest.approx(value, rel=1e-11), name


# Random machines ----------------------------------------------------------------------------------


def test_both_models_agree_on_random_machines(drawn: Any, rng: np.random.Generator) -> None:
    for machine in drawn.machines:
        model, (poses, velocities, accelerations) = second(machine), states(machine, rng)
        angles, _, bends = model.motion(poses, velocities, accelerations)
        ours = machine.inverse_kinematics(poses)
        np.testing.assert_allclose(turned(ours), turned(angles[..., 0]), atol=1e-11)
        J = machine.inverse_jacobian(poses)
        np.testing.assert_allclose(J, model.jacobian(poses), rtol=1e-8, atol=1e-10 / machine.l1)
        moved = np.einsum("nki,ni->nk", J, accelerations)
        moved += np.einsum("nkij,ni,nj->nk", machine.hessian(poses), velocities, velocities)
        np.testing.assert_allclose(moved, bends[..., 0], rtol=1e-8, atol=1e-7)
        torques = machine.inverse_dynamics(poses, velocities, accelerations)
        theirs = model.torques(poses, velocities, accelerations)
        scale = np.abs(theirs).max(axis=-1, keepdims=True)
        assert (np.abs(torques - theirs) / scale).max() < 1e-9
        local, other = machine.local_indices(poses), model.local(poses)
        for name in ("sigma_max", "sigma_min", "sin_alpha", "sin_beta", "tau"):
            np.testing.assert_allclose(local[name], other[name], rtol=1e-8, err_msg=name)


def test_rows_of_eq_11_are_its_formula_with_the_transpose(
    drawn: Any, rng: np.random.Generator
) -> None:
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    for machine in drawn.machines:
        poses = states(machine, rng)[0]
        angles = second(machine).angles(poses)
        u, w = turned(angles[..., 0]), turned(angles[..., 1])
        s = np.einsum("nki,ij,nkj->nk", w, quarter, u)
        sine = np.einsum("ni,ij,nj->n", w[:, 1], quarter, w[:, 0])[:, None]
        eta = machine.m * machine.l1**2 / machine.I_A
        first = eta * s[:, :1] * (w[:, 1] @ quarter) / sine + w[:, 0] / s[:, :1]
        other = eta * s[:, 1:] * (w[:, 0] @ quarter.T) / sine + w[:, 1] / s[:, 1:]
        rows = machine.I_A / machine.l1 * np.stack([first, other], axis=1)
        np.testing.assert_allclose(machine.torque_rows(poses), rows, rtol=1e-8, atol=1e-10)
        tau = np.linalg.norm(machine.torque_rows(poses), axis=-1).max(axis=-1)
        np.testing.assert_allclose(machine.local_indices(poses)["tau"], tau, rtol=1e-9)


@pytest.mark.parametrize(("e", "sine"), [(0.45, "sin_alpha"), (0.15, "sin_beta")])
def test_torques_have_no_bound_where_a_transmission_angle_vanishes(e: float, sine: str) -> None:
    """Eqs (12) and (18), on the way down the middle to collinear rods or to a stretched limb."""
    machine = Diamond(
        e=e, l1=0.25, l2=0.64, H=0.3, b=0.1, h=0.1, I_A=0.03, m=0.8, mr_A=0.1
    )  # fmt: skip
    poses = np.stack([np.zeros(200_001), np.linspace(-1.0, -0.01, 200_001)], axis=-1)
    local = machine.local_indices(poses)
    at = int(np.nanargmin(np.abs(local[sine])))
    assert 0.0 < abs(local[sine][at]) < 0.01
    assert local["tau"][at] > 50.0 * machine.I_A / machine.l1
    if sine == "sin_alpha":
        assert local["sigma_min"][at] < 0.01
    else:
        assert local["sigma_max"][at] > 100.0


# The workspace ------------------------------------------------------------------------------------


def test_extremes_of_the_printed_design_are_those_of_the_second_model(
    problem: DesignProblem, machine: Diamond
) -> None:
    corners = np.array([machine.workspace().min(axis=0), machine.workspace().max(axis=0)])
    model, indices = second(machine), problem.evaluate(problem.printed_design()[None]).indices
    exact = {name: model.largest(name, corners) for name in ("sigma_max", "tau", "condition")}
    assert exact["sigma_max"] == pytest.approx(1.4936, abs=5e-5)
    assert indices["sigma_max"][0] == pytest.approx(exact["sigma_max"], rel=1e-9)
    assert indices["tau_G"][0] == pytest.approx(exact["tau"], rel=1e-9)
    assert indices["condition"][0] == pytest.approx(exact["condition"], rel=1e-9)


def test_the_optimum_is_that_of_the_independent_derivation(problem: DesignProblem) -> None:
    found = solve_tasks(problem, problem.pack(None)[None])
    assert found.optima[0] == pytest.approx(0.3391074, abs=3e-7)
    assert found.designs[0] == pytest.approx([0.57898, 2.28412, 0.39854], abs=1e-5)
    machine: Any = problem.mechanism(found.designs[0])
    corners = np.array([machine.workspace().min(axis=0), machine.workspace().max(axis=0)])
    model = second(machine)
    assert model.largest("tau", corners) == pytest.approx(found.optima[0], rel=1e-9)
    assert model.largest("sigma_max", corners) == pytest.approx(1.5, rel=2e-6)


# Eq. (19) and Fig. 3 ------------------------------------------------------------------------------


def test_bounds_and_angles_are_inverse(rng: np.random.Generator) -> None:
    beta, alpha = rng.uniform(0.05, 0.5 * np.pi, (2, 200))
    low, high = singular_value_bounds(beta, alpha)
    np.testing.assert_allclose(least_angles(low, high), (beta, alpha), rtol=1e-6)
    printed = np.sqrt(
        2.0 * np.sin(beta) ** 2
        + np.sqrt(2.0 * np.sin(beta) ** 4 * (1.0 + 2.0 * np.cos(alpha) ** 2 - 1.0))
    )  # as printed
    np.testing.assert_allclose(high, printed / (np.sqrt(2.0) * np.sin(beta) ** 2), rtol=1e-12)


def test_angles_within_their_limits_keep_the_singular_values_within_the_bounds(
    drawn: Any, rng: np.random.Generator
) -> None:
    gained = 0
    for machine in drawn.machines:
        local = machine.local_indices(states(machine, rng, 200)[0])
        alpha, beta = (np.arcsin(local[name].min()) for name in ("sin_alpha", "sin_beta"))
        low, high = singular_value_bounds(beta, alpha)
        assert low <= local["sigma_min"].min()
        assert local["sigma_max"].max() <= high
        theta_F = least_angles(min(local["sigma_min"].min(), 1.0), local["sigma_max"].max())[0]
        gained += theta_F > beta
    assert gained > len(drawn.machines) // 2  # eq. (19) doesn't imply the limits of the angles


@pytest.mark.parametrize(
    ("function", "arguments", "match"),
    [
        (singular_value_bounds, (0.0, 1.0), "beta_low is 0 rad: it must be over 0"),
        (singular_value_bounds, (1.0, 2.0), "alpha_low is 2 rad"),
        (singular_value_bounds, (np.nan, 1.0), "beta_low is nan"),
        (least_angles, (1.2, 1.5), "sigma_low is 1.2: it must be over 0 and at most 1"),
        (least_angles, (0.6, 1.2), "sigma_high is 1.2: it must be finite and at least 1.28062"),
        (least_angles, (0.6, np.inf), "sigma_high is inf"),
    ],
)
def test_what_has_no_bounds_or_angles_is_refused(
    function: Callable[..., object], arguments: Pair, match: str
) -> None:
    with pytest.raises(ValueError, match=match):
        function(*arguments)


def test_the_region_holds_the_workspace_and_touches_it(drawn: Any) -> None:
    tangent = 0
    for machine in drawn.machines:
        region = reachable_region(machine)
        tangent += region.tangent
        grid = machine.inverse_kinematics(machine.workspace_grid(81, 21))[..., 0]
        assert region.angles[0] - 1e-9 <= grid.min() <= grid.max() <= region.angles[1] + 1e-9
        away = np.linalg.norm(region.touching - region.elbows, axis=1)
        np.testing.assert_allclose(away, machine.l2, rtol=1e-9)
        low, high = machine.workspace().min(axis=0), machine.workspace().max(axis=0)
        assert (region.touching >= low - 1e-9).all()
        assert (region.touching <= high + 1e-9).all()
        for elbow, arc in zip(region.elbows, region.arcs, strict=True):
            np.testing.assert_allclose(np.linalg.norm(arc - elbow, axis=1), machine.l2, rtol=1e-9)
    assert tangent > 0


def test_the_region_of_the_printed_design_is_fig_3(machine: Diamond) -> None:
    region = reachable_region(machine)
    assert region.tangent
    assert np.degrees(region.angles) == pytest.approx([-95.34988, 36.15701], abs=1e-5)
    height = (machine.l2 - machine.H) / machine.l1  # the top edge is tangent: l1 sin = l2 - H
    assert np.sin(region.angles[1]) == pytest.approx(height, rel=1e-12)
    expected = [(0.35185081, -0.4925), (-0.35185081, -0.4925), (-0.4, -0.6125), (0.4, -0.6125)]
    np.testing.assert_allclose(region.touching, expected, atol=1e-8)
    ends = np.concatenate([region.arcs[:, 0], region.arcs[:, -1]])
    assert len(np.unique(ends.round(9) + 0.0, axis=0)) == 4  # the arcs close
