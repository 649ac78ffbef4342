"""The analytic models agree with MuJoCo, and a model that does not is found out."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.twin import twin_module
from pkm_gym.twin.check import check, check_designs, random_designs

GEOMETRY = {"loop closure", "Jacobian", "settled position", "joint rates on the path"}
TORQUES = {"torques on the path", "the same, uniform rods"}

SAG = {"distance to the wanted pose", "settled position with gravity", "sag with gravity"}


def broken(rows):
    return {row.quantity: row.worst for row in rows if not row.holds}


def test_the_printed_design_agrees(machine):
    rows = check(machine)
    turns = {"settled axes"} if len(machine.pose_names) > 2 else set()
    torques = TORQUES if hasattr(machine, "inverse_dynamics") else set()
    weightless = not twin_module(machine).SOLVER.gravity
    sag = SAG if weightless else set()
    pistons = {"piston speeds, driven"} if hasattr(twin_module(machine), "piston_speeds") else set()
    steady = {"accelerations"} if hasattr(machine, "acceleration") else set()
    assert {row.quantity for row in rows} == GEOMETRY | turns | torques | sag | pistons | steady
    assert broken(rows) == {}


def test_random_feasible_designs_agree(twinned):
    rows = check_designs(twinned, random_designs(twinned, 3, seed=7))
    assert broken(rows) == {}
    named = set(twinned.named(twinned.printed_design()))
    assert all(set(row.design) == named for row in rows)


def test_what_gravity_adds_to_a_twin_without_it_is_reported(machine, monkeypatch):
    module = twin_module(machine)
    weightless = replace(module.SOLVER, gravity=False, integrator="Euler")
    monkeypatch.setattr(module, "SOLVER", weightless)
    rows = {row.quantity: row for row in check(machine, machine.sample_poses()[:1])}
    assert "Euler" in rows["loop closure"].solver
    assert rows["loop closure"].solver.endswith("no gravity")
    sagged = rows["settled position with gravity"]
    assert sagged.limit is None
    assert rows["settled position"].worst < sagged.worst < 1e-6
    wanted, sag = (rows[name] for name in ("distance to the wanted pose", "sag with gravity"))
    assert wanted.limit is sag.limit is None
    assert wanted.worst < 1e-6
    assert sag.worst > 1e-5


@pytest.mark.slow
def test_fifty_random_feasible_designs_agree(twinned):
    assert broken(check_designs(twinned, random_designs(twinned, 50, seed=0))) == {}


def test_uniform_rods_differ_from_the_lumped_model_by_a_few_percent():
    problem = pkm_gym.make_problem("diamond")
    (row,) = (r for r in check(problem.mechanism(problem.printed_design())) if r.limit is None)
    assert 0.005 < row.worst < 0.05


def test_a_dimension_that_is_off_is_found_out(machine, monkeypatch):
    poses = machine.sample_poses()
    joints = machine.inverse_kinematics(poses)
    module = twin_module(machine)
    build, told = module.build, set()
    for name, high in ((field.name, field.metadata["high"]) for field in fields(machine)):
        if not 1.001 * getattr(machine, name) < high:
            continue  # a switch that is on
        other = replace(machine, **{name: 1.001 * getattr(machine, name)})
        moved = other.inverse_kinematics(poses) - joints
        if np.nanmax(np.abs(moved), initial=0.0) <= 1e-6:
            continue  # it is no dimension of the limbs
        monkeypatch.setattr(module, "build", lambda _, pose, other=other: build(other, pose))
        found = broken(check(machine, poses))
        assert "settled position" in found, name
        if fits(machine, other, poses, other.forward_kinematics(joints, poses)):
            assert "loop closure" not in found, name
        else:
            assert found["loop closure"] > 1e-5, name
        told |= set(found)
    assert {"loop closure", "Jacobian"} <= told


def fits(one, other, poses, moved):
    """Whether one machine at poses and another where its equal joints take it are alike inside."""
    coordinates = twin_module(one).coordinates
    alike = coordinates(one, poses, poses[0]), coordinates(other, moved, moved[0])
    return all(np.allclose(alike[0][name], alike[1][name], atol=1e-9) for name in alike[0])


def test_a_wrong_inertia_is_found_out(monkeypatch):
    problem = pkm_gym.make_problem("diamond")
    machine = problem.mechanism(problem.printed_design())
    module = __import__(machine.twin_module, fromlist=["build"])
    build = module.build_lumped
    monkeypatch.setattr(
        module, "build_lumped", lambda one, pose: build(replace(one, I_A=1.001 * one.I_A), pose)
    )
    assert set(broken(check(machine))) == {"torques on the path"}


def test_a_pose_out_of_reach_is_refused(machine, out_of_reach):
    with pytest.raises(ValueError, match="out of the machine's reach"):
        check(machine, np.stack([machine.sample_poses()[0], out_of_reach(machine)]))


def test_random_designs_are_feasible_and_repeat(twinned):
    designs = random_designs(twinned, 20, seed=3)
    assert designs.shape == (20, len(twinned.low))
    assert twinned.evaluate(designs).feasible.all()
    np.testing.assert_array_equal(designs, random_designs(twinned, 20, seed=3))
    assert not np.array_equal(designs, random_designs(twinned, 20, seed=4))


def test_too_few_feasible_designs_are_refused(monkeypatch):
    monkeypatch.setattr("pkm_gym.twin.check.BATCHES", 2)
    problem = pkm_gym.make_problem("diamond", bounds={"lam_e": (0.7, 0.75)})
    with pytest.raises(ValueError, match=r"0 feasible designs among 2,048 random ones"):
        random_designs(problem, 1, seed=0)
