"""The paper's equations (1)-(22), as they are printed, and our model against one of its own."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.reference import Reference
from pkm_gym.core.trajectory import cruise_durations, duration_345
from pkm_gym.mechanisms.spr3.mechanism import Spr3
from pkm_gym.mechanisms.spr3.path import GatePath, motion

from .spr3_model import PHI, THETA, Model, Moved, complex_step, dot, flat, skew

REFERENCE = Reference.load("pkm_gym.mechanisms.spr3")
A, B = 0.21, 0.455  # m, printed
RATES = np.array([0.01, -0.02, 0.015])  # m/s, of the legs


@dataclass(frozen=True)
class Golden:
    """A machine with legs that move at RATES, by the model of its own; SI units."""

    a: float
    b: float
    joints: tuple[float, ...]
    position: tuple[float, ...]
    normal: tuple[float, ...]
    velocity: tuple[float, ...]
    omega: tuple[float, ...]
    swings: tuple[float, ...]
    spins: tuple[float, ...]
    det: float
    lci: float


GOLDEN = (
    Golden(
        a=0.21,
        b=0.455,
        joints=(0.6, 0.62, 0.65),
        position=(-0.0364911774911632, 0.0158450595522511, 0.571949597588033),
        normal=(-0.0643244932994077, 0.0269478347571571, 0.997565122567783),
        velocity=(-0.0182972054930307, -0.0237119975050001, 0.00135624733804905),
        omega=(0.0407453172213979, -0.0330121885968579, 0.00175740397557485),
        swings=(0.0474076626834004, 0.0388119676022842, 0.042574952114527),
        spins=(0.018318207798962, -0.00486754574311248, -0.0169036629531384),
        det=1.27234213488636,
        lci=0.559959676321526,
    ),
    Golden(
        a=0.21,
        b=0.455,
        joints=(0.5, 0.5, 0.75),
        position=(-0.20868603431101, 0.0, 0.491301622931426),
        normal=(-0.428454497486616, 0.0, 0.903563358920386),
        velocity=(-0.0166476581039078, -0.0223280558555237, -0.00445101629948466),
        omega=(0.0348503282029418, -0.0388868547761811, 0.00784412023243803),
        swings=(0.0502866839280376, 0.0425934690281485, 0.036860571275521),
        spins=(0.0182021668504647, -0.0148012971767954, -0.015943037594885),
        det=1.42142818369858,
        lci=0.604505646113428,
    ),
    Golden(
        a=0.21,
        b=0.455,
        joints=(0.55, 0.72, 0.61),
        position=(0.0223725394787196, 0.134486072241452, 0.562329675879853),
        normal=(0.0493421880006263, 0.236910492884029, 0.970277675124373),
        velocity=(-0.0180227917650185, -0.0230154780447347, 0.00743691182364823),
        omega=(0.0457253263693908, -0.0350603369253239, 0.00307062000850627),
        swings=(0.0515540055821223, 0.0350840849742439, 0.0458813240819008),
        spins=(0.0201361596320761, -0.00528201666558124, -0.0215871140025237),
        det=1.25358092651632,
        lci=0.550956604800235,
    ),
    Golden(
        a=0.13,
        b=0.51,
        joints=(0.7, 0.55, 0.6),
        position=(0.0206876742046221, -0.104550059519291, 0.476105356529408),
        normal=(0.0544328370682838, -0.220436001964457, 0.973881427734724),
        velocity=(-0.0157306293721808, -0.0208749927693412, -0.000916418708979623),
        omega=(0.0402953246394827, -0.0268942485920849, -0.00411465925058772),
        swings=(0.0359621025852309, 0.0306626344180978, 0.0361099936852338),
        spins=(0.0259901873711297, 0.00089435138635787, -0.0227097047222689),
        det=1.39803479876485,
        lci=0.730628790707892,
    ),
)


@pytest.fixture(scope="module")
def moves() -> list[tuple[np.ndarray, Moved]]:
    """Legs (3,) of the printed machine, the corners of their box first, and how it moves."""
    rng, model = np.random.default_rng(26), Model(A, B)
    corners = np.array(list(itertools.product((0.5, 0.75), repeat=3)))
    joints = np.concatenate([corners, rng.uniform(0.5, 0.75, (12, 3))])
    return [(q, model.moved(q, RATES)) for q in joints]


# Two models ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("golden", GOLDEN, ids=lambda golden: str(golden.joints))
def test_both_models_have_the_golden_values(golden: Golden) -> None:
    q = np.array(golden.joints)
    model = Model(golden.a, golden.b)
    moved, J = model.moved(q, RATES), model.jacobian(q)
    turning = dot(moved.limbs, moved.along)
    other = (
        moved.r, moved.R[:, 2], moved.v, moved.omega,
        np.linalg.norm(moved.limbs - turning[:, None] * moved.along, axis=-1), turning,
        np.linalg.det(J), 1.0 / np.linalg.cond(J),
    )  # fmt: skip
    machine = Spr3(a=golden.a, b=golden.b, q_min=0.5, q_max=0.75)
    pose = machine.forward_kinematics(q)
    velocity = machine.jacobian(pose) @ RATES
    swings, spins = machine.limb_turning(pose, velocity)
    local = machine.local_indices(pose)
    ours = (
        machine.position(pose), machine.rotation(pose)[:, 2], velocity,
        machine.angular_jacobian(pose) @ velocity, np.linalg.norm(swings, axis=-1), spins,
        local["det"], local["lci"],
    )  # fmt: skip
    wanted = (
        golden.position, golden.normal, golden.velocity, golden.omega, golden.swings, golden.spins,
        golden.det, golden.lci,
    )  # fmt: skip
    for one, two, three in zip(ours, other, wanted, strict=True):
        np.testing.assert_allclose(two, three, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(one, three, rtol=1e-11, atol=1e-13)


def test_both_models_agree_on_random_machines() -> None:
    problem = pkm_gym.make_problem("spr3")
    rng = np.random.default_rng(27)
    designs = problem.low + (problem.high - problem.low) * rng.random((60, 2))
    kept = designs[problem.evaluate(designs).indices["lci_min"] > 0.2][:8]
    assert len(kept) == 8
    for design in kept:
        machine: Any = problem.mechanism(design)
        q = rng.uniform(machine.q_min, machine.q_max, 3)
        model = Model(machine.a, machine.b)
        moved, pose = model.moved(q, RATES), machine.forward_kinematics(q)
        np.testing.assert_allclose(machine.position(pose), moved.r, atol=1e-13)
        np.testing.assert_allclose(machine.rotation(pose), moved.R, atol=1e-13)
        np.testing.assert_allclose(machine.inverse_jacobian(pose), model.jacobian(q), atol=1e-12)
        limbs = machine.limb_jacobians(pose) @ moved.v
        np.testing.assert_allclose(limbs, moved.limbs, atol=1e-13)


# Positions, eqs (1)-(10) --------------------------------------------------------------------------


def printed_frame(moved: Moved) -> tuple[np.ndarray, np.ndarray]:
    """r and R in the frame in which (6) and (7) hold: 150 degrees about z from the declared one."""
    cos, sin = np.cos(np.radians(150.0)), np.sin(np.radians(150.0))
    turn = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return turn @ moved.r, turn @ moved.R @ turn.T


def equation_6(r: np.ndarray, R: np.ndarray) -> np.ndarray:
    """x0, y0 (2,), m, as printed."""
    (ux, vx, wx), (uy, vy, wy), (_, _, wz) = R
    x = B * uy * (3 * vy - ux) + 2 * r[2] * wx
    y = B * ux * (ux - vy) - 2 * B * vx * uy + 2 * r[2] * wy
    return np.array([x, y]) / (2 * wz)


def equation_7(r: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Squares (3,) of the legs' lengths, m^2, as printed."""
    (ux, vx, _), (_, vy, _), _ = R
    x, y, _ = r
    k, root = B**2 + A**2 + r @ r, np.sqrt(3.0)
    return np.array([
        k + B * y - root * B * x - 2 * A * B * ux + 2 * root * A * B * vx,
        k - 3 * A * B * vy + A * B * ux - 2 * B * y,
        k + B * y + root * B * x - 2 * A * B * ux - 2 * root * A * B * vx,
    ])  # fmt: skip


def euler(psi: Any, theta: Any, delta: Any) -> np.ndarray:
    """The printed matrix of the z-x-z Euler angles."""
    (cp, sp), (ct, st), (cd, sd) = ((np.cos(t), np.sin(t)) for t in (psi, theta, delta))
    return np.array([
        [cp * cd - sp * ct * sd, -cp * sd - sp * ct * cd, sp * st],
        [sp * cd + cp * ct * sd, -sp * sd + cp * ct * cd, -cp * st],
        [st * sd, st * cd, ct],
    ])  # fmt: skip


def test_closure_1_2_4_5_8_9(moves: list[tuple[np.ndarray, Moved]]) -> None:
    machine = Spr3(a=A, b=B, q_min=0.5, q_max=0.75)
    for q, moved in moves:
        pose = machine.forward_kinematics(q)
        feet = machine.position(pose) + A * flat(PHI) @ machine.rotation(pose).T  # (3)
        legs = feet - B * flat(PHI)  # (5), and (1), (8) with its length
        axes = flat(THETA) @ machine.rotation(pose).T
        np.testing.assert_allclose(dot(legs, legs), q**2, atol=1e-14)  # (4), (9)
        np.testing.assert_allclose(dot(legs, axes), 0.0, atol=1e-15)  # (2)
        np.testing.assert_allclose(legs / q[:, None], moved.along, atol=1e-13)


def test_the_third_angle_is_minus_the_first(moves: list[tuple[np.ndarray, Moved]]) -> None:
    machine = Spr3(a=A, b=B, q_min=0.5, q_max=0.75)
    misses = []
    for q, moved in moves:
        psi, theta, _ = machine.angles(machine.forward_kinematics(q))
        np.testing.assert_allclose(euler(psi, theta, -psi), moved.R, atol=1e-13)
        legs = moved.r + A * flat(PHI) @ euler(psi, theta, psi).T - B * flat(PHI)
        misses.append(dot(legs, flat(THETA) @ euler(psi, theta, psi).T))
    assert 0.44 < np.abs(misses).max() < 0.46


def test_6_and_7_hold_in_another_frame_only(moves: list[tuple[np.ndarray, Moved]]) -> None:
    off, squares = [], []
    for q, moved in moves:
        r, R = printed_frame(moved)
        np.testing.assert_allclose(equation_6(r, R), r[:2], atol=1e-14)  # and (10)
        np.testing.assert_allclose(equation_7(r, R), q**2, atol=1e-14)
        off.append(np.linalg.norm(equation_6(moved.r, moved.R) - moved.r[:2]))
        squares.append(np.abs(equation_7(moved.r, moved.R) - q**2).max())
    assert max(off) == pytest.approx(0.0327, abs=5e-5)
    assert max(squares) == pytest.approx(0.407, abs=5e-4)


def iterated(q: np.ndarray, start: np.ndarray) -> int:
    """In how many of Newton's steps (99: never) G(psi, theta, z0) = 0 is solved from a start."""

    def G(x: np.ndarray) -> np.ndarray:  # noqa: N802 (the paper's symbol)
        R = euler(x[0], x[1], -x[0])
        (ux, vx, wx), (uy, vy, wy), (_, _, wz) = R
        place = [
            (B * vy * (vy - ux) - 2 * B * uy * vx + 2 * x[2] * wx) / (2 * wz),
            (B * vx * (3 * ux - vy) + 2 * x[2] * wy) / (2 * wz),
            x[2],
        ]
        legs = np.array(place) + A * flat(PHI) @ R.T - B * flat(PHI)
        return dot(legs, legs) - q**2

    x = start
    for count in range(30):
        if np.abs(G(x + 0j).real).max() < 1e-12:
            return count
        try:
            x = x - np.linalg.solve(complex_step(G, x), G(x + 0j).real)
        except np.linalg.LinAlgError:
            break
    return 99


def test_the_iteration_for_the_angles_starts_anywhere_but_at_home() -> None:
    home = Spr3(a=A, b=B, q_min=0.5, q_max=0.75).home[2]
    joints = np.random.default_rng(28).uniform(0.5, 0.75, (40, 3))
    steps = [iterated(q, np.array([0.3, 0.1, home])) for q in joints]
    assert max(steps) < 20
    assert [iterated(q, np.array([0.3, 0.0, home])) for q in joints] == 40 * [99]


# Velocities, eqs (11)-(20) ------------------------------------------------------------------------


def coupling(moved: Moved) -> np.ndarray:
    """J_c (3, 3), eq. (12) as printed, with r_i for the arm a_i."""
    fixed = B * flat(PHI) - moved.r  # r_i - q_i w_i
    return -np.linalg.solve(np.cross(fixed, moved.axes), moved.axes)


def arms(moved: Moved) -> np.ndarray:
    """a_i (3, 3), which the paper calls r_i from eq. (11) on."""
    return A * flat(PHI) @ moved.R.T


def test_velocities_of_the_points_11_13_15_17_18(moves: list[tuple[np.ndarray, Moved]]) -> None:
    for _, moved in moves:
        foot = moved.v + np.cross(moved.omega, arms(moved))  # (13)
        np.testing.assert_allclose(foot, moved.feet, atol=1e-15)
        along = moved.along
        fixed = foot + np.cross(moved.limbs, -moved.legs) - RATES[:, None] * along  # (11)
        np.testing.assert_allclose(fixed, 0.0, atol=1e-14)
        sliding = dot(foot, along)[:, None] * along
        np.testing.assert_allclose(np.cross(moved.limbs, moved.legs) + sliding, foot, atol=1e-14)
        tips = moved.v + np.cross(moved.omega, arms(moved) + moved.axes)  # (17)
        np.testing.assert_allclose(tips, moved.feet + moved.tips, atol=1e-14)
        np.testing.assert_allclose(foot + np.cross(moved.limbs, moved.axes), tips, atol=1e-14)


def test_12_14_16_19_hold_as_printed(moves: list[tuple[np.ndarray, Moved]]) -> None:
    for q, moved in moves:
        J_c, w = coupling(moved), moved.along
        np.testing.assert_allclose(J_c @ moved.v, moved.omega, atol=1e-14)  # (12)
        J = w + np.cross(arms(moved), w) @ J_c
        np.testing.assert_allclose(J @ moved.v, RATES, atol=1e-14)  # (14)
        swing = np.cross(w, moved.v) + dot(w, arms(moved))[:, None] * moved.omega
        swing = (swing - arms(moved) * (w @ moved.omega)[:, None]) / q[:, None]  # (16)
        spin = (w @ moved.omega)[:, None] * w  # (19)
        np.testing.assert_allclose(swing + spin, moved.limbs, atol=1e-14)
        np.testing.assert_allclose(dot(swing, w), 0.0, atol=1e-15)
        machine = Spr3(a=A, b=B, q_min=0.5, q_max=0.75)
        swings, spins = machine.limb_turning(machine.forward_kinematics(q), moved.v)
        np.testing.assert_allclose(swings, swing, atol=1e-13)
        np.testing.assert_allclose(spins, w @ moved.omega, atol=1e-13)


def test_20_holds_with_the_first_term_outside_the_bracket(
    moves: list[tuple[np.ndarray, Moved]],
) -> None:
    off = []
    for q, moved in moves:
        J_c = coupling(moved)
        for i, (w, arm) in enumerate(zip(moved.along, arms(moved), strict=True)):
            rest = (w @ arm) * np.eye(3) - np.outer(arm, w) + q[i] * np.outer(w, w)
            right = (skew(w) + rest @ J_c) / q[i]
            np.testing.assert_allclose(right @ moved.v, moved.limbs[i], atol=1e-14)
            theirs = (skew(w) + rest) @ J_c / q[i]
            off.append(np.linalg.norm(theirs - right) / np.linalg.norm(right))
    assert np.sqrt(np.square(off).mean()) == pytest.approx(2.0, abs=0.1)


# The motion law, eqs (21), (22) -------------------------------------------------------------------


def test_the_law_is_that_of_the_printed_factors() -> None:
    share = np.polynomial.Polynomial(
        [0, 0, 0, *(REFERENCE[f"share_{k}"].printed for k in (3, 4, 5))]
    )
    rate = np.polynomial.Polynomial([0, 0, *(REFERENCE[f"rate_{k}"].printed for k in (2, 3, 4))])
    np.testing.assert_allclose((share.deriv() - rate).coef, 0.0)
    assert share(1.0) == 1.0
    extremes = share.deriv(2)(rate.deriv(2).roots())
    half = REFERENCE["half"].printed
    assert rate.deriv()(half) == 0.0
    assert rate(half) == REFERENCE["peak_speed"].ours
    assert np.abs(extremes).max() == pytest.approx(REFERENCE["peak_acceleration"].ours, rel=1e-12)
    path = GatePath(0.1, 0.6, 0.55)
    moved = motion(Spr3(a=A, b=B, q_min=0.5, q_max=0.75), path, 0.0125, 10.0, 601)
    first = moved.times <= duration_345(0.05, 0.0125, 10.0)
    rho = moved.times[first] / duration_345(0.05, 0.0125, 10.0)
    np.testing.assert_allclose(moved.positions[first, 2], 0.6 - 0.05 * share(rho), atol=1e-14)


def test_with_a_cruise_both_printed_limits_are_reached() -> None:
    speed, acceleration = REFERENCE["speed"].printed, REFERENCE["acceleration"].printed
    assert speed is not None and acceleration is not None  # noqa: PT018 (both are printed)
    R, h = REFERENCE["path_R"].printed, REFERENCE["path_h"].printed
    assert R is not None and h is not None  # noqa: PT018
    sides = (h, 2.0 * R, h)
    alone = [duration_345(side, speed, acceleration) for side in sides]
    assert sum(alone) == pytest.approx(180.0, rel=1e-12)
    assert REFERENCE["peak_acceleration"].ours * h / alone[0] ** 2 == pytest.approx(
        1.283e-3, rel=1e-4
    )
    halves, cruises = np.array([cruise_durations(side, speed, acceleration) for side in sides]).T
    assert halves.sum() + cruises.sum() == pytest.approx(96.0054, abs=5e-5)
    np.testing.assert_allclose(
        acceleration * halves**2 / REFERENCE["peak_acceleration"].ours, 25.66e-6, rtol=1e-4
    )

    machine = Spr3(a=A, b=B, q_min=0.5, q_max=0.75)
    path = GatePath(1e-3, 0.6, 0.6 - 1e-3)
    moved = motion(machine, path, speed, acceleration, 40_001, cruise=True)
    speeds = np.linalg.norm(moved.velocities, axis=1)
    assert speeds.max() == pytest.approx(speed, rel=1e-12)
    slopes = np.gradient(speeds, moved.times)
    assert REFERENCE["acceleration"].ours == pytest.approx(
        np.abs(slopes).max(), rel=REFERENCE["acceleration"].tolerance
    )
    ways = np.gradient(moved.positions, moved.times, axis=0)
    np.testing.assert_allclose(ways[1:-1], moved.velocities[1:-1], atol=1e-6)
    np.testing.assert_allclose(moved.positions[-1], path.corners[-1], atol=1e-15)


def test_a_side_too_short_for_both_limits_has_no_cruise() -> None:
    assert cruise_durations(2e-5, 0.0125, 10.0) == (duration_345(2e-5, 0.0125, 10.0), 0.0)
