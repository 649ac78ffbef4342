"""sources: the files that a method's results depend on, found by what its module imports."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

OTHERS = ("site-packages", "dist-packages")  # folders of what is installed


def sources(module: ModuleType) -> list[Path]:
    """Return the file of a module, and those of all that it imports from its own folder.

    Nothing is imported for it: an import that a function does later is seen, one by a computed name
    is not.
    """
    if not module.__file__:
        return []
    file = Path(module.__file__).resolve()
    folder, package = file.parent, module.__package__ or ""
    found, todo = {file}, [] if folder.name in OTHERS else [file]
    while todo:
        new = {
            path
            for name in _imported(todo.pop(), folder, package)
            for path in _files(name, folder, package)
        }
        todo += new - found
        found |= new
    return sorted(found)


def _imported(file: Path, folder: Path, package: str) -> Iterator[str]:
    """Yield the full names that a file imports; of ``from a import b`` also a.b."""
    above = [part for part in (package, *file.parent.relative_to(folder).parts) if part]
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            kept = ".".join(above).split(".") if above else []
            base = kept[: len(kept) + 1 - node.level] if node.level else []
            whole = ".".join([*base, *([node.module] if node.module else [])])
            yield whole
            yield from (f"{whole}.{alias.name}".lstrip(".") for alias in node.names)


def _files(name: str, folder: Path, package: str) -> Iterator[Path]:
    """Yield the files in the folder that importing a name runs."""
    if package and not f"{name}.".startswith(f"{package}."):
        return
    parts = [part for part in name.removeprefix(package).split(".") if part]
    for n in range(1, len(parts) + 1):
        place = folder.joinpath(*parts[:n])
        yield from (p for p in (place.with_suffix(".py"), place / "__init__.py") if p.is_file())
