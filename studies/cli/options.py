"""The options that verbs share, as typer reads them where a verb's function is annotated."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer


def out_option(text: str, metavar: str = "FILE") -> Any:
    """Return the option ``--out``: a picture, a film or a model."""
    return typer.Option("--out", "-o", metavar=metavar, help=text, show_default=False)


def output_option(text: str, metavar: str = "FILE") -> Any:
    """Return the option ``--output``: results that other verbs read."""
    return typer.Option("--output", "-o", metavar=metavar, help=text, show_default=False)


def study_name_option(text: str) -> Any:
    """Return the option ``--name``, of a study."""
    return typer.Option("--name", metavar="STUDY", help=text, show_default=False)


def json_option(text: str = "Print JSON.") -> Any:
    """Return the flag ``--json``."""
    return typer.Option("--json", help=text)


def set_option(text: str) -> Any:
    """Return the option ``--set``, after which several settings may follow."""
    return typer.Option("--set", metavar="KEY=VALUE ...", help=text)


# Typer reads these where a verb's function is annotated with them. The front door lets several
# values follow one flag whose metavar holds a "=".
Name: TypeAlias = Annotated[
    str, typer.Argument(metavar="NAME", help="The mechanism: see `pkm-gym list`.")
]
SetOption: TypeAlias = Annotated[
    list[str] | None,
    set_option("Task fields (task.payload=1.5kg) and options of the mechanism."),
]
DesignOption: TypeAlias = Annotated[
    list[str] | None,
    set_option(
        "The design, as variables (lam_e=0.6) or dimensions (e=150mm l1=250mm ...); task fields "
        "(task.payload=1.5kg); options of the mechanism."
    ),
]
LoadOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--load",
        metavar="LOAD=VALUE ...",
        help="A load on the platform, held by the drives: components (fy=-20N mz=1Nm), or the size "
        "of one of any direction (force=20N torque=1Nm).",
        show_default=False,
    ),
]
DesignFileOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--design",
        metavar="FILE",
        help="A design.toml, as verbs that find a design write it; --set holds over it.",
        show_default=False,
    ),
]
FixOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--fix", metavar="VARIABLE=VALUE ...", help="Take variables out of the search: lam_e=0.6."
    ),
]
FreeOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--free",
        metavar="VARIABLE",
        help='Search just this variable, or "all"; repeat it for several. The others keep their '
        "default.",
        show_default=False,
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

SigmaOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        metavar="SIZE|NAME=SIZE ...",
        help="Standard deviation of the errors of all lengths (0.1mm), of all angles (0.05deg), or "
        "of one dimension (l1=0.1mm); repeat it for several.",
        show_default=False,
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
PlainJsonOption: TypeAlias = Annotated[
    bool, json_option("Print JSON in SI units, and nothing else on stdout.")
]
JsonOption: TypeAlias = Annotated[
    bool, json_option("Print JSON in SI units only; a picture only if --picture names one.")
]
CsvOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--csv",
        metavar="FILE",
        help="Write a table in SI units, its heads with their units (.csv).",
        show_default=False,
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

SplitsOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--folder",
        metavar="FOLDER",
        help="Of the splits, where `pkm-gym splits -o` wrote them elsewhere.",
        show_default=False,
    ),
]

SeedOption: TypeAlias = Annotated[
    int, typer.Option(metavar="S", min=0, help="Of the random numbers.")
]
TrialsOption: TypeAlias = Annotated[
    int, typer.Option(metavar="N", min=1, help="How many finished trials the study shall have.")
]
WidthOption: TypeAlias = Annotated[int, typer.Option(min=64, max=3840, help="Pixels.")]
HeightOption: TypeAlias = Annotated[int, typer.Option(min=64, max=2880, help="Pixels.")]


OutOption: TypeAlias = Annotated[Path | None, out_option("Where it goes.")]
