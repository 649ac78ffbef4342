"""Pictures: mechanism drawings, index maps over the workspace, maps of the design space.

Every function returns or fills a matplotlib ``Figure`` of its own; pyplot, its global state and a
display are never needed, so that threads may draw at the same time. Lengths are drawn in mm and
angles in degrees.
"""

from pkm_gym.plots.canvas import figure_to_array, save, save_animation
from pkm_gym.plots.design import design_figure, index_map_figure
from pkm_gym.plots.machine import draw_machine
from pkm_gym.plots.space import Slice, draw_bounds, draw_infeasible, draw_slice, draw_valley, mark
from pkm_gym.plots.style import (
    STYLE,
    headline,
    label,
    legend,
    new_figure,
    panel,
    remark,
    shown,
    symbol,
)

__all__ = [
    "STYLE",
    "Slice",
    "design_figure",
    "draw_bounds",
    "draw_infeasible",
    "draw_machine",
    "draw_slice",
    "draw_valley",
    "figure_to_array",
    "headline",
    "index_map_figure",
    "label",
    "legend",
    "mark",
    "new_figure",
    "panel",
    "remark",
    "save",
    "save_animation",
    "shown",
    "symbol",
]
