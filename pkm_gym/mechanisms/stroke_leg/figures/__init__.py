"""The leg's figures: Figs 3-8 of the paper with our model, the machine, thrust against flow."""

from __future__ import annotations

from pkm_gym.mechanisms.stroke_leg.figures import gait, indices, leg, motion
from pkm_gym.plots.pictures import Animation, Picture, machine_pictures

PICTURES = {
    "stroke_leg": {
        **machine_pictures("stroke_leg"),
        "fig3_workspace": Picture("the workspace, as in Fig. 3", leg.workspace),
        "fig4_condition": Picture(
            "condition number and dead lines, as in Fig. 4", indices.condition
        ),
        "fig5_sweeps": Picture("indices over each variable, as in Fig. 5", indices.sweeps),
        "fig6_trot": Picture("the trot, as in Fig. 6", motion.trot),
        "fig7_speeds": Picture("cylinders over a step, as in Fig. 7", motion.speeds),
        "fig8_errors": Picture(
            "piston speeds, theory against twin, as in Fig. 8", motion.speed_errors
        ),
        "comparison": Picture("printed design and verified optimum", leg.comparison),
    },
    "stroke_leg_gait": {
        **machine_pictures("stroke_leg_gait", printed=False),
        "thrust_rate": Picture("least thrust over the pistons' speed", gait.thrust_against_rate),
    },
}
ANIMATIONS = {
    "stroke_leg": {"trot": Animation("the trot of four legs", motion.trot_frames, motion.FPS, True)}
}
