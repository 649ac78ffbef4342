"""The 3-SPR's figures: Figs 2-6 of the paper with our model, the machine, the atlas of designs."""

from __future__ import annotations

from pkm_gym.mechanisms.spr3.figures import atlas, path, run, workspace
from pkm_gym.plots.pictures import Solid, machine_pictures

PICTURES = {
    "spr3": {
        **machine_pictures("spr3"),
        **path.PICTURES,
        **run.PICTURES,
        **workspace.PICTURES,
        **atlas.PICTURES,
    },
    "spr3_cylinder": machine_pictures("spr3_cylinder"),
}
SOLIDS = {
    "spr3": {
        "envelope": Solid("the workspace's envelope, in metres", workspace.write_envelope, True)
    }
}
