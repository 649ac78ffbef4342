"""A design problem and its environments as a page: all that is declared of them, in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from typing import Any

from pkm_gym.core.limit import Limit
from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.problem import DesignProblem
from pkm_gym.envs.motion_view import motion_layout
from pkm_gym.envs.observation import observation_layout
from pkm_gym.envs.registration import motion_id
from pkm_gym.mechanisms import address, family_problem, problem_type

END = "<!-- end -->"

# Each part of an observation, "{of}" being the names that it is about.
PARTS = {
    "task": "{of}: the Family's range to ±0.6, the legal range to ±1; 0 where it isn't drawn",
    "best_design": "{of} of the best design, the search box to ±1",
    "best_merit": "tanh(log merit / 3) of it",
    "best_constraints": "tanh(constraints) of it: {of}",
    "zoom_constraints": "tanh(constraints / (2 step)) of it",
    "other_design": "(other − best) / (4 step), in shares of the range, clipped",
    "other_merit": "tanh((log merit of the other − of the best) / step)",
    "other_constraints": "tanh(constraints / (2 step)) of the other",
    "evaluated": "whether the best, and the other, have been evaluated: 0 or 1",
    "budget_left": "share of the budget that is left",
    "step_size": "1 + log10(step) / 2",
}


def begin(name: str) -> str:
    """Return the line above the part of a file that is made for a problem."""
    return f"<!-- made by pkm-gym page {name} -->"


def framed(name: str) -> str:
    """Return a problem's page between the lines by which it is found again."""
    return f"{begin(name)}\n{page(name)}\n{END}\n"


def into(text: str, name: str) -> str:
    """Return a text with the part that is made for a problem made anew.

    Raises:
        ValueError: where there is no such part, or no end of it.
    """
    head, found, rest = text.partition(f"{begin(name)}\n")
    _, ended, tail = rest.partition(f"{END}\n")
    if not (found and ended):
        raise ValueError(f"there are no lines {begin(name)} and {END} to write between")
    return head + framed(name) + tail


def page(name: str) -> str:
    """Return what is declared of a problem, by name or "module:Class", as Markdown."""
    kind = problem_type(name)
    problem = kind(**kind.declared.reporting)
    return "\n".join(_lines(problem)).rstrip() + "\n"


def _lines(problem: DesignProblem) -> Iterator[str]:
    said = problem.declared
    yield f"## `{problem.name}` as it is declared\n"
    yield f"{problem.title[:1].upper()}{problem.title[1:]}.\n"
    if problem.reference:
        yield f"> {problem.reference.citation}\n"
    for note in problem.notes:
        yield f"{note}\n"
    yield from _table("### Environments", ("id", "an episode is"), _environments(problem))
    if not said.splits:
        yield "Its Family has no splits: the benchmark doesn't measure methods on it.\n"
    yield from _table(
        "### Variables", ("variable", "searched", "unit", "default", "what it is"),
        _variables(problem),
    )  # fmt: skip
    yield from _table(
        "### Derived dimensions", ("dimension", "unit", "what it is"), _derived(problem)
    )
    yield from _table(
        "### Task", ("field", "default", "unit", "Family", "legal", "what it is"), _task(problem)
    )
    yield from _table(
        "### Options", ("option", "default", "allowed", "what it is"), _options(problem)
    )
    yield from _table("### Indices", ("index", "unit", "what it is"), _indices(problem))
    yield from _table(
        "### Objectives", ("objective", "direction", "verified optimum of the default task"),
        _objectives(problem),
    )  # fmt: skip
    yield from _table(
        "### Constraints", ("constraint", "what must hold", "violation"), _constraints(problem)
    )
    yield (
        "A constraint is its violation less 1e-6, kept where it is ≤ 0; in merit the sum of the "
        f"broken ones weighs {said.penalty_weight:g}.\n"
    )
    yield from _table("### Spaces", ("space", "", "content"), _spaces(problem))
    yield from _table(
        "The observation of a design session:\n", ("part", "slice", "content"), _layout(problem)
    )
    if said.family:
        yield from _table(
            "And of a Family's session:\n",
            ("part", "slice", "content"),
            _layout(_of_family(problem)),
        )
    if said.motion is not None:
        machine = problem.mechanism(problem.printed_design())
        parts = motion_layout(problem, machine).items()
        yield from _table(
            "And of a run along the path:\n", ("part", "slice"),
            ((f"`{part}`", _slice(at)) for part, at in parts),
        )  # fmt: skip


def _of_family(problem: DesignProblem) -> DesignProblem:
    return family_problem(address(type(problem)))


def _environments(problem: DesignProblem) -> Iterator[Sequence[str]]:
    said = problem.declared
    session = f"a design session of {said.evaluations} evaluations on"
    yield f"`PKM/{said.environment}-v0`", f"{session} the default task"
    drawn = ", ".join(f"`{v.name}`" for v in problem.task_variables if v.drawn)
    designs = f"; designs: {said.family_words}" if said.family else ""
    family = f"{session} a new task: {drawn} are drawn{designs}"
    yield f"`PKM/{said.environment}Family-v0`", family
    if said.motion is not None:
        faster = "".join(f", {key} {value:g}" for key, value in said.motion.items())
        run = f"a run along the path, the motors of the twin driven by the agent{faster}"
        yield f"`{motion_id(said)}`", run


def _variables(problem: DesignProblem) -> Iterator[Sequence[str]]:
    defaults = problem.named(problem.printed_design())
    for v in problem.all_variables:
        searched = _span(v.low, v.high) if v.searched else "only if freed"
        yield f"`{v.name}`", searched, v.unit, f"{defaults[v.name]:g}", v.doc


def _derived(problem: DesignProblem) -> Iterator[Sequence[str]]:
    design = problem.printed_design()
    for name, (_, unit) in problem.derived(design).items():
        yield f"`{name}`", unit, _words(problem.mechanism(design), name)


def _words(machine: Mechanism, name: str) -> str:
    """Return what a dimension or a property of a machine is, in a few words."""
    for item in fields(machine):
        if item.name == name:
            return str(item.metadata["doc"])
    return (getattr(type(machine), name).__doc__ or "").partition("\n")[0].rstrip(".")


def _task(problem: DesignProblem) -> Iterator[Sequence[str]]:
    for v in problem.task_variables:
        drawn = _span(v.low, v.high) if v.drawn else ""
        legal = _span(v.legal_low, v.legal_high)
        yield f"`{v.name}`", f"{v.default:.6g}", v.unit, drawn, legal, v.doc
    fields, usual = {v.name: v for v in problem.task_variables}, problem.task_type()
    for name, p in problem.declared.products.items():
        low, high = p.drawn(fields)
        drawn = _span(low, high) if low < high else ""
        what = f"{p.doc}, `{p.words}`, in place of `{p.ratio}`"
        value = f"{p.value(usual):.6g}"
        yield f"`{name}`", value, p.unit, drawn, _span(*p.legal(fields)), what


def _options(problem: DesignProblem) -> Iterator[Sequence[str]]:
    for item in problem.options_type.table():
        yield f"`{item.name}`", f"`{item.default!r}`", item.allowed, item.doc


def _indices(problem: DesignProblem) -> Iterator[Sequence[str]]:
    for index in problem.declared.index_table:
        more = "" if index.reported is True else "; not reported"
        if isinstance(index.reported, str):
            more = f"; with `{index.reported}=True`"
        yield f"`{index.name}`", index.unit, f"{index.doc}{more}"


def _objectives(problem: DesignProblem) -> Iterator[Sequence[str]]:
    for item in problem.all_objectives:
        known = problem.reference.optima.get(item.name)
        best = f"{known.value:.6g} {item.unit}".rstrip() if known else ""
        yield f"`{item.name}`", item.direction, best


def _constraints(problem: DesignProblem) -> Iterator[Sequence[str]]:
    own = {limit.name: limit.doc for limit in problem.declared.own_limits}
    for limit in problem.limits:
        if isinstance(limit, str):
            yield f"`{limit}`", own[limit], "the mechanism's own"
        else:
            what = f"`{limit.quantity}` {limit.side_words} {_bound(problem, limit)}"
            yield f"`{limit.name}`", what, _violation(problem, limit)


def _bound(problem: DesignProblem, limit: Limit) -> str:
    bound = limit.bound_shown(problem.unit(limit.quantity))
    return f"`{bound}`" if "task." in bound else bound


def _violation(problem: DesignProblem, limit: Limit) -> str:
    """Return the violation as a formula."""
    value, bound = limit.quantity, limit.bound_words
    if limit.relative(problem.unit(limit.quantity)):
        share = f"{value} / ({bound})" if " " in bound else f"{value} / {bound}"
        return f"`{share} - 1`" if limit.side == "upper" else f"`1 - {share}`"
    return f"`{value} - {bound}`" if limit.side == "upper" else f"`{bound} - {value}`"


def _spaces(problem: DesignProblem) -> Iterator[Sequence[str]]:
    sessions = [("session", problem)]
    if problem.declared.family:
        sessions.append(("Family's session", _of_family(problem)))
    for session, one in sessions:
        names = ", ".join(f"`{name}`" for name in one.variable_names)
        size = max(part.stop for part in observation_layout(one).values())
        yield f"action of a {session}", _box(len(one.variables)), names
        yield f"observation of a {session}", _box(size), "as below"
    if problem.declared.motion is not None:
        machine = problem.mechanism(problem.printed_design())
        size = max(part.stop for part in motion_layout(problem, machine).values())
        motors = ", ".join(f"`{name}`" for name in machine.joint_names)
        yield "action of a run", _box(len(machine.joint_names)), f"the motors of {motors}"
        yield "observation of a run", _box(size), "as below"


def _layout(problem: DesignProblem) -> Iterator[Sequence[str]]:
    of = {
        "task": problem.task_type.names(),
        "best_design": problem.variable_names,
        "best_constraints": problem.constraint_names,
    }
    for part, at in observation_layout(problem).items():
        names = ", ".join(f"`{name}`" for name in of.get(part, ()))
        yield f"`{part}`", _slice(at), PARTS[part].format(of=names)


def _box(size: int) -> str:
    return f"`Box(-1, 1, ({size},), float32)`"


def _slice(at: slice) -> str:
    return f"{at.start}:{at.stop}"


def _span(low: float, high: float) -> str:
    return f"{low:.4g} to {high:.4g}"


def _table(title: str, heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> Iterator[str]:
    """Yield a title and a table, nothing where there are no rows."""
    lines = [_row(row) for row in rows]
    if lines:
        yield f"{title.rstrip()}\n"
        yield _row(heads)
        yield f"|{'---|' * len(heads)}"
        yield from lines
        yield ""


def _row(cells: Sequence[str]) -> str:
    return f"|{'|'.join(f' {cell} ' if cell else ' ' for cell in cells)}|"
