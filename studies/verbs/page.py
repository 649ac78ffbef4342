"""``pkm-gym page``: the page of a problem and its environments, from what is declared."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pkm_gym.core.files import whole_file
from pkm_gym.core.reading import read_text
from pkm_gym.studies.cli.options import Name, output_option
from pkm_gym.studies.report.page import framed, into, page


def command(
    name: Name,
    output: Annotated[
        Path | None, output_option("Write a new page; the terminal if not said.")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Write over a file that is there.")
    ] = False,
    part_of: Annotated[
        Path | None,
        typer.Option(
            "--into",
            metavar="FILE",
            help="Renew only the part of a page that this command made.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Make the page of a problem and of its environments: all that is declared, as Markdown.

    Variables, task, options, indices, objectives, constraints, environments and their spaces, in SI
    units. In a file it stands between two comments, and --into makes only what is between them
    anew.

    Example: pkm-gym page diamond --into docs/environments/diamond.md
    """
    if output and part_of:
        raise ValueError("-o writes a new page and --into renews part of one: give one of them")
    if part_of:
        page_before = read_text(part_of, "page")
        try:
            text = into(page_before, name)
        except ValueError as error:
            raise ValueError(f"{str(part_of)!r}: {error}") from None
        _write(part_of, text)
    elif output:
        if output.exists() and not force:
            raise ValueError(
                f"{str(output)!r} exists: --force writes over it, --into renews a part"
            )
        _write(output, framed(name))
    else:
        print(page(name), end="")


def _write(path: Path, text: str) -> None:
    with whole_file(path) as part:
        part.write_text(text, encoding="utf-8")
    print(f"page: {path}")
