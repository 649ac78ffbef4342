"""The five-bar's kinematics, maps and twin."""

from __future__ import annotations

import numpy as np
from five_bar.mechanism import FiveBar
from scipy.optimize import fsolve

from pkm_gym.twin.check import check
from pkm_gym.twin.rig import Rig

MACHINE = FiveBar(e=0.05, l1=0.25, l2=0.4, H=0.25, b=0.3, h=0.15)
POSES = MACHINE.workspace_grid(9, 5).reshape(-1, 2)


def elbows(joints):
    drives = np.array([[MACHINE.e, 0.0], [-MACHINE.e, 0.0]])
    return drives + MACHINE.l1 * np.stack([np.cos(joints), np.sin(joints)], axis=-1)


def test_forward_kinematics_undoes_inverse_kinematics():
    joints = MACHINE.inverse_kinematics(POSES)
    np.testing.assert_allclose(MACHINE.forward_kinematics(joints), POSES, rtol=0.0, atol=1e-14)


def test_closed_form_is_what_fsolve_finds():
    for pose in POSES:

        def lengths(joints, pose=pose):
            return np.linalg.norm(pose - elbows(joints), axis=-1) - MACHINE.l2

        joints = MACHINE.inverse_kinematics(pose)
        found = fsolve(lengths, joints + 0.05, xtol=1e-11)
        np.testing.assert_allclose(joints, found, rtol=0.0, atol=1e-10)
    assert (elbows(MACHINE.inverse_kinematics(POSES))[:, 0, 0] > POSES[:, 0]).all()


def test_jacobian_is_the_slope_of_forward_kinematics():
    joints, step = MACHINE.inverse_kinematics(POSES), 1e-6
    columns = [
        (MACHINE.forward_kinematics(joints + d) - MACHINE.forward_kinematics(joints - d))
        / (2.0 * step)
        for d in step * np.eye(2)
    ]
    jacobian = MACHINE.jacobian(POSES)
    np.testing.assert_allclose(jacobian, np.stack(columns, axis=-1), rtol=0.0, atol=1e-9)
    identity = MACHINE.inverse_jacobian(POSES) @ jacobian
    np.testing.assert_allclose(identity, np.tile(np.eye(2), (len(POSES), 1, 1)), atol=1e-13)


def test_maps_are_those_of_the_jacobian():
    maps = MACHINE.index_maps(POSES)
    inverse = MACHINE.inverse_jacobian(POSES)
    condition = np.linalg.cond(inverse)
    np.testing.assert_allclose(maps["gci"].values, 1.0 / condition, rtol=1e-12)
    rates = np.linalg.norm(inverse, axis=-1).max(axis=-1)
    np.testing.assert_allclose(maps["rate"].values, rates, rtol=1e-12)


def test_a_pose_beyond_the_limbs_is_out_of_reach():
    assert np.isnan(MACHINE.inverse_kinematics(np.array([0.0, -0.7]))).all()


def test_twin_is_the_model():
    rows = check(MACHINE)
    assert {row.quantity for row in rows} >= {"loop closure", "Jacobian", "settled position"}
    for row in rows:
        assert row.holds, row


def test_twin_can_be_driven_along_its_path():
    rig = Rig(MACHINE)
    assert rig.assembled
    assert 0.0 < rig.peak_force() < 100.0
    rig.drive(np.zeros(2))
    assert rig.stable
    assert rig.state.gap < 1e-4
