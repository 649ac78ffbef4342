"""Rooms import downwards only, and ``import pkm_gym`` pulls in nothing heavy."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

# A room may import from itself and from the rooms of lower levels.
LEVELS = {
    "pkm_gym.core": 0,
    "pkm_gym.mechanisms": 1,
    "pkm_gym.twin": 2,
    "pkm_gym.plots": 2,
    "pkm_gym.envs": 3,
    "pkm_gym": 4,  # the public names; the front door imports verbs by name only
    "pkm_gym.benchmark": 5,
    "pkm_gym.studies": 6,
    "pkm_gym.agents": 7,
}

# Clients of evaluate; nothing that computes an index knows of them.
CLIENTS = {"gymnasium", "matplotlib", "optuna", "stable_baselines3", "torch", "mujoco", "typer"}


def modules() -> dict[str, Path]:
    """Name -> file of every module that is shipped."""
    found = {}
    for folder, package in (("pkm_gym", "pkm_gym"), ("studies", "pkm_gym.studies"),
                            ("agents", "pkm_gym.agents")):  # fmt: skip
        for path in sorted((ROOT / folder).rglob("*.py")):
            parts = path.relative_to(ROOT / folder).with_suffix("").parts
            name = ".".join((package, *parts)).removesuffix(".__init__")
            found[name] = path
    return found


MODULES = modules()


def statements(tree: ast.AST, *, typing: bool) -> Iterator[ast.Import | ast.ImportFrom]:
    """Import statements at any depth; those for type checkers only where ``typing``."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        elif isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING" and not typing:
            for other in node.orelse:
                yield from statements(other, typing=typing)
        else:
            yield from statements(node, typing=typing)


def imported(name: str, *, typing: bool = True) -> set[str]:
    """What a module imports: our modules by their name, other libraries by their first part."""
    tree = ast.parse(MODULES[name].read_text(encoding="utf-8"))
    found = set()
    for node in statements(tree, typing=typing):
        if isinstance(node, ast.Import):
            targets = [alias.name for alias in node.names]
        else:
            assert node.level == 0, f"{name} imports relatively"
            source = str(node.module)
            members = [f"{source}.{alias.name}" for alias in node.names]
            targets = [member if member in MODULES else source for member in members]
        for target in targets:
            ours = target.split(".")[0] == "pkm_gym"
            found.add(target if ours else target.split(".")[0])
    return found


def room(name: str) -> str:
    return max((r for r in LEVELS if name == r or name.startswith(f"{r}.")), key=len)


def is_figures(name: str) -> bool:
    """Whether a module is a mechanism's figures.py, or lies in its folder figures."""
    return room(name) == "pkm_gym.mechanisms" and name.split(".")[3:4] == ["figures"]


def is_client(name: str) -> bool:
    """Whether a module is a client that lives with its mechanism: nothing imports it."""
    return is_figures(name) or (room(name) == "pkm_gym.mechanisms" and name.endswith(".twin"))


def test_the_modules_are_found() -> None:
    assert {"pkm_gym.core.problem", "pkm_gym.mechanisms.diamond.problem"} <= set(MODULES)
    assert "numpy" in imported("pkm_gym.core.problem")
    assert "pkm_gym.core.merit" in imported("pkm_gym.core.problem")


@pytest.mark.parametrize("name", MODULES)
def test_imports_run_downwards(name: str) -> None:
    for target in imported(name):
        if target.startswith("pkm_gym"):
            assert target in MODULES, f"{name} imports {target}, which is not there"
            own, other = room(name), room(target)
            below = LEVELS[other] < LEVELS[own] or (is_figures(name) and other == "pkm_gym.plots")
            assert own == other or below, f"{name} imports {target}"
            lives_with = is_figures(name) and is_figures(target)
            assert lives_with or not is_client(target), f"{name} imports {target}, found by name"


@pytest.mark.parametrize("name", [name for name in MODULES if room(name) == "pkm_gym.mechanisms"])
def test_no_mechanism_reaches_into_another(name: str) -> None:
    folder = name.split(".")[2:3]
    for target in imported(name):
        if target.startswith("pkm_gym.mechanisms."):
            assert target.split(".")[2:3] == folder, f"{name} imports {target}"


@pytest.mark.parametrize(
    "name", [n for n in MODULES if room(n) in ("pkm_gym.core", "pkm_gym.mechanisms")]
)
def test_nothing_that_computes_knows_its_clients(name: str) -> None:
    own = {"mujoco"} if name.endswith("twin") else {"matplotlib"} if is_figures(name) else set()
    assert not imported(name) & (CLIENTS - own)


def test_no_modules_import_each_other_in_a_circle() -> None:
    graph = {name: imported(name, typing=False) & set(MODULES) for name in MODULES}
    done: set[str] = set()

    def visit(name: str, path: tuple[str, ...]) -> None:
        assert name not in path, " -> ".join((*path[path.index(name) :], name))
        if name not in done:
            for target in sorted(graph[name]):
                visit(target, (*path, name))
            done.add(name)

    for name in graph:
        visit(name, ())


def test_import_pulls_in_nothing_heavy() -> None:
    heavy = ("numba", "scipy", "matplotlib", "optuna", "torch", "stable_baselines3", "mujoco")
    code = f"import pkm_gym, sys; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_a_problem_is_made_without_clients() -> None:
    code = (
        "import pkm_gym, sys; pkm_gym.make_problem('diamond');"
        "heavy = ('matplotlib', 'mujoco', 'optuna', 'torch');"
        "print([name for name in heavy if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
