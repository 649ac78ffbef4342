"""Declaration: all that is said of a design problem, once, before anything is compiled."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isnan, nan
from typing import Any, Literal

from pkm_gym.core.calibration import PENALTY_WEIGHT, SCALE, WORST, calibration
from pkm_gym.core.limit import Limit
from pkm_gym.core.names import check_known
from pkm_gym.core.options import Options
from pkm_gym.core.product import Product
from pkm_gym.core.rows import Dimension, Index, Own, declared
from pkm_gym.core.space import Space, searched_names
from pkm_gym.core.task import Task, Variable
from pkm_gym.core.units import converted, show, span

SPACE = ("free", "fixed", "bounds")  # the arguments that choose what is searched
SPLITS = {"train": 4096, "val": 256, "test": 256, "ood": 256}


@dataclass(frozen=True)
class Objective:
    """An index that is optimised; its unit is that of the index.

    Attributes:
        name: of the index.
        direction: "minimise" or "maximise".
        worst: no feasible design of a legal task reaches it; from the calibration if not given.
        scale: the index at a task's optimum, about; from the calibration if not given.
        powers: task field -> power with which the scale goes.
        rates: task field -> rate with which its logarithm goes, for fields that may be 0.
        offset: what is added to the index in merit, for one that can be 0 or negative.
        unit: of the index.
    """

    name: str
    direction: Literal["minimise", "maximise"]
    worst: float = nan
    scale: float = nan
    powers: Mapping[str, float] = field(default_factory=dict)
    rates: Mapping[str, float] = field(default_factory=dict)
    offset: float = 0.0
    unit: str = ""

    @property
    def sign(self) -> float:
        """+1 where less is better, -1 where more is."""
        return 1.0 if self.direction == "minimise" else -1.0


@dataclass(frozen=True, eq=False)
class Declaration:
    """A design problem as it is declared.

    Attributes:
        name: of the problem, of its files and, in capitals, of its environments.
        title: what it is, in a few words.
        problem: its class, "module:Class".
        task: the Task's class.
        design: the class of a design's row, its fields declared with ``variable``.
        indices: the class of the indices' row, its fields declared with ``index``.
        limits: the class of the row of the mechanism's own limits, declared with ``own``; the first
            is ``dimensions``.
        constraints: in order, a ``Limit`` or the name of an own one.
        option_limits: limits that hold only where the option is given that their bound names.
        objectives: the first is the default.
        options: the class of the options.
        version: raised by whatever changes the numbers.
        penalty_weight: w of the merit, more than the constraints' multipliers; from the calibration
            if not given.
        products: what a task may be given in place of a ratio of it, by name: a height in place of
            height over width; each after those that its powers settle.
        dimensions: names of derived dimensions, attributes of the mechanism, that can be given in
            place of variables.
        reference: file of the paper's numbers in the package; it may be missing.
        environment: the part of the ids that names the problem, made from ``name`` if not given.
        evaluations: budget of an episode.
        motion: arguments of the environment that drives its twin where they aren't the defaults;
            None for a mechanism without a twin, or one that another problem's drives.
        motion_environment: the part of its id that names the machine; ``environment`` if not given.
        family: ``free``, ``fixed``, ``bounds`` and options with which the Family's problem is made,
            its environment, splits and designers with it; kept as JSON holds them.
        searches: how many searches of a task must agree before its optimum is certified; 1 where
            there are so many basins that most miss the best: what one finds is the best known.
        starts: from how many of them each search descends; 0: differential evolution searches.
        coarse: options of the cheaper problem on which starts are gathered by an evolution; empty
            where they are drawn.
        finer: options under which limits are looked for more closely: machines that are drawn to
            be built and driven hold theirs there, too.
        neighbours: from how many neighbours' optima descents to each task of a split start besides.
        rounds: how often they do to the training tasks; None: until no new optimum is found.
        evolutions: from how many evolutions' answers descents to each task of val, test and ood
            start besides.
        thorough: the ``effort`` of searches of train, and of those of val, test and ood.
        splits: split -> number of tasks; empty where methods aren't measured on the Family.
        notes: standing warnings that hold for every design.
        measured: whether the penalty's weight is not declared but that of the calibration.
    """

    name: str
    title: str
    problem: str
    task: type[Task]
    design: type[tuple[float, ...]]
    indices: type[tuple[float, ...]]
    limits: type[tuple[float, ...]]
    constraints: Sequence[str | Limit]
    objectives: Sequence[Objective]
    options: type[Options] = Options
    option_limits: Sequence[Limit] = ()
    version: int = 1
    penalty_weight: float = nan
    dimensions: Sequence[str] = ()
    products: Mapping[str, Product] = field(default_factory=dict)
    reference: str = "paper.toml"
    environment: str = ""
    evaluations: int = 12
    motion: Mapping[str, Any] | None = None
    motion_environment: str = ""
    family: Mapping[str, Any] = field(default_factory=dict)
    searches: int = 2
    starts: int = 0
    coarse: Mapping[str, Any] = field(default_factory=dict)
    finer: Mapping[str, Any] = field(default_factory=dict)
    neighbours: int = 0
    rounds: int | None = None
    evolutions: int = 0
    thorough: tuple[int, int] = (0, 0)
    splits: Mapping[str, int] = field(default_factory=lambda: dict(SPLITS))
    notes: Sequence[str] = ()
    measured: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        """Refuse what contradicts itself, and fill in units and the environment's name.

        Raises:
            TypeError: naming the problem and what is wrong.
        """
        units = {item.name: item.unit for item in self.index_table}
        for objective in self.objectives:
            if objective.name not in units:
                raise TypeError(f"{self.name}: the objective {objective.name!r} is no index")
        self._calibrate(units)
        for split, number in self.splits.items():
            if split not in SPLITS or number < 1:
                raise TypeError(
                    f"{self.name}: the split {split!r} has {number} tasks: it must be one of "
                    f"{', '.join(SPLITS)}, with at least 1"
                )
        object.__setattr__(self, "constraints", tuple(self.constraints))
        environment = self.environment or environment_name(self.name)
        object.__setattr__(self, "environment", environment)
        object.__setattr__(self, "motion_environment", self.motion_environment or environment)
        own = [item.name for item in self.own_limits]
        if own[:1] != ["dimensions"] or self.constraints[:1] != ("dimensions",):
            raise TypeError(
                f"{self.name}: the first limit must be the mechanism's own 'dimensions'"
            )
        said = [limit for limit in self.constraints if isinstance(limit, str)]
        if sorted(said) != sorted(own):
            raise TypeError(
                f"{self.name}: own limits {own} and constraints {said} must be the same"
            )
        for limit in self.constraints:
            if isinstance(limit, Limit):
                self._check(limit, units)
        self._check_products()
        self._check_option_limits(units)
        self._check_family()

    def _check_products(self) -> None:
        names = self.task.names()
        for name, item in self.products.items():
            unknown = [field for field in item.fields if field not in names]
            if name in names or unknown:
                what = f"of {unknown[0]!r}, no task field" if unknown else "a task field, too"
                raise TypeError(f"{self.name}: the product {name!r} is {what}")

    def _calibrate(self, units: Mapping[str, str]) -> None:
        """Fill in the objectives' units, and from the calibration what isn't declared."""
        known = calibration(self.package, self.name)
        weight = known.get("penalty_weight", PENALTY_WEIGHT)
        if isnan(self.penalty_weight):
            object.__setattr__(self, "measured", True)
            object.__setattr__(self, "penalty_weight", float(weight))
            if not known:
                own = self.package.startswith("pkm_gym.")
                called = self.name if own else self.problem
                note = f"merit is not calibrated: `pkm-gym calibrate {called}` does it"
                object.__setattr__(self, "notes", (*self.notes, note))
        filled = []
        for o in self.objectives:
            said = known.get("objectives", {}).get(o.name, {})
            filled.append(
                replace(
                    o,
                    unit=units[o.name],
                    worst=said.get("worst", o.sign * WORST) if isnan(o.worst) else o.worst,
                    scale=said.get("scale", SCALE) if isnan(o.scale) else o.scale,
                    powers=o.powers or said.get("powers", {}),
                    rates=o.rates or said.get("rates", {}),
                )
            )
        object.__setattr__(self, "objectives", tuple(filled))

    def _check(self, limit: Limit, units: Mapping[str, str]) -> None:
        quantities = {**units, **{v.name: v.unit for v in self.variables}}
        if limit.quantity not in quantities:
            raise TypeError(
                f"{self.name}: {limit.name} limits {limit.quantity!r}, no index or variable"
            )
        fields = {item.name: item for item in self.task.variables()}
        names = [limit.bound, *(limit.times or ())[:1]]
        for name in names:
            if isinstance(name, str) and name not in fields:
                raise TypeError(f"{self.name}: the bound {name!r} of {limit.name} is no task field")
        if limit.relative(quantities[limit.quantity]):
            least = fields[limit.bound].legal_low if isinstance(limit.bound, str) else limit.bound
            if not least > 0.0:
                raise TypeError(
                    f"{self.name}: {limit.name} is relative to its bound, which may be {least:g}"
                )

    def _check_option_limits(self, units: Mapping[str, str]) -> None:
        known = {item.name: item for item in self.options.table() if item.default is None}
        for limit in self.option_limits:
            if limit.name in self.constraint_names:
                raise TypeError(f"{self.name}: two limits are called {limit.name}")
            if limit.bound not in known:
                raise TypeError(
                    f"{self.name}: the bound {limit.bound!r} of {limit.name} is no option whose "
                    "default is None"
                )
            self._check(replace(limit, bound=known[str(limit.bound)].low), units)

    def _check_family(self) -> None:
        spaces = {name: self.family.get(name) for name in SPACE}
        options = {name: value for name, value in self.family.items() if name not in SPACE}
        try:
            known = (*SPACE, *(item.name for item in self.options.table()))
            check_known("argument", self.family, known)
            Space.chosen(self.variables, {}, **spaces)
            for some in (options, self.coarse, self.finer):
                self.options.of(some)
            kept = json.loads(json.dumps(dict(self.family)))
        except (TypeError, ValueError) as error:
            raise TypeError(f"{self.name}: its Family can't be made: {error}") from None
        object.__setattr__(self, "family", kept)

    def family_arguments(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return the arguments of the Family's problem: the declared ones, and over them the given.

        Each variable counts by itself: one that is given fixed is no longer free, one that is freed
        no longer fixed, and the declared bounds of what isn't searched are left out.
        """
        said = self.family
        if not said:
            return dict(given)
        made = {**said, **{name: value for name, value in given.items() if value is not None}}
        free = made.get("free")
        chosen = free if free is None or isinstance(free, str) else list(free)
        freed = searched_names(self.variables, chosen)
        declared_free = chosen == said.get("free")
        made["fixed"] = _merged(
            said.get("fixed", {}),
            given.get("fixed"),
            lambda name: declared_free or name not in freed,
        )
        searched = freed - made["fixed"].keys()
        if declared_free and free is not None:
            made["free"] = [v.name for v in self.variables if v.name in searched]
        made["bounds"] = _merged(said.get("bounds", {}), given.get("bounds"), searched.__contains__)
        return made

    @property
    def family_words(self) -> str:
        """What the Family's problem differs in from the default one, "" if in nothing."""
        units = {variable.name: variable.unit for variable in self.variables}
        free = self.family.get("free", ())
        names = [free] if isinstance(free, str) else free
        words = [f"free {', '.join(names)}"] if names else []
        for name, (low, high) in self.family.get("bounds", {}).items():
            unit = converted(0.0, units[name])[1]
            words.append(f"{name} from {span(low, high, units[name])} {unit}".rstrip())
        words += [f"{k} = {x}" for k, x in self.family.items() if k not in SPACE]
        fixed = self.family.get("fixed", {})
        words += [f"{name} = {show(value, units[name])}" for name, value in fixed.items()]
        return "; ".join(words)

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """All variables, searched or not."""
        return declared(self.design, Variable)

    @cached_property
    def index_table(self) -> tuple[Index, ...]:
        """All indices, reported or not."""
        return declared(self.indices, Index)

    @cached_property
    def own_limits(self) -> tuple[Own, ...]:
        """The mechanism's own limits."""
        return declared(self.limits, Own)

    @property
    def constraint_names(self) -> tuple[str, ...]:
        """The constraints' names, in order."""
        return tuple(item if isinstance(item, str) else item.name for item in self.constraints)

    @property
    def package(self) -> str:
        """The package of the problem's class, where its files are; "" for a module of its own."""
        return self.problem.partition(":")[0].rpartition(".")[0]

    @property
    def reporting(self) -> dict[str, Any]:
        """The options with which every index is reported."""
        return {item.reported: True for item in self.index_table if isinstance(item.reported, str)}

    def products_of(self, task: Task) -> dict[str, Dimension]:
        """Return the lengths and times of a task, of which it holds ratios."""
        return {name: Dimension(p.value(task), p.unit) for name, p in self.products.items()}

    def side_of(self, field: str) -> str:
        """Return which bound a task field is, "lower" or "upper", or "" for none."""
        sides = [c.side for c in self.constraints if isinstance(c, Limit) and c.bound == field]
        return sides[0] if sides else ""


def _merged(
    said: Mapping[str, Any], given: Mapping[str, Any] | None, stands: Callable[[str], bool]
) -> dict[str, Any]:
    """Return what is given over what is said, of which only what still stands is kept."""
    values = {name: list(x) if isinstance(x, tuple) else x for name, x in (given or {}).items()}
    return {
        name: x for name, x in {**said, **values}.items() if stands(name) or x != said.get(name)
    }


def environment_name(name: str) -> str:
    """Return a problem's name as environments bear it: SPR3Cylinder for spr3_cylinder.

    A word with a digit is written in capitals.
    """
    words = name.split("_")
    return "".join(
        word.upper() if any(letter.isdigit() for letter in word) else word.capitalize()
        for word in words
    )
