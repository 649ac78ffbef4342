"""Names and units as people read them."""

from __future__ import annotations

import numpy as np
import pytest

from pkm_gym import plots


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("lam_e", r"$\lambda_{e}$"),
        ("tau_G", r"$\tau_{G}$"),
        ("sigma_max", r"$\sigma_{\mathrm{max}}$"),
        ("eta_omega", r"$\eta_{\omega}$"),
        ("l1", "$l_{1}$"),
        ("H", "$H$"),
        ("gap", "gap"),
        ("arm_angle_min", "arm angle min"),
        ("tau", r"$\tau$"),
    ],
)
def test_symbols(name, written):
    assert plots.symbol(name) == written


def test_units():
    assert plots.shown(0.25, "m") == (250.0, "mm")
    assert plots.shown(1.0, "N m/(m/s^2)") == (1.0, "N·m/(m/s²)")
    assert plots.shown(2.0, "kg") == (2.0, "kg")
    angles, unit = plots.shown(np.array([np.pi]), "rad")
    assert (angles[0], unit) == (pytest.approx(180.0), "deg")


def test_labels_name_the_unit_where_there_is_one():
    assert plots.label("gap", "") == "gap"
    assert plots.label("H", "m") == "$H$ (mm)"


def test_every_variable_and_index_can_be_written(problem):
    figure = plots.new_figure(3.0, 3.0)
    for item in (*problem.index_table, *problem.all_variables, *problem.task_variables):
        figure.text(0.5, 0.5, plots.label(item.name, item.unit))
    plots.figure_to_array(figure)
