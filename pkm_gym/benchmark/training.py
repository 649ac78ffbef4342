"""Training: the solved tasks that a *transfer* method knows, and the counted door to them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from pkm_gym.benchmark.view import Told, fixed
from pkm_gym.core.names import check_known
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray


class Training:
    """The training tasks with what solving them has told: that is the pool's cost.

    Attributes:
        tasks: array (n, m), packed.
        designs: array (n, d), the optima; the least violating designs found if unsolvable.
        values: array (n,), the objective there.
        constraints: array (n, c) there.
        active: array (n, c), the constraints that hold the optimum back.
        solvable: array (n,), whether the task has a feasible design.
    """

    def __init__(self, problem: DesignProblem, pool: Pool) -> None:
        self.tasks = fixed(pool.tasks)
        self.designs = fixed(pool.designs)
        self.values = fixed(pool.values)
        self.constraints = fixed(pool.constraints)
        self.active = fixed(pool.active)
        self.solvable = fixed(pool.solvable)
        self._problem, self._tasks = problem, pool.tasks
        self._count, self._prepared = 0, False

    def __len__(self) -> int:
        """Return the number of tasks, the unsolvable ones included."""
        return len(self.tasks)

    @property
    def count(self) -> int:
        """How many designs have been evaluated here."""
        return self._count

    def evaluate(
        self, designs: FloatArray, rows: npt.ArrayLike, fields: Mapping[str, Any] | None = None
    ) -> Told:
        """Evaluate designs (n, d), the i-th of the training task rows[i]; each one counts.

        While a method prepares it is a cost that is paid once, in a session one of that task.
        There is no noise, and no bounds are checked.

        Args:
            designs: array (n, d).
            rows: array (n,) of whole numbers.
            fields: name of a task's field -> values, a number or (n,), that replace the task's own;
                while the method prepares only: in a session they could make its very task.

        Raises:
            ValueError: for a wrong shape, an unknown row or field, an illegal value, or fields in
                a session.
        """
        at, asked = np.asarray(rows), np.array(designs)
        numbers = at.shape == asked.shape[:1] and at.dtype.kind in "iu"
        if not numbers or (at < 0).any() or (at >= len(self)).any():
            raise ValueError(
                f"rows must be whole numbers from 0 to {len(self) - 1}, one a design: got {rows!r}"
            )
        told = Told.of(self._problem.evaluate(asked, self._changed(at, fields or {})))
        self._count += len(told)
        return told

    def close(self) -> None:
        """End the preparation: from here on the tasks' fields stay as they are."""
        self._prepared = True

    def _changed(self, at: npt.NDArray[np.intp], fields: Mapping[str, Any]) -> FloatArray:
        """Return the tasks (n, m) of rows (n,) with other values of some fields."""
        names = [variable.name for variable in self._problem.task_variables]
        check_known("task field", fields, names)
        if fields and self._prepared:
            raise ValueError(
                f"fields ({', '.join(fields)}) can be changed while a method prepares only: in a "
                "session training tasks are evaluated as they are"
            )
        tasks = self._tasks[at]
        for name, values in fields.items():
            tasks[:, names.index(name)] = values
        return tasks
