"""``pkm-gym motion-eval``: baselines and trained agents on the path of a twin."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.console import Console

from pkm_gym.agents.runs.environments import find_spec, is_motion
from pkm_gym.agents.runs.options import USUAL
from pkm_gym.agents.runs.recipe import read_recipe
from pkm_gym.agents.sb3.motion import load_driver
from pkm_gym.envs.baselines import BASELINES, Controller, Run, run
from pkm_gym.envs.motion import MotionEnv
from pkm_gym.studies.cli.options import (
    CsvOption,
    PlainJsonOption,
    SeedOption,
    out_option,
    set_option,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.terminal import FAINT, counter, table
from pkm_gym.twin.check import random_designs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Scores = dict[str, list[Run]]


def command(
    env: Annotated[
        str, typer.Argument(metavar="ENV", help="Id of a motion environment: PKM/DiamondMotion-v0.")
    ],
    models: Annotated[
        list[str] | None,
        typer.Argument(metavar="MODEL ...", help="Folders of training runs, or .json files."),
    ] = None,
    designs: Annotated[
        int, typer.Option(metavar="N", min=0, help="Random feasible designs, after the printed.")
    ] = 0,
    seed: SeedOption = 0,
    set_: Annotated[
        list[str] | None,
        set_option(
            "Arguments of the environment, as `pkm-gym train` takes them: environment.KEY=x."
        ),
    ] = None,
    out: Annotated[
        Path | None, out_option("Draw the errors of those that finish the path.")
    ] = None,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Let baselines and trained agents drive a twin along its path, and score them.

    The printed design is driven once by each; with --designs, random feasible ones too, and the
    table shows the mean of the rewards and the worst of the errors.

    Example: pkm-gym motion-eval PKM/DiamondMotion-v0 runs/agents/DiamondMotion-v0-ppo-0
    """
    sent = Output(as_json, csv)
    spec = find_spec(env, motion=True)
    if not is_motion(spec):
        raise ValueError(f"{spec.id} is no motion environment: nothing moves in it")
    settings = list(set_ or ())
    if others := [word for word in settings if not word.startswith("environment.")]:
        raise ValueError(f"--set {others[0]} is none of the environment's: write environment.KEY=x")
    recipe = read_recipe(USUAL, "", settings=settings)
    machine = MotionEnv(**{**spec.kwargs, **recipe.environment})
    controllers = _controllers(machine, models or [])
    chosen = [machine.problem.printed_design()]
    if designs:
        chosen += list(random_designs(machine.problem, designs, seed))
    scores: Scores = {}
    with counter(sent.bars, "runs") as bar:
        line = bar.add_task("", total=len(controllers) * len(chosen))
        for name, controller in controllers.items():
            bar.update(line, description=name)
            scores[name] = []
            for k, design in enumerate(chosen):
                options = {"design": design}
                scores[name].append(run(machine, controller, seed=k, options=options))
                bar.advance(line)
    if out is not None:
        from pkm_gym.plots import save

        save(error_figure(machine, _finished(scores)), out, dpi=150)
    _show(sent.screen, scores, out)
    rows = [{"driver": name, **summary(runs)} for name, runs in scores.items()]
    units = {"rms_error": "m", "peak_error": "m"}
    sent.give({"environment": spec.id, "units": units, "rows": rows})


def summary(runs: list[Run]) -> dict[str, Any]:
    """Return the mean reward and the worst errors (m) and share of the limit of some runs."""
    return {
        "finished": sum(one.reason == "finished" for one in runs),
        "runs": len(runs),
        "mean_reward": float(np.mean([one.mean_reward for one in runs])),
        "rms_error": max(one.rms for one in runs),
        "peak_error": max(float(one.errors.max()) for one in runs),
        "peak_share": max(float(np.abs(one.shares).max()) for one in runs),
        "reasons": sorted({one.reason for one in runs}),
    }


def error_figure(env: MotionEnv, runs: dict[str, Run]) -> Figure:
    """Draw the tool's distance from the path over time, of runs by name."""
    from pkm_gym import plots

    figure = plots.new_figure(8.0, 3.6)
    plots.headline(
        figure,
        "How far the tool is from the path",
        f"{env.problem.name}, printed design; each controller acts through the environment",
    )
    axes = plots.panel(figure, (0.085, 0.135, 0.69, 0.69), x="time (s)", y="error (mm)")
    for name, one in runs.items():
        times = env.rig.dt * np.arange(1, len(one.errors) + 1)
        axes.plot(times, 1e3 * one.errors, lw=1.2, label=name)
    axes.set_yscale("log")
    axes.axhline(1.0, color=plots.STYLE["faint"], lw=0.8)
    figure.legend(*axes.get_legend_handles_labels(), loc="center right", frameon=False, fontsize=8)
    return figure


def _controllers(env: MotionEnv, models: list[str]) -> dict[str, Controller]:
    controllers: dict[str, Controller] = dict(BASELINES)
    if not hasattr(env.rig.twin.mechanism, "inverse_dynamics"):
        del controllers["computed-torque"]
    return controllers | {Path(model).name: load_driver(model) for model in models}


def _finished(scores: Scores) -> dict[str, Run]:
    """Return the runs with the printed design that reached the path's end."""
    return {name: runs[0] for name, runs in scores.items() if runs[0].reason == "finished"}


def _show(screen: Console, scores: Scores, out: Path | None) -> None:
    heads = ("driver", "finished", "reward", "RMS mm", "peak mm", "force", "ended")
    rows = table(*heads, numbers=heads[1:6])
    for name, runs in scores.items():
        line = summary(runs)
        rows.add_row(
            name,
            f"{line['finished']}/{line['runs']}",
            f"{line['mean_reward']:.4f}",
            *(f"{1e3 * line[error]:.3f}" for error in ("rms_error", "peak_error")),
            f"{100.0 * line['peak_share']:.0f} %",
            ", ".join(line["reasons"]),
        )
    screen.print(rows)
    several = any(len(runs) > 1 for runs in scores.values())
    screen.print(
        "reward: the mean; errors and force (of the limit): the worst of the runs"
        if several
        else "one run each; reward: the mean over its steps; force: of the limit",
        style=FAINT,
    )
    if out is not None:
        screen.print(f"picture: {out}")
