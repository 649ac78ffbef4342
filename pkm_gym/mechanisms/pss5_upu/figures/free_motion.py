"""The free motion at home: the paper's layout and one that holds, pushed by the same force."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from pkm_gym import plots
from pkm_gym.core.names import imported
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import make_problem
from pkm_gym.mechanisms.pss5_upu.free_motion import FORCE, STIFFNESS, free_motion, pushed
from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu
from pkm_gym.plots.pictures import Animation, Picture
from pkm_gym.plots.style import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem

TWIN, CAMERA = "pkm_gym.twin.model:Twin", "pkm_gym.twin.camera:Camera"  # of a room beside plots
WIDTH = 7.2  # inches, a page's two columns
WIDE, HIGH = 720, 540  # pixels of a photograph
GHOST = 0.3  # of the machine at home, behind the pushed one
ARROW = 0.3  # m
FRAMES, FPS = 40, 20.0
LAYOUTS = {"the paper's layout": "pss5_upu", "a layout that holds": "pss5_upu_skew"}


def machines() -> dict[str, Pss5Upu]:
    """Return both machines, by what they are."""
    found = {}
    for title, name in LAYOUTS.items():
        problem = make_problem(name)
        machine = problem.mechanism(problem.printed_design())
        assert isinstance(machine, Pss5Upu)
        found[title] = machine
    return found


def push(problem: DesignProblem) -> Figure:
    """Draw how far a push moves both machines, over the servos' stiffness, and photograph them."""
    del problem
    figure = plots.new_figure(WIDTH, 4.6)
    plots.headline(
        figure,
        "A push at home: the paper's layout gives way, however stiff its servos are",
        f"MuJoCo twins without weight; {FORCE:g} N along x on the platform's centre; photographs: "
        f"servos of {STIFFNESS:g} N/m, pale: without the push",
    )
    axes = plots.panel(
        figure, (0.085, 0.11, 0.44, 0.74), x="stiffness of the servos (N/m)", y="way (mm)"
    )
    axes.set(xscale="log", yscale="log")
    with imported(CAMERA)(WIDE, HIGH) as camera:
        for row, (title, machine) in enumerate(machines().items()):
            color = plots.STYLE["lines"][1 - row]
            _draw_curves(axes, title, machine, color)
            beside = figure.add_axes((0.555, 0.45 - 0.435 * row, 0.435, 0.43))
            pictures = _Stand(machine, camera)
            at = pushed(machine, np.array([FORCE]))
            pale = GHOST * pictures.shot() + (1.0 - GHOST) * pictures.shot(at.coordinates[0])
            _show(beside, pale.astype(np.uint8), title)
            pictures.draw_force(beside, at.frames[0, :, 3], 1.0)
    axes.margins(x=0.16, y=0.08)
    axes.grid(visible=True, color=plots.STYLE["grid"], linewidth=0.5)
    plots.legend(axes, loc="lower left")
    return figure


def pushed_frames(problem: DesignProblem) -> Iterator[Figure]:
    """Draw both machines while a force swings along x, a figure a frame."""
    del problem
    phases = np.arange(FRAMES) + 0.5  # never without a force: nothing would bring it to rest
    shares = np.sin(2.0 * np.pi * phases / FRAMES)
    with imported(CAMERA)(WIDE, HIGH) as camera:
        stands = {
            title: (_Stand(machine, camera), pushed(machine, FORCE * shares))
            for title, machine in machines().items()
        }
        for k, share in enumerate(shares.tolist()):
            figure = plots.new_figure(WIDTH, 3.15)
            for column, (title, (stand, at)) in enumerate(stands.items()):
                axes = figure.add_axes((0.5 * column, 0.14, 0.5, 0.857))
                _show(axes, stand.shot(at.coordinates[k]), title)
                stand.draw_force(axes, at.frames[k, :, 3], share)
                moved = at.frames[k, :, 3] - stand.home
                figure.text(
                    0.5 * column + 0.02, 0.045,
                    f"{FORCE * share:+4.0f} N: platform {1e3 * moved[0]:+.1f} mm, sliders at most "
                    f"{1e3 * np.abs(at.deflections[k]).max():.2f} mm".replace("-", "−"),
                    **words("small"),
                )  # fmt: skip
            yield figure


PICTURES = {"free_motion": Picture("a push at home, of the paper's layout and another", push)}
ANIMATIONS = {
    "pushed": Animation("both layouts pushed to and fro at home", pushed_frames, FPS),
}


class _Stand:
    """A machine's twin before a camera."""

    def __init__(self, machine: Pss5Upu, camera: Any) -> None:
        self.twin, self.camera = imported(TWIN)(machine, machine.home), camera
        self.home = machine.home[:3]

    def shot(self, coordinates: FloatArray | None = None) -> FloatArray:
        """Return a photograph (height, width, 3) at coordinates (nq,), or at home."""
        twin = self.twin
        twin.place(twin.model.qpos0 if coordinates is None else coordinates)
        return np.asarray(self.camera.shot(twin))

    def draw_force(self, axes: Axes, centre: FloatArray, share: float) -> None:
        """Draw an arrow to the platform's centre (3,), as long as the force is large."""
        if abs(share) < 0.05:
            return
        ends = np.stack([centre - share * ARROW * np.array([1.0, 0.0, 0.0]), centre])
        tail, tip = self._seen(self.twin.in_world(ends))
        axes.annotate(
            "", tip, tail, zorder=5,
            arrowprops={"arrowstyle": "-|>", "color": plots.STYLE["bad"], "linewidth": 2.2,
                        "mutation_scale": 13, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip

    def _seen(self, points: FloatArray) -> FloatArray:
        """Return where points (n, 3), m, of the world are in the photograph (n, 2), pixels."""
        model, data = self.twin.model, self.twin.data
        camera = model.camera("picture").id
        seen = (points - data.cam_xpos[camera]) @ data.cam_xmat[camera].reshape(3, 3)
        half = np.tan(0.5 * np.radians(model.cam_fovy[camera]))
        across = seen[:, :2] / (-seen[:, 2:] * half)
        return 0.5 * np.array([WIDE, HIGH]) + 0.5 * HIGH * across * np.array([1.0, -1.0])


def _draw_curves(axes: Axes, title: str, machine: Pss5Upu, color: str) -> None:
    """Draw the platform's way and the worst slider's, mm, over the servos' stiffness."""
    found = free_motion(machine)
    platform, sliders = 1e3 * found.displacements, 1e3 * np.abs(found.deflections).max(axis=1)
    for values, name, style in ((platform, "platform", "-"), (sliders, "worst slider", "--")):
        axes.plot(
            found.stiffnesses, values, color=color, linestyle=style, linewidth=1.4, marker="o",
            markersize=3.5, label=f"{title}, {name}",
        )  # fmt: skip
    for stiffness, value in zip(found.stiffnesses, platform, strict=True):
        plots.remark(axes, _length(value), (stiffness, value), dot=False)


def _length(way: float) -> str:
    """Return a way, mm, in words."""
    number, unit = (way, "mm") if way > 0.1 else (1e3 * way, "µm")
    return f"{number:.0f} {unit}" if number > 10.0 else f"{number:.2g} {unit}"


def _show(axes: Axes, pixels: Any, title: str) -> None:
    axes.imshow(pixels)
    axes.set_axis_off()
    axes.text(12, 12, title, va="top", **words("text", weight="bold"))
