"""The atlas: an evaluated grid as a Dataset, and its file."""

from __future__ import annotations

import json
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.files import whole_file
from pkm_gym.core.problem import DesignProblem

if TYPE_CHECKING:
    import xarray


def atlas(evaluation: Evaluation, command: str = "") -> xarray.Dataset:
    """Return an evaluated grid as a Dataset: a dimension a variable.

    It holds every index by name, ``constraints`` (with the dimension ``constraint``), ``feasible``
    and ``merit``, and what the problem adds; units and descriptions are attributes. Where the grid
    has a hole, values are NaN, or False.
    """
    import xarray

    problem = evaluation.problem
    names = list(problem.variable_names)
    axes = [np.unique(column) for column in evaluation.designs.T]
    pairs = zip(axes, evaluation.designs.T, strict=True)
    places = tuple(np.searchsorted(axis, column) for axis, column in pairs)

    def spread(values: np.ndarray) -> np.ndarray:
        hole = False if values.dtype == bool else np.nan
        whole = np.full((*map(len, axes), *values.shape[1:]), hole, dtype=values.dtype)
        whole[places] = values
        return whole

    data = {
        index.name: (names, spread(evaluation.indices[index.name]), _about(index.unit, index.doc))
        for index in problem.index_table
    }
    limits = _about("", "feasible where every one is <= 0")
    data["constraints"] = ([*names, "constraint"], spread(evaluation.constraints), limits)
    data["feasible"] = (names, spread(evaluation.feasible), {})
    data["merit"] = (names, spread(evaluation.merit), _about("", "what a search descends"))
    for name, (values, doc) in problem.atlas_columns(evaluation).items():
        data[name] = (names, spread(values), _about("", doc))
    coords = {
        v.name: ([v.name], axis, _about(v.unit, v.doc))
        for v, axis in zip(problem.variables, axes, strict=True)
    }
    coords["constraint"] = (["constraint"], np.array(problem.constraint_names), {})
    return xarray.Dataset(data, coords, _origin(problem, command))


def _about(unit: str, doc: str) -> dict[str, str]:
    return {"units": unit or "1", "long_name": doc}


def _origin(problem: DesignProblem, command: str) -> dict[str, str]:
    return {
        "problem": problem.name,
        "title": problem.title,
        "hash": problem.hash(),
        "task": json.dumps(asdict(problem.task)),
        "options": json.dumps(asdict(problem.options)),
        "fixed": json.dumps(dict(problem.fixed)),
        "version": version("pkm_gym"),
        "command": command,
    }


def save_atlas(dataset: xarray.Dataset, path: Path) -> None:
    """Write an atlas to a NetCDF file, whole or not at all."""
    packed = {str(name): {"zlib": True} for name in dataset.data_vars}
    with whole_file(path) as part:
        dataset.to_netcdf(part, engine="netcdf4", encoding=packed)
