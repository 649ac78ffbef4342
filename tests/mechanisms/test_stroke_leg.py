"""The leg's geometry, velocities, forces and assembly modes against loops that close."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pkm_gym
from pkm_gym.mechanisms.stroke_leg.kinematics import cylinder_range
from pkm_gym.mechanisms.stroke_leg.mechanism import MODES
from pkm_gym.mechanisms.stroke_leg.step import TROT, Step
from pkm_gym.mechanisms.stroke_leg.workspace import StrokeLeg

from .stroke_leg_model import Model, of

LOW = {"l1": 0.04, "l3": 0.15, "l6": 0.2, "phi": 80.0, "th3": 50.0, "gamma": 20.0, "l5": 0.04}
HIGH = {"l1": 0.11, "l3": 0.32, "l6": 0.36, "phi": 160.0, "th3": 100.0, "gamma": 70.0, "l5": 0.11}
ANGLES = ("phi", "th3", "gamma")
UNITS = np.eye(2)


def leg(model: Model) -> StrokeLeg:
    """The leg of a model, with the paper's workspace."""
    low, high, swing = np.radians([15.0, 75.0, 30.0]).tolist()
    return StrokeLeg(**asdict(model), theta_min=low, theta_max=high, swing=swing)


PRINTED, OTHER = leg(of(75, 240, 305, 135, 75)), leg(of(49, 180, 302, 120, 76))


@pytest.fixture(scope="module")
def models() -> list[Model]:
    """Legs of every shape, the last of them with D over OC."""
    rng = np.random.default_rng(8)
    found = []
    for k in range(16):
        values = {name: rng.uniform(low, HIGH[name]) for name, low in LOW.items()}
        values["gamma"] += 180.0 * (k >= 12)
        values |= {name: float(np.radians(values[name])) for name in ANGLES}
        found.append(Model(**values, l=rng.uniform(0.18, 0.34)))
    return found


def openings(model: Model, rng: np.random.Generator, n: int = 25) -> np.ndarray:
    """Openings (n, 2) with both cranks off their dead lines."""
    drawn = np.radians(rng.uniform([12.0, -35.0], [78.0, 35.0], (20 * n, 2)))
    kept = drawn[(np.abs(np.sin(model.turned(drawn))) > 0.1).all(axis=-1)][:n]
    assert len(kept) == n
    return kept


# Known poses --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("machine", "opening", "foot", "lengths", "jacobian", "eta", "forces"),
    [
        (
            PRINTED, (30, 10), (-156.3991, -886.9833), (294.77651, 343.48913),
            ((5.97195, -8.09590), (-5.01106, -2.94667)), 1.749291, (5011.06, 2946.67),
        ),
        (
            PRINTED, (45, 0), (0.0, -735.3911), (289.11168, 314.08598),
            ((5.83573, -5.04866), (-5.83573, -5.04866)), 1.155897, (5835.73, 5048.66),
        ),
        (
            OTHER, (30, 10), (-156.3991, -886.9833), (303.78004, 325.74961),
            ((8.16109, -11.86846), (-6.84797, -4.31977)), 1.781652, (6847.97, 4319.77),
        ),
        (
            OTHER, (45, 0), (0.0, -735.3911), (299.54290, 305.94934),
            ((7.62340, -7.60212), (-7.62340, -7.60212)), 1.002799, (7623.40, 7602.12),
        ),
    ],
)  # fmt: skip
def test_poses_known_to_the_last_digit(
    machine: StrokeLeg,
    opening: tuple,
    foot: tuple,
    lengths: tuple,
    jacobian: tuple,
    eta: float,
    forces: tuple,
) -> None:
    pose = machine.foot(np.radians(opening))
    np.testing.assert_allclose(1e3 * pose, foot, rtol=0.0, atol=5e-5)
    np.testing.assert_allclose(1e3 * machine.inverse_kinematics(pose), lengths, rtol=0.0, atol=5e-6)
    np.testing.assert_allclose(machine.jacobian(pose), jacobian, rtol=0.0, atol=5e-6)
    assert machine.local_indices(pose)["eta"] == pytest.approx(eta, abs=5e-7)
    pushed = machine.cylinder_forces(pose, np.array([0.0, 1000.0]))
    np.testing.assert_allclose(pushed, forces, rtol=0.0, atol=5e-3)


def test_where_the_frame_of_the_printed_design_stands() -> None:
    _, ob, theta_b, *_ = PRINTED.geometry
    assert 1e3 * ob == pytest.approx(335.76, abs=5e-3)
    assert np.degrees(theta_b) == pytest.approx(43.665, abs=5e-4)


def test_force_amplification_of_the_printed_design_along_the_middle() -> None:
    theta = np.array([15.0, 30.0, 45.0, 60.0, 75.0])
    poses = PRINTED.foot(np.radians(np.stack([theta, 0.0 * theta], axis=-1)))
    found = PRINTED.local_indices(poses)
    largest = [11.1, 9.2, 8.3, 11.6, 20.4]
    np.testing.assert_allclose(found["sigma_max"], largest, rtol=0.0, atol=0.05)
    least = [2.9, 5.3, 7.1, 5.6, 3.4]
    np.testing.assert_allclose(found["sigma_max"] / found["eta"], least, rtol=0.0, atol=0.05)
    vertical = PRINTED.cylinder_forces(poses[1], np.array([0.0, 1000.0]))
    np.testing.assert_allclose(vertical, [3612.0, 3911.0], rtol=0.0, atol=0.5)


def test_the_stated_rectangle_reaches_as_far_as_its_geometry_says() -> None:
    problem = pkm_gym.make_problem("stroke_leg")
    outline = 1e3 * problem.mechanism(problem.printed_design()).workspace()
    width, height = outline.max(axis=0) - outline.min(axis=0)
    assert (width, height) == pytest.approx((1004.56, 771.45), abs=5e-3)
    assert -outline[:, 1].min() == pytest.approx(1004.56, abs=5e-3)  # over the printed 1000 mm


# Positions ----------------------------------------------------------------------------------------


def test_the_loops_close(models: list[Model], rng: np.random.Generator) -> None:
    for model in models:
        machine, opening = leg(model), openings(model, rng)
        pose = machine.foot(opening)
        np.testing.assert_allclose(pose, model.foot(opening), rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(machine.opening(pose), opening, rtol=0.0, atol=1e-12)
        beta, alpha, fj, eh, ji, hi, ab, cd, l2, l4 = model.solve(pose).T
        lengths = machine.inverse_kinematics(pose)
        np.testing.assert_allclose(lengths, np.stack([l2, l4], axis=-1), rtol=0.0, atol=1e-13)
        np.testing.assert_allclose(lengths, model.lengths(opening), rtol=0.0, atol=1e-14)
        at = machine.points(pose)
        for start, end, angle, length in (
            ("O", "F", beta, model.l),
            ("O", "E", alpha, model.l),
            ("F", "J", fj, 2.0 * model.l),
            ("E", "H", eh, 2.0 * model.l),
            ("F", "G", fj, model.l),
            ("E", "G", eh, model.l),
            ("J", "I", ji, model.l),
            ("H", "I", hi, model.l),
            ("O", "A", beta - model.phi, model.l1),
            ("O", "D", alpha - model.gamma, model.l5),
            ("A", "B", ab, l2),
            ("D", "C", cd, l4),
        ):
            expected = np.stack([length * np.cos(angle), length * np.sin(angle)], axis=-1)
            np.testing.assert_allclose(at[end] - at[start], expected, rtol=0.0, atol=1e-12)
        np.testing.assert_array_equal(at["C"][:, 1], 0.0)
        np.testing.assert_allclose(at["I"], pose, rtol=0.0, atol=1e-14)


def test_crank_angles_and_dead_points(models: list[Model], rng: np.random.Generator) -> None:
    for model in models:
        machine, opening = leg(model), openings(model, rng)
        pose = machine.foot(opening)
        turned = model.turned(opening)
        missed = np.angle(np.exp(1j * (machine.crank_angles(pose) - turned)))
        np.testing.assert_allclose(missed, 0.0, atol=1e-12)
        margins = machine.dead_point_angles(pose)
        a = turned[:, 0]
        d = turned[:, 1] * (1.0 if model.gamma > np.pi else -1.0)  # from OC to the side of home
        for short, long, angle in (("A_short", "A_long", a), ("D_short", "D_long", d)):
            apart = margins[f"dead_{short}"] + margins[f"dead_{long}"]
            np.testing.assert_allclose(apart, np.pi, rtol=1e-12)
            missed = np.angle(np.exp(1j * (margins[f"dead_{short}"] - angle)))
            np.testing.assert_allclose(missed, 0.0, atol=1e-12)
        across = np.stack([margins[name] for name in margins]) < 0.0
        assert across.any(axis=0).tolist() == ((a < 0.0) | (d < 0.0)).tolist()


@given(
    theta=st.floats(1.0, 89.0), varphi=st.floats(-44.0, 44.0), by=st.floats(-40.0, 40.0),
)  # fmt: skip
def test_only_sums_of_opening_and_swing_matter(theta: float, varphi: float, by: float) -> None:
    other = min(max(theta + by, 1.0), 89.0)
    swung = np.radians([
        (theta, varphi), (other, varphi + theta - other), (other, varphi - theta + other)
    ])  # fmt: skip
    lengths = PRINTED.inverse_kinematics(PRINTED.foot(swung))
    assert lengths[1, 0] == pytest.approx(lengths[0, 0], abs=1e-12)  # theta + varphi
    assert lengths[2, 1] == pytest.approx(lengths[0, 1], abs=1e-12)  # theta - varphi


def test_forward_kinematics_in_every_assembly_mode(
    models: list[Model], rng: np.random.Generator
) -> None:
    seen = dict.fromkeys(MODES, 0)
    for model in models:
        machine = leg(model)
        drawn = np.radians(rng.uniform([2.0, -180.0], [88.0, 180.0], (200, 2)))
        opening = drawn[(np.abs(np.sin(model.turned(drawn))) > 0.02).all(axis=-1)]
        poses = model.foot(opening)
        modes = np.sign(np.sin(model.turned(opening)))
        np.testing.assert_array_equal(machine.assembly_mode(poses), modes)
        lengths = model.lengths(opening)
        back = machine.forward_kinematics(lengths, near=poses)
        np.testing.assert_allclose(back, poses, rtol=0.0, atol=1e-11)
        every = machine.all_assembly_modes(lengths)
        for k, mode in enumerate(MODES):
            rows = (modes == mode).all(axis=-1)
            seen[mode] += int(rows.sum())
            np.testing.assert_array_equal(every[k, rows], back[rows])
        home = (modes == machine.home_mode).all(axis=-1)
        np.testing.assert_array_equal(machine.forward_kinematics(lengths)[home], back[home])
    assert min(seen.values()) > 400


def test_there_are_no_other_assembly_modes(models: list[Model], rng: np.random.Generator) -> None:
    for model in models:
        machine = leg(model)
        for lengths in model.lengths(openings(model, rng, 4)):
            every = machine.all_assembly_modes(lengths)
            kept = np.isfinite(every).all(axis=-1)
            expected = np.array(model.feet(lengths))
            found = every[kept]
            assert len(found) == len(expected) >= 1
            apart = np.linalg.norm(found[:, None] - expected, axis=-1)
            assert apart.min(axis=0).max() < 1e-11
            assert apart.min(axis=1).max() < 1e-11
            np.testing.assert_allclose(
                machine.inverse_kinematics(found), np.tile(lengths, (len(found), 1)), atol=1e-12
            )
            np.testing.assert_array_equal(machine.assembly_mode(found), np.array(MODES)[kept])


def test_how_long_a_cylinder_gets_while_its_crank_turns(rng: np.random.Generator) -> None:
    through = 0
    for _ in range(300):
        crank, frame = rng.uniform(0.03, 0.4, 2)
        low = rng.uniform(-7.0, 7.0)
        high = low + rng.uniform(0.0, 4.0)
        turned = np.linspace(low, high, 4001)
        lengths = np.hypot(crank * np.cos(turned) - frame, crank * np.sin(turned))
        shortest, longest = cylinder_range(crank, frame, low, high)
        assert shortest - 1e-14 <= lengths.min() <= shortest + 1e-3
        assert longest - 1e-6 <= lengths.max() <= longest + 1e-14
        through += int(np.ceil(low / np.pi) * np.pi <= high)
    assert 100 < through < 290


def test_cylinders_that_do_not_fit_have_no_foot() -> None:
    pose = PRINTED.foot(np.radians([45.0, 0.0]))
    l2, l4 = PRINTED.inverse_kinematics(pose)
    _, ob, *_ = PRINTED.geometry
    for lengths in (
        (ob + PRINTED.l1 + 1e-6, l4),
        (ob - PRINTED.l1 - 1e-6, l4),
        (l2, PRINTED.l6 + PRINTED.l5 + 1e-6),
        (l2, PRINTED.l6 - PRINTED.l5 - 1e-6),
        (np.nan, l4),
    ):
        assert np.isnan(PRINTED.all_assembly_modes(np.array(lengths))).all()
    high = np.array([0.0, -4.0 * PRINTED.l])
    assert np.isnan(PRINTED.inverse_kinematics([high * (1.0 + 1e-9), np.zeros(2)])).all()
    assert np.isfinite(PRINTED.inverse_kinematics(high * (1.0 - 1e-9))).all()


# Velocities, accelerations and forces -------------------------------------------------------------


def test_the_jacobian_follows_from_the_loops(models: list[Model], rng: np.random.Generator) -> None:
    for model in models:
        machine, opening = leg(model), openings(model, rng)
        pose = model.foot(opening)
        rates, jacobian = model.rates(pose), machine.jacobian(pose)
        np.testing.assert_allclose(machine.inverse_jacobian(pose), rates, rtol=0.0, atol=1e-12)
        identity = np.broadcast_to(UNITS, rates.shape)
        np.testing.assert_allclose(jacobian @ rates, identity, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(jacobian, model.jacobian(opening), rtol=1e-9, atol=1e-9)


def test_the_printed_signs_of_the_jacobian_are_wrong(rng: np.random.Generator) -> None:
    model = of(75, 240, 305, 135, 75)
    opening = openings(model, rng)
    pose = model.foot(opening)
    printed = PRINTED.jacobian(pose) * [[1.0, 1.0], [-1.0, 1.0]]  # J_21 as eq. (16) has it
    missed = np.abs(printed @ model.rates(pose) - UNITS).max(axis=(-1, -2))
    assert missed.max() > 2.0
    centre = model.foot(np.radians([(20.0, 0.0), (50.0, 0.0), (70.0, 0.0)]))
    singular = PRINTED.jacobian(centre) * [[1.0, 1.0], [-1.0, 1.0]]
    np.testing.assert_allclose(np.linalg.det(singular), 0.0, atol=1e-12)


def test_cylinder_accelerations_follow_from_the_loops(
    models: list[Model], rng: np.random.Generator
) -> None:
    h = 2e-4
    for model in models[::4]:
        machine, opening = leg(model), openings(model, rng, 8)
        pose = model.foot(opening)
        velocity, acceleration = rng.normal(size=(2, *pose.shape))

        def speeds(
            t: float, model: Model = model, motion: tuple = (pose, velocity, acceleration)
        ) -> np.ndarray:
            position, speed, change = motion
            rates = model.rates(position + t * speed + 0.5 * t * t * change)
            return np.einsum("nij,nj->ni", rates, speed + t * change)

        one, two, three = (speeds(k * h) - speeds(-k * h) for k in (1, 2, 3))
        expected = (1.5 * one - 0.3 * two + three / 30.0) / (2.0 * h)
        found = machine.cylinder_accelerations(pose, velocity, acceleration)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found / scale, expected / scale, rtol=0.0, atol=1e-7)


def test_cylinders_do_the_work_of_the_load(models: list[Model], rng: np.random.Generator) -> None:
    for model in models:
        machine, opening = leg(model), openings(model, rng)
        pose = model.foot(opening)
        force, velocity = rng.normal(size=(2, *pose.shape))
        pushed = machine.cylinder_forces(pose, force)
        rates = np.einsum("nij,nj->ni", model.rates(pose), velocity)
        power = (pushed * rates).sum(-1) + (force * velocity).sum(-1)
        scale = np.abs(pushed * rates).sum(-1) + 1.0
        np.testing.assert_allclose(power / scale, 0.0, atol=1e-12)
        np.testing.assert_allclose(machine.foot_force(pose, pushed), force, rtol=0.0, atol=1e-11)


# Local indices ------------------------------------------------------------------------------------


def test_local_indices_are_those_of_singular_values(
    models: list[Model], rng: np.random.Generator
) -> None:
    for model in models:
        machine, opening = leg(model), openings(model, rng)
        pose = model.foot(opening)
        found = machine.local_indices(pose)
        largest, least = model.singular_values(opening).T
        np.testing.assert_allclose(found["eta"], largest / least, rtol=1e-9)
        np.testing.assert_allclose(found["sigma_max"], largest, rtol=1e-9)
        fastest = np.linalg.norm(model.rates(pose), axis=-1).max(axis=-1)
        np.testing.assert_allclose(found["rate"], fastest, rtol=1e-10)
        np.testing.assert_allclose(found["gap"], model.gap(opening), rtol=0.0, atol=1e-13)


def test_the_gap_is_the_distance_of_all_points_of_the_cylinders(
    models: list[Model], rng: np.random.Generator
) -> None:
    crossing = 0
    for model in models:
        opening = np.radians(rng.uniform([12.0, -35.0], [78.0, 35.0], (6, 2)))
        found = leg(model).local_indices(model.foot(opening))["gap"]
        sampled = model.gap(opening, points=250)
        crossing += int((found == 0.0).sum())
        assert (found <= sampled + 1e-12).all()
        assert (sampled <= found + 1.5e-3).all()
    assert 0 < crossing < 50


@given(
    shares=st.tuples(*[st.floats(0.0, 1.0)] * 7),
    theta=st.floats(1.0, 89.0),
    varphi=st.floats(-45.0, 45.0),
)
def test_the_condition_number_is_bounded_by_the_opening(
    shares: tuple[float, ...], theta: float, varphi: float
) -> None:
    values = {
        name: low + share * (HIGH[name] - low)
        for (name, low), share in zip(LOW.items(), shares, strict=True)
    }
    angles = {name: float(np.radians(values[name])) for name in ANGLES}
    machine = leg(Model(**values | angles, l=0.26))
    pose = machine.foot(np.radians([theta, varphi]))
    tangent = np.tan(np.radians(theta))
    # where a crank is on its dead line eta is infinite
    assert machine.local_indices(pose)["eta"] >= max(tangent, 1.0 / tangent) * (1.0 - 1e-12)


def test_the_condition_number_is_one_where_both_cranks_amplify_alike() -> None:
    square = replace(PRINTED, l3=0.305 * 2**0.5, th3=np.radians(45.0), gamma=np.radians(45.0))
    _, ob, theta_b, *_ = square.geometry
    assert (ob, theta_b) == pytest.approx((0.305, 0.5 * np.pi))
    turned = replace(square, phi=np.radians(90.0), l5=square.l1)  # OA and OD square to OB and OC
    machine = replace(turned, phi=np.radians(45.0))
    pose = machine.foot(np.radians([45.0, 0.0]))
    np.testing.assert_allclose(np.abs(np.sin(machine.crank_angles(pose))), 1.0, rtol=1e-12)
    assert machine.local_indices(pose)["eta"] == pytest.approx(1.0, abs=1e-7)


def test_a_crank_on_its_dead_line_makes_the_leg_singular() -> None:
    _, _, theta_b, *_ = PRINTED.geometry
    reached = 1.5 * np.pi - PRINTED.phi - theta_b  # theta + varphi, where A meets OB
    assert np.degrees(reached) == pytest.approx(91.335, abs=5e-4)
    for off in (1e-3, 1e-5, 1e-7):
        pose = PRINTED.foot(np.array([reached - np.radians(25.0) - off, np.radians(25.0)]))
        assert PRINTED.local_indices(pose)["eta"] > 0.1 / off
        assert abs(np.linalg.det(PRINTED.inverse_jacobian(pose))) < off


def test_the_paper_calls_the_condition_number_symmetric_but_it_is_not() -> None:
    opening = np.radians([(t, v) for t in (30.0, 45.0, 60.0) for v in (20.0, -20.0)])
    eta = PRINTED.local_indices(PRINTED.foot(opening))["eta"]
    expected = [1.749, 1.732, 1.540, 1.013, 4.439, 1.735]
    np.testing.assert_allclose(eta, expected, rtol=0.0, atol=5e-4)


@pytest.mark.parametrize("factor", [0.5, 1.7])
def test_how_a_leg_scales(models: list[Model], rng: np.random.Generator, factor: float) -> None:
    for model in models:
        machine, opening = leg(model), openings(model, rng, 5)
        pose = machine.foot(opening)
        longer = replace(machine, l=factor * machine.l)
        same, base = longer.local_indices(factor * pose), machine.local_indices(pose)
        for name in ("eta", "gap", "A", "D"):
            np.testing.assert_allclose(same[name], base[name], rtol=1e-9, atol=1e-15)
        for name, power in (("sigma_max", 1), ("rate", -1)):
            np.testing.assert_allclose(same[name], base[name] * factor**power, rtol=1e-9)
        lengths = ("l1", "l3", "l6", "l5", "l")
        larger = replace(machine, **{name: factor * getattr(machine, name) for name in lengths})
        np.testing.assert_allclose(
            larger.inverse_kinematics(factor * pose), factor * machine.inverse_kinematics(pose)
        )
        np.testing.assert_allclose(larger.jacobian(factor * pose), machine.jacobian(pose))


# A step -------------------------------------------------------------------------------------------


def test_the_step_of_the_printed_design() -> None:
    step = Step(stride=0.4, lift=0.1, period=2.0, duty=0.5, hip_height=0.8)
    motion = step.motion(np.linspace(0.0, 2.0, 4001))
    lengths = 1e3 * PRINTED.inverse_kinematics(motion.position)
    assert lengths.min(axis=0) == pytest.approx((279.0, 301.3), abs=0.05)
    assert lengths.max(axis=0) == pytest.approx((315.2, 339.7), abs=0.05)
    inverse = PRINTED.inverse_jacobian(motion.position)
    speeds = 1e3 * np.einsum("nij,nj->ni", inverse, motion.velocity)
    assert np.abs(speeds).max(axis=0) == pytest.approx((88.8, 94.9), abs=0.05)
    bends = 1e3 * PRINTED.cylinder_accelerations(*motion)
    assert np.abs(bends).max(axis=0) == pytest.approx((358.0, 443.0), abs=0.5)
    assert np.linalg.norm(motion.velocity, axis=-1).max() == pytest.approx(0.8, rel=0.05)
    correlation = np.corrcoef(speeds.T)[0, 1]
    assert -0.64 <= correlation <= -0.56  # out of phase, unlike those of the twin design


@pytest.mark.parametrize("duty", [0.5, 0.75])
def test_a_step_is_what_its_velocity_says(duty: float) -> None:
    step = Step(stride=0.35, lift=0.12, period=1.6, duty=duty, hip_height=0.72, x0=0.03)
    air = (1.0 - duty) * step.period
    for start, end in ((0.0, air), (air, step.period)):
        times = np.linspace(start + 1e-3, end - 1e-3, 400)
        here = step.motion(times)
        for values, slopes in ((here.position, here.velocity), (here.velocity, here.acceleration)):
            found = np.gradient(values, times, axis=0, edge_order=2)
            np.testing.assert_allclose(found, slopes, rtol=0.0, atol=2e-3)
        ends = step.motion(np.array([start, np.nextafter(end, 0.0)]))
        np.testing.assert_allclose(ends.velocity, 0.0, atol=1e-12)
        np.testing.assert_allclose(np.ptp(ends.position[:, 0]), step.stride, rtol=1e-12)
        np.testing.assert_allclose(ends.position[:, 1], -step.hip_height, rtol=1e-12)
    highest = step.motion(np.array(0.5 * air)).position
    np.testing.assert_allclose(highest, [step.x0, step.lift - step.hip_height], rtol=1e-12)
    ground = step.motion(np.linspace(air, step.period, 9)).position[:, 1]
    np.testing.assert_allclose(ground, -step.hip_height, rtol=1e-12)


def test_a_trot_has_two_feet_on_the_ground_at_any_time() -> None:
    step = Step(duty=0.5)
    times = np.linspace(0.0, 4.0, 401) + 1e-3
    high = np.stack([step.motion(times, phase).position[:, 1] for phase in TROT])
    np.testing.assert_array_equal(((high + step.hip_height) > 1e-12).sum(axis=0), 2)
    np.testing.assert_array_equal(high[0], high[3])  # diagonal legs move alike
    np.testing.assert_array_equal(high[1], high[2])
    later = step.motion(times + step.period)
    np.testing.assert_allclose(later.position, step.motion(times).position, atol=1e-12)


@pytest.mark.parametrize(
    ("field", "value", "match"),
    [
        ("stride", 0.0, "stride is 0.0: it must be finite and greater than 0"),
        ("period", np.nan, "period is nan: it must be finite and greater than 0"),
        ("lift", -0.1, "lift is -0.1: it must be finite and greater than 0"),
        ("hip_height", np.inf, "hip_height is inf: it must be finite and greater than 0"),
        ("duty", 1.0, "duty is 1.0: it must lie between 0 and 1"),
    ],
)
def test_a_step_that_is_none_is_refused(field: str, value: float, match: str) -> None:
    with pytest.raises(ValueError, match=match):
        Step(**{field: value})
