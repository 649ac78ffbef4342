"""The 5-PSS/UPU's figures: the paper's, and what its singularity at home means."""

from __future__ import annotations

from pkm_gym.mechanisms.pss5_upu.figures import free_motion
from pkm_gym.plots.pictures import machine_pictures

PICTURES = {
    "pss5_upu": {**machine_pictures("pss5_upu"), **free_motion.PICTURES},
    "pss5_upu_skew": machine_pictures("pss5_upu_skew", printed=False),
}
ANIMATIONS = {"pss5_upu": free_motion.ANIMATIONS}
