"""SurrogateTraining: the networks of a surrogate in PyTorch, trained on samples."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import silu

from pkm_gym.agents.planner.samples import Samples
from pkm_gym.agents.planner.settings import Settings
from pkm_gym.agents.planner.surrogate import Layers, Surrogate
from pkm_gym.agents.runs.state import best_score, check_finite, read_state, restoring, write_state
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reading import shaped
from pkm_gym.core.types import FloatArray

HELD_OUT = 16  # each sixteenth task shows how large the errors are
TYPICAL = 0.75  # quantile of the errors that is called typical
NEAR = 6e-3  # from the optimum, where errors are measured
AT_LIMIT = 0.01  # a constraint this far from its limit counts half
EXACT = 3e-4  # errors below it count by their square, above it by their size
EXACT_SLOPE = 3e-3
APART = 2e-3  # the least distance over which a slope is taken
WARMING = 0.1  # share of the updates in which the learning rate rises
SPLITTING = 0.3  # share of the updates in which pieces are split
ALONE = 0.99  # share of the inputs of a piece that speaks alone
TILT = 0.1  # between the two pieces, per deviation of the inputs, at the highest learning rate


class Net(nn.Module):
    """The networks of all outputs, side by side.

    Args:
        depends: array (outputs, inputs), 1 where an output depends on an input, else 0.
        width: of the hidden layers.
        pieces: of each output; of the first one only one is used.
    """

    def __init__(self, depends: Tensor, width: int, pieces: int) -> None:
        super().__init__()
        self.depends = depends[:, None]
        f, size = depends.shape
        scale = depends.sum(1)[:, None, None] ** -0.5, width**-0.5, width**-0.5
        layers = zip((size, width, width), (width, width, pieces), scale, strict=True)
        spread = 0.5, 0.0, 0.1
        weights = [s * torch.randn(f, n, m) for n, m, s in layers]
        biases = [s * torch.randn(f, 1, w.shape[2]) for s, w in zip(spread, weights, strict=True)]
        self.weights, self.biases = (
            nn.ParameterDict(zip(Layers._fields, arrays, strict=True))
            for arrays in (weights, biases)
        )
        self.straight = nn.Parameter(0.1 * torch.randn(f, size, pieces))

    def forward(self, inputs: Tensor) -> Tensor:
        """Return the outputs (n, f) for standardised inputs (n, size)."""
        made = self.pieces(inputs)
        return torch.cat([made[:1, :, 0], made[1:].amax(dim=2)]).T

    def pieces(self, inputs: Tensor) -> Tensor:
        """Return the pieces (f, n, pieces) for standardised inputs (n, size)."""
        own = inputs * self.depends
        hidden = silu(torch.baddbmm(self.biases["first"], own, self.weights["first"]))
        hidden = silu(torch.baddbmm(self.biases["second"], hidden, self.weights["second"]))
        pieces = torch.baddbmm(self.biases["last"], hidden, self.weights["last"])
        return pieces + own @ self.straight


class SurrogateTraining:
    """A surrogate that is being trained on samples.

    Attributes:
        settings: the hyperparameters.
        done: updates so far.
    """

    def __init__(
        self, problem: DesignProblem, samples: Samples, settings: Settings, seed: int
    ) -> None:
        self.problem, self.samples, self.settings, self.done = problem, samples, settings, 0
        n, k, d = samples.places.shape
        inputs = np.concatenate([np.repeat(samples.points[:, None], k, axis=1), samples.places], 2)
        self._middle, self._spread = _standard(inputs)
        self._mean, self._scale = _standard(samples.told)
        self._inputs = _tensor((inputs - self._middle) / self._spread)
        self._places = _tensor(samples.places)
        self._scales = _tensor(self._scale)
        self._told = _tensor(np.nan_to_num((samples.told - self._mean) / self._scale))
        self._weights = _tensor(_weights(samples.told))
        self._trained = torch.as_tensor(np.flatnonzero(np.arange(n) % HELD_OUT != 0))
        self._generator = torch.Generator().manual_seed(seed)
        torch.manual_seed(seed)
        depends = np.c_[samples.depends, np.ones((len(samples.depends), d), dtype=bool)]
        self._net = Net(_tensor(depends), settings.width, settings.pieces)
        high, low = settings.learning_rate
        times = np.linspace(0.0, SPLITTING * settings.updates, settings.splits + 1)[1:]
        self._splits = set(np.round(times).astype(int).tolist())
        self._optimiser = torch.optim.Adam(self._net.parameters(), lr=high, betas=(0.9, 0.99))
        self._schedule = torch.optim.lr_scheduler.OneCycleLR(
            self._optimiser, max_lr=high, total_steps=settings.updates + 1, pct_start=WARMING,
            final_div_factor=high / (25.0 * low),
        )  # fmt: skip

    def update(self) -> float:
        """Take one step of Adam on pairs of samples; return the loss before it."""
        half = self.settings.batch_size // 2
        task = self._trained[self._draw(len(self._trained), half)]
        first, second = self._draw(self.samples.places.shape[1], 2 * half).view(2, half)
        rows = torch.cat([task, task]), torch.cat([first, second])
        made = self._net(self._inputs[rows])
        error = (made - self._told[rows]) * self._scales
        weight = self._weights[rows]
        apart = (self._places[task, first] - self._places[task, second]).norm(dim=1) + APART
        slope = (error[:half] - error[half:]) / apart[:, None]
        heavier = torch.maximum(weight[:half], weight[half:])
        loss = (weight * _robust(error, EXACT)).mean()
        loss = loss + self.settings.slopes * (heavier * _robust(slope, EXACT_SLOPE)).mean()
        self._optimiser.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(self._net.parameters(), 1.0)
        self._optimiser.step()
        self._schedule.step()
        self.done += 1
        if self.done in self._splits:
            self._split(self._inputs[rows])
        return float(loss.detach())

    def surrogate(self) -> Surrogate:
        """Return what was trained so far, with the errors that it makes on the held-out tasks."""
        parameters = self._net.named_parameters()
        net = {name: value.detach().double().numpy() for name, value in parameters}
        weights, biases = (
            Layers(*(net[f"{kind}.{name}"] for name in Layers._fields))
            for kind in ("weights", "biases")
        )
        depends = self._net.depends.double().numpy().swapaxes(1, 2)
        return Surrogate(
            problem=self.problem,
            columns=self.samples.columns,
            errors=self._errors(),
            middle=self._middle, spread=self._spread, mean=self._mean, scale=self._scale,
            weights=weights._replace(first=weights.first * depends),
            biases=biases,
            straight=net["straight"] * depends,
        )  # fmt: skip

    def save(self, path: Path, best: float) -> None:
        """Keep the state in a file."""
        state = {
            "net": self._net.state_dict(),
            "optimiser": self._optimiser.state_dict(),
            "schedule": self._schedule.state_dict(),
            "generator": self._generator.get_state(),
            "done": self.done,
            "best": best,
        }
        write_state(path, state)

    def load(self, path: Path) -> float:
        """Go on from a file that ``save`` wrote; return the best score.

        Raises:
            ValueError: for a file that is missing, damaged or another recipe's.
        """
        state = read_state(path)
        with restoring(path):
            check_finite(state["net"], "net")
            self._net.load_state_dict(state["net"])
            self._optimiser.load_state_dict(state["optimiser"])
            own, kept = self._schedule.state_dict(), state["schedule"]
            if kept["total_steps"] != own["total_steps"]:  # the run was lengthened
                kept = {**kept, **{name: own[name] for name in ("total_steps", "_schedule_phases")}}
            self._schedule.load_state_dict(kept)
            self._generator.set_state(state["generator"])
            self.done = shaped(int, state["done"], "done")
            return best_score(state["best"])

    @torch.no_grad()
    def _split(self, inputs: Tensor) -> None:
        """Give each output of which only one piece speaks for the inputs (n, size) a second one.

        A piece that is never the largest is never trained, and so a kink may never be found. The
        second piece is the first but for a random slope: each speaks for about half of the inputs.
        """
        pieces = self.settings.pieces
        spoken = nn.functional.one_hot(self._net.pieces(inputs).argmax(dim=2), pieces)
        for j, share in enumerate(spoken.double().mean(dim=1).tolist()[1:], start=1):
            one, other = share.index(max(share)), share.index(min(share))
            if share[one] > ALONE and one != other:
                self._copy(j, one, other)
                tilt = torch.randn(inputs.shape[1], generator=self._generator)
                size = TILT * self._schedule.get_last_lr()[0] / self.settings.learning_rate[0]
                self._net.straight[j, :, other] += size * tilt * self._net.depends[j, 0]

    def _copy(self, output: int, one: int, other: int) -> None:
        """Make another piece of an output like one, and what Adam remembers of it."""
        for layer in (self._net.weights["last"], self._net.biases["last"], self._net.straight):
            state = self._optimiser.state[layer]
            for array in (layer, state["exp_avg"], state["exp_avg_sq"]):
                array[output, :, other] = array[output, :, one]

    def _draw(self, below: int, n: int) -> Tensor:
        return torch.randint(below, (n,), generator=self._generator)

    def _errors(self) -> FloatArray:
        """Return the typical error (f,) near the optima of the held-out tasks."""
        held = np.arange(len(self.samples.points)) % HELD_OUT == 0
        told = self.samples.told[held]
        with torch.no_grad():
            made = self._net(self._inputs[torch.as_tensor(held)].flatten(0, 1)).double().numpy()
        error = np.abs(made * self._scale + self._mean - told.reshape(made.shape))
        near = (self.samples.distances[held] < NEAR).ravel()
        return np.array(
            [
                _typical(error[near, j], told.reshape(made.shape)[near, j], always=j == 0)
                for j in range(made.shape[1])
            ]
        )


def _typical(error: FloatArray, told: FloatArray, *, always: bool) -> float:
    """Return the typical error (n,), of a constraint where it is told to be near its limit."""
    counts = np.abs(told) < AT_LIMIT
    finite = np.isfinite(error)
    chosen = finite & counts if (finite & counts).any() and not always else finite
    return float(np.quantile(error[chosen], TYPICAL)) if chosen.any() else AT_LIMIT


def _standard(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean and deviation of the last axis' columns."""
    rows = values.reshape(-1, values.shape[-1])
    return np.nanmean(rows, axis=0), np.maximum(np.nanstd(rows, axis=0), 1e-12)


def _weights(told: FloatArray) -> FloatArray:
    """Return how much each sample counts: constraints at their limit the most, NaN not at all."""
    weights = 1.0 / (1.0 + np.abs(told) / AT_LIMIT)
    weights[..., 0] = 1.0
    weights[~np.isfinite(told)] = 0.0
    whole: FloatArray = weights / weights.mean(axis=(0, 1))
    return whole


def _robust(error: Tensor, exact: float) -> Tensor:
    size = error.abs()
    return torch.where(size < exact, 0.5 * size**2 / exact, size - 0.5 * exact)


def _tensor(values: Any) -> Tensor:
    return torch.as_tensor(np.asarray(values), dtype=torch.float32)
