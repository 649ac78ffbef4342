"""Exported models: what is read back is what was built, its loops as closed as they were."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from pkm_gym.core.twin import twin_module
from pkm_gym.twin.camera import first_pose
from pkm_gym.twin.check import random_designs
from pkm_gym.twin.mjcf import mjcf, moved

CLOSED = 1e-12  # m


@pytest.fixture(params=["printed", "random"])
def spec(request, problem):
    """A machine's twin, compiled at its first pose."""
    design = (
        problem.printed_design()
        if request.param == "printed"
        else next(iter(random_designs(problem, 1, seed=4)))
    )
    machine = problem.mechanism(design)
    spec = twin_module(machine).build(machine, first_pose(machine))
    spec.compile()
    return spec


def posed(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


def test_a_model_read_back_has_its_loops_closed_and_its_parts_in_place(spec, tmp_path):
    path = tmp_path / "twin.xml"
    path.write_text(mjcf(spec), encoding="utf-8")
    built = spec.compile()
    read = mujoco.MjModel.from_xml_path(str(path))
    before, after = posed(built), posed(read)
    assert len(after.efc_pos) == len(before.efc_pos) > 0
    assert np.abs(after.efc_pos).max() <= CLOSED
    for name in ("xpos", "xmat", "site_xpos", "geom_xpos", "xipos"):
        np.testing.assert_allclose(getattr(after, name), getattr(before, name), atol=CLOSED)
    for name in ("body_mass", "body_inertia", "dof_armature", "dof_damping", "actuator_gainprm",
                 "actuator_biasprm", "eq_data", "eq_solref", "eq_solimp"):  # fmt: skip
        np.testing.assert_allclose(getattr(read, name), getattr(built, name), rtol=CLOSED)
    assert moved(spec, path.read_text(encoding="utf-8")) <= CLOSED


def test_rounded_numbers_are_noticed(spec):
    before = spec.to_xml()
    assert mjcf(spec) != before
    assert spec.to_xml() == before  # MuJoCo's own precision is as it was
    assert moved(spec, before) > CLOSED
