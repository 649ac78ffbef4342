"""task-model: a new task's outputs as a mean of what the model says of nearby training tasks.

What a limit or an objective is at a design depends on few fields of the task. So it is estimated by
evaluating that very design on the training tasks that are near in those fields, and a quadratic of
them is fitted: moving least squares. linear programs in a trust region propose what is
optimal by this model of the task; each evaluation then corrects it by what it was off.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import linprog

from pkm_gym.benchmark.interpolation import Interpolation, task_points
from pkm_gym.benchmark.methods import Search, method
from pkm_gym.benchmark.session import Session
from pkm_gym.benchmark.training import Training
from pkm_gym.benchmark.view import Told, View
from pkm_gym.core.types import BoolArray, FloatArray

PROBED = 256  # training tasks by which it is seen what depends on which field
PROBE = 1e-3  # by which share of its range a field is moved for that
REACTS = 1e-10  # an output that changes by more
PER_TERM = 2.0  # training tasks for each term of a quadratic
BEYOND = 1.05  # of the distance of the farthest of them, where weights end

RADIUS = 0.02  # of the trust region at first, a share of the range
CLOSER, WIDER = 0.5, 2.0  # by which it shrinks and grows
STEPS = 40  # linear programs for a proposal, at most
KEPT, CUTS = 4.0, 12  # radii within which places are kept, and how many of them
APART = 1e-9  # of two places that differ
DIFFERENCE = 1e-6  # of slopes, a share of the range
PRICE = 10.0  # of a broken limit, in log objective
MARGIN, SHRINK, LEAST_MARGIN = 2e-4, 0.2, 1e-9  # kept from limits at first; its share at each next
UNDEFINED = 1e3  # an output without a value


class Outputs:
    """What is modelled: the log objective, smaller is better, and the constraints.

    Args:
        view: of the problem.
        training: the training tasks.

    Attributes:
        points: array (n, k), all training tasks, the fields that are drawn.
        reacts: array (1 + c, k), on which of these fields each output depends.
    """

    def __init__(self, view: View, training: Training) -> None:
        self.view, self.training = view, training
        self.points = task_points(view, training.tasks)
        self.reacts = self._reacts(np.flatnonzero(training.solvable)[:PROBED])

    def of(self, told: Told) -> FloatArray:
        """Return the outputs (n, 1 + c) of what was told; all finite."""
        objective = self.view.objective
        with np.errstate(invalid="ignore", divide="ignore"):
            log = objective.sign * np.log(objective.offset + told.values)
        return np.nan_to_num(
            np.c_[log, told.constraints], nan=UNDEFINED, posinf=UNDEFINED, neginf=UNDEFINED
        )

    def _reacts(self, rows: npt.NDArray[np.intp]) -> BoolArray:
        designs = self.training.designs[rows]
        before = self.of(self.training.evaluate(designs, rows))
        moved = []
        for field, variable in enumerate(self.view.task_variables):
            if variable.drawn:
                values = self.training.tasks[rows, field]
                way = PROBE * (variable.high - variable.low)
                middle = 0.5 * (variable.low + variable.high)
                fields = {variable.name: np.where(values > middle, values - way, values + way)}
                after = self.of(self.training.evaluate(designs, rows, fields))
                moved.append((np.abs(after - before) > REACTS).any(axis=0))
        return np.array(moved).T


class TaskModel:
    """A model of one task, of places (d,) in the unit cube.

    Args:
        outputs: that are modelled.
        task: array (m,), packed.
    """

    def __init__(self, outputs: Outputs, task: FloatArray) -> None:
        self._outputs = outputs
        self._low = outputs.view.low
        self._span = outputs.view.high - outputs.view.low
        point = task_points(outputs.view, task[None])[0]
        found = {kind.tobytes(): _means(outputs.points[:, kind], point[kind])
                 for kind in np.unique(outputs.reacts, axis=0)}  # fmt: skip
        self._rows = np.unique(np.concatenate([rows for rows, _ in found.values()]))
        self._weights = np.zeros((len(outputs.reacts), len(self._rows)))
        for j, kind in enumerate(outputs.reacts):
            rows, weights = found[kind.tobytes()]
            self._weights[j, np.searchsorted(self._rows, rows)] = weights
        self._off = np.zeros(len(outputs.reacts))
        self._slopes = np.zeros((len(outputs.reacts), len(self._low)))
        self._about, self._corrected = np.zeros(len(self._low)), False

    def __call__(self, places: FloatArray) -> FloatArray:
        """Return the outputs (n, 1 + c) at places (n, d)."""
        n, k = len(places), len(self._rows)
        designs = np.repeat(self._low + self._span * places, k, axis=0)
        told = self._outputs.training.evaluate(designs, np.tile(self._rows, n))
        known = self._outputs.of(told).reshape(n, k, -1)
        means = np.einsum("nkj,jk->nj", known, self._weights)
        return means + self._off + (places - self._about) @ self._slopes.T

    def cut(self, place: FloatArray) -> Cut:
        """Return the outputs at a place (d,) with their slopes."""
        inward = np.where(place > 0.5, -DIFFERENCE, DIFFERENCE)
        values = self(np.vstack([place, place + np.diag(inward)]))
        return Cut(place, values[0], (values[1:] - values[0]).T / inward)

    def correct(self, place: FloatArray, told: FloatArray) -> None:
        """Learn what the outputs (1 + c,) at a place are: the model then says so, too.

        And still what it said where it was corrected before; beside that its slopes change as
        little as possible.
        """
        missed, way = told - self(place[None])[0], place - self._about
        off = self._off + self._slopes @ way + missed
        if self._corrected and way @ way > APART**2:
            self._slopes += np.outer(missed, way) / (way @ way)
        self._off, self._about, self._corrected = off, place, True


@method(knowledge="transfer", evaluations=12)
def task_model(view: View, training: Training) -> Search:
    """Propose what is optimal by a model that is made of nearby training tasks, and correct it.

    The first program begins at the interpolated optimum, which isn't evaluated.
    """
    outputs, interpolation = Outputs(view, training), Interpolation(view, training)
    span = view.high - view.low

    def search(session: Session) -> None:
        model, margin = TaskModel(outputs, session.task), MARGIN
        place = (interpolation.designs(session.task[None])[0] - view.low) / span
        while True:
            place = proposal(model, place, margin)
            told = session.evaluate(np.clip(view.low + span * place, view.low, view.high))
            model.correct(place, outputs.of(told)[0])
            margin = max(LEAST_MARGIN, SHRINK * margin)

    return search


class Cut(NamedTuple):
    """The outputs as they are at a place and near it."""

    place: FloatArray  # (d,)
    values: FloatArray  # (1 + c,)
    slopes: FloatArray  # (1 + c, d)


def proposal(model: TaskModel, place: FloatArray, margin: float) -> FloatArray:
    """Return the place (d,) that is optimal by a model, near the one given.

    Linear programs in a trust region, each of the slopes at all places near that were looked at:
    outputs are largest values over a workspace, and optima lie where these have kinks.
    """
    best, radius = model.cut(place), RADIUS
    cuts = [best]
    for _ in range(STEPS):
        trial = model.cut(np.clip(best.place + _way(cuts, best, radius, margin), 0.0, 1.0))
        before, after = _merits(np.array([best.values, trial.values]), margin)
        if after < before:
            best, radius = trial, min(RADIUS, WIDER * radius)
        else:
            radius *= CLOSER
        cuts = [cut for cut in cuts if np.abs(cut.place - best.place).max() < KEPT * radius]
        cuts = [*cuts[-CUTS:], trial, best]
        if radius < APART:
            break
    return best.place


def _way(cuts: list[Cut], best: Cut, radius: float, margin: float) -> FloatArray:
    """Return the way (d,) from the best place that a linear program finds, within a radius.

    No cut says of the best place more than what holds there. The program is written in radii: its
    solver's tolerances are absolute.
    """
    d, rows, sides = len(best.place), [], []
    for place, values, slopes in cuts:
        here = np.minimum(values + slopes @ (best.place - place), best.values)
        above = np.r_[here[0] - best.values[0], here[1:] + margin]
        matters = np.r_[True, (above + np.abs(slopes).sum(axis=1) * radius)[1:] > 0.0]
        free = np.zeros((len(above), 2))  # the objective, and by how much limits are broken
        free[0, 0], free[1:, 1] = -1.0, -1.0
        rows.append(np.c_[slopes, free][matters])
        sides.append(-above[matters] / radius)
    low = np.maximum(-1.0, -best.place / radius)
    high = np.minimum(1.0, (1.0 - best.place) / radius)
    solved = linprog(
        np.r_[np.zeros(d), 1.0, PRICE],
        A_ub=np.vstack(rows),
        b_ub=np.concatenate(sides),
        bounds=[*zip(low, high, strict=True), (None, None), (0.0, None)],
    )
    way: FloatArray = np.zeros(d) if solved.x is None else radius * solved.x[:d]
    return way


def _merits(outputs: FloatArray, margin: float) -> FloatArray:
    """Return the log objective of outputs (n, 1 + c), dearer where a limit isn't kept."""
    worst = (outputs[:, 1:] + margin).max(axis=1)
    merits: FloatArray = outputs[:, 0] + PRICE * np.maximum(worst, 0.0)
    return merits


def _means(points: FloatArray, point: FloatArray) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Return of which of the points (n, k) the value at a point (k,) is a mean, with the weights.

    It is the constant of a quadratic that is fitted to the nearest points, the nearest foremost; of
    a linear function where there are too few.
    """
    k = points.shape[1]
    if k == 0:
        return np.zeros(1, dtype=np.intp), np.ones(1)
    offsets = points - point
    distances = np.linalg.norm(offsets, axis=1)
    terms = (k + 1) * (k + 2) // 2
    quadratic = PER_TERM * terms < len(points)
    number = int(PER_TERM * (terms if quadratic else k + 1)) + 1
    rows = np.argsort(distances)[:number]
    reach = distances[rows].max() * BEYOND
    share = offsets[rows] / reach
    pairs = np.triu_indices(k)
    squares = share[:, pairs[0]] * share[:, pairs[1]]
    basis = np.c_[np.ones(len(rows)), share, squares if quadratic else share[:, :0]]
    roots = 1.0 - (distances[rows] / reach) ** 2
    weights: FloatArray = np.linalg.pinv(roots[:, None] * basis)[0] * roots
    return rows, weights
