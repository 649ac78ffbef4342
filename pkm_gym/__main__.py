"""The front door: the command ``pkm-gym``. It knows the verbs by name and imports one when asked.

A verb's mistakes by the user are ``ValueError`` or ``OSError``; they leave as one sentence on
stderr and exit code 2, or 1 for a ``TimeoutError``: a database that doesn't answer any more.
"""

from __future__ import annotations

import inspect
import sys
from importlib.metadata import version
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperCommand, TyperGroup

from pkm_gym.core.names import imported, unknown
from pkm_gym.usage import usage

STUDIES, AGENTS = "pkm_gym.studies.verbs", "pkm_gym.agents.verbs"

# verb -> the function that does it, what it does
VERBS = {
    "list": (f"{STUDIES}.list:command", "Show the design problems, or one in full."),
    "new": (f"{STUDIES}.new:command", "Begin a mechanism of your own."),
    "evaluate": (f"{STUDIES}.evaluate:command", "Evaluate a design of your own."),
    "motors": (f"{STUDIES}.motors:command", "Pick the motors and gears of a design."),
    "study": (
        f"{STUDIES}.study:command",
        "Do grid, search, polish and compare in one go.",
    ),
    "grid": (f"{STUDIES}.grid:command", "Evaluate a grid: the paper's, or ours."),
    "search": (f"{STUDIES}.search:command", "Search the design space with Optuna."),
    "polish": (f"{STUDIES}.polish:command", "Refine a design to the optimum near it."),
    "round": (
        f"{STUDIES}.round:command",
        "Round a design to dimensions that can be built.",
    ),
    "tolerance": (f"{STUDIES}.tolerance:command", "Build a design with errors: the yield."),
    "sensitivity": (
        f"{STUDIES}.sensitivity:command",
        "Tell what dimensions and limits are worth.",
    ),
    "compare": (
        f"{STUDIES}.compare:command",
        "Compare searches with the paper's optimum.",
    ),
    "pareto": (f"{STUDIES}.pareto:command", "Show the front of several objectives."),
    "dashboard": (f"{STUDIES}.dashboard:command", "Open the studies in a browser."),
    "figures": (f"{STUDIES}.figures:command", "Draw the paper's figures with our model."),
    "design": (f"{AGENTS}.design:command", "Have a trained designer answer a task."),
    "zoo": (f"{AGENTS}.zoo:command", "List the trained designers that are shipped."),
    "agent-eval": (
        f"{AGENTS}.agent_eval:command",
        "Score trained agents on unseen tasks.",
    ),
    "motion-eval": (
        f"{AGENTS}.motion_eval:command",
        "Score who drives a twin on its path.",
    ),
    "train": (f"{AGENTS}.train:command", "Train an agent that designs, or drives."),
    "tune": (f"{AGENTS}.tune:command", "Search an algorithm's hyperparameters."),
    "twin-check": (f"{STUDIES}.twin_check:command", "Compare the models with MuJoCo."),
    "validate": (
        f"{STUDIES}.validate:command",
        "Try torque indices on simulated machines.",
    ),
    "page": (f"{STUDIES}.page:command", "Make a problem's page from what is declared."),
    "picture": (f"{STUDIES}.picture:command", "Photograph a design with MuJoCo."),
    "movie": (f"{STUDIES}.movie:command", "Film a design on its path."),
    "export": (f"{STUDIES}.export:command", "Write a design's MuJoCo model (MJCF)."),
    "solve-tasks": (
        f"{STUDIES}.solve_tasks:command",
        "Draw tasks and solve each to its optimum.",
    ),
    "benchmark": (
        f"{STUDIES}.benchmark:command",
        "Rank methods on tasks with known optima.",
    ),
    "calibrate": (
        f"{STUDIES}.calibrate:command",
        "Measure what merit must know of a problem.",
    ),
    "restamp": ("pkm_gym.agents.verbs.restamp:command", "Renew files of an older version."),
    "score": (f"{STUDIES}.score:command", "Score logs of what a method evaluated."),
    "splits": (
        f"{STUDIES}.splits:command",
        "Make the benchmark's tasks and their optima.",
    ),
}

# module -> the extra that brings it
EXTRAS = {
    "SALib": "studies",
    "cma": "studies",
    "cmaes": "studies",
    "imageio": "movies",
    "imageio_ffmpeg": "movies",
    "netCDF4": "studies",
    "optuna": "studies",
    "optuna_dashboard": "studies",
    "plotly": "studies",
    "xarray": "studies",
    "tomli_w": "studies",
    "safetensors": "agents",
    "sb3_contrib": "agents",
    "stable_baselines3": "agents",
    "torch": "agents",
}

UNANSWERED = 1
USER_ERROR = 2
INTERRUPTED = 130


class Verb(TyperCommand):
    """A verb as the overview shows it; running it, or asking for its help, imports its module."""

    def make_context(self, info_name: str | None, args: list[str], *more: Any, **extra: Any) -> Any:
        """Return the context of the real command."""
        return _load(str(self.name)).make_context(info_name, args, *more, **extra)


class Command(TyperCommand):
    """A verb's real command; after a flag that takes NAME=VALUE, several may follow."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse with the flag put before each further value."""
        flags = {
            flag
            for parameter in self.params
            if "=" in (getattr(parameter, "metavar", None) or "")
            for flag in parameter.opts
        }
        return super().parse_args(ctx, _spread(args, flags))


class Door(TyperGroup):
    """All verbs, and what becomes of their errors."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**{**attributes, "subcommand_metavar": "VERB ..."})
        for name, (_, line) in VERBS.items():
            self.add_command(Verb(name, help=line, rich_help_panel="Verbs"))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Refuse an unknown verb with its closest match."""
        if args[0] not in VERBS:
            raise ValueError(unknown("verb", args[0], VERBS))
        return super().resolve_command(ctx, args)

    def main(self, *args: Any, **options: Any) -> NoReturn:
        """Run and exit: 0, 1 without an answer, 2 after a user's mistake, 130 after Ctrl-C."""
        try:
            code = super().main(*args, **{**options, "standalone_mode": False})
        except ModuleNotFoundError as error:
            _refuse(_missing(error))
        except TimeoutError as error:
            _refuse(_sentence(error), UNANSWERED)
        except (ValueError, OSError) as error:
            _refuse(_sentence(error))
        except typer.Abort as error:  # so typer calls an end of file; nobody is asked, so a bug
            raise (error.__cause__ or error) from None
        except Exception as error:
            if not hasattr(error, "format_message"):
                raise
            _refuse(usage(error))
        if code == INTERRUPTED:
            print("pkm-gym: interrupted", file=sys.stderr)
        sys.exit(code if isinstance(code, int) else 0)


HELP = {"help_option_names": ["-h", "--help"]}
PLAIN: dict[str, Any] = {"add_completion": False, "pretty_exceptions_enable": False}

app = typer.Typer(cls=Door, invoke_without_command=True, context_settings=HELP, **PLAIN)


@app.callback()
def door(
    context: typer.Context,
    show_version: Annotated[bool, typer.Option("--version", help="Show the version.")] = False,
) -> None:
    """Design parallel kinematic machines: evaluate, search, compare."""
    if show_version:
        print(f"pkm_gym {version('pkm_gym')}")
    elif context.invoked_subcommand is None:
        print(context.get_help(), end="")


def _load(verb: str) -> Any:
    function = imported(VERBS[verb][0])
    single = typer.Typer(**PLAIN)
    paragraphs = inspect.cleandoc(function.__doc__ or "").split("\n\n")
    text = "\n\n".join(" ".join(lines.split()) for lines in paragraphs)
    single.command(verb, cls=Command, context_settings=HELP, help=text)(function)
    return typer.main.get_command(single)


def _spread(args: list[str], flags: set[str]) -> list[str]:
    """Return ``--set a=1 b=2`` as ``--set a=1 --set b=2``, and so ``--to 1mm b=2mm``."""
    spread: list[str] = []
    flag = ""
    for at, argument in enumerate(args):
        if argument.partition("=")[0] in flags:
            flag = argument.partition("=")[0]
        elif argument.startswith("-") or ("=" not in argument and args[at - 1] != flag):
            flag = ""
        elif flag and args[at - 1] != flag:
            spread.append(flag)
        spread.append(argument)
    return spread


def _missing(error: ModuleNotFoundError) -> str:
    module = str(error.name).partition(".")[0]
    if module not in EXTRAS:
        raise error
    extra = EXTRAS[module]
    return (
        f'this verb needs the extra "{extra}" (there is no module {module}): '
        f'pip install "pkm_gym[{extra}]"'
    )


def _sentence(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error)


def _refuse(sentence: str, code: int = USER_ERROR) -> NoReturn:
    print(f"pkm-gym: {sentence}", file=sys.stderr)
    sys.exit(code)


def main() -> None:
    """Run the command line."""
    app(prog_name="pkm-gym")


if __name__ == "__main__":
    main()
