"""The 6-PUS's figures: Figs 2-8 and both tables of the paper, and what its averages hide."""

from __future__ import annotations

from pkm_gym.mechanisms.pus6.figures import atlas, choice, findings, machine, sections
from pkm_gym.plots.pictures import machine_pictures

PICTURES = {
    "pus6": {
        **machine_pictures("pus6"),
        **atlas.PICTURES,
        **choice.PICTURES,
        **findings.PICTURES,
        **machine.PICTURES,
        **sections.PICTURES,
    },
    "pus6_layout": machine_pictures("pus6_layout", printed=False),
}
