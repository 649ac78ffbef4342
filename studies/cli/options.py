"""The options that verbs share, as typer reads them where a verb's function is annotated."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

# Typer reads these where a verb's function is annotated with them. The front door lets several
# values follow one flag whose metavar holds a "=".
Name: TypeAlias = Annotated[
    str, typer.Argument(metavar="NAME", help="The mechanism: see `pkm-gym list`.")
]
SetOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE ...",
        help="Task fields (task.payload=1.5kg) and options of the mechanism.",
    ),
]
DesignOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE ...",
        help="The design, as variables (lam_e=0.6) or dimensions (e=150mm l1=250mm ...); task "
        "fields (task.payload=1.5kg); options of the mechanism.",
    ),
]
FixOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--fix", metavar="VARIABLE=VALUE ...", help="Take variables out of the search: lam_e=0.6."
    ),
]
RangeOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--range", metavar="VARIABLE=LOW:HIGH ...", help="Other search bounds: lam_l=2:3."
    ),
]
ObjectiveOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--objective",
        metavar="INDEX",
        help="What to optimise; repeat it for several objectives. The first is the one that "
        "merit uses.",
    ),
]

PictureOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--picture",
        metavar="FILE",
        help="Where the picture goes (.png, .svg or .pdf); under runs/NAME if not said.",
        show_default=False,
    ),
]
JsonOption: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--json", help="Print JSON in SI units only; a picture only if --picture names one."
    ),
]

StorageOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|URL",
        help="A journal file or a database URL; runs/NAME/studies.journal if not said.",
        show_default=False,
    ),
]

OutOption: TypeAlias = Annotated[
    Path | None,
    typer.Option("--out", "-o", metavar="FILE", help="Where it goes.", show_default=False),
]
WidthOption: TypeAlias = Annotated[int, typer.Option(min=64, max=3840, help="Pixels.")]
HeightOption: TypeAlias = Annotated[int, typer.Option(min=64, max=2880, help="Pixels.")]
