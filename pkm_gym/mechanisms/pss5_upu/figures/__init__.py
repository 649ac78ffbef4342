"""The 5-PSS/UPU's figures: Figs 1-7 of the paper, and what they don't show."""

from __future__ import annotations

from pkm_gym.mechanisms.pss5_upu.figures import atlas, free_motion, machine, positions, weights
from pkm_gym.plots.pictures import machine_pictures

PICTURES = {
    "pss5_upu": {
        **machine_pictures("pss5_upu"),
        **atlas.PICTURES,
        **free_motion.PICTURES,
        **machine.PICTURES,
        **positions.PICTURES,
        **weights.PICTURES,
    },
    "pss5_upu_skew": machine_pictures("pss5_upu_skew", printed=False),
}
ANIMATIONS = {"pss5_upu": free_motion.ANIMATIONS}
