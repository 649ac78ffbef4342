"""``pkm-gym export``: the MuJoCo model of a design."""

from __future__ import annotations

from pkm_gym.core.files import whole_file
from pkm_gym.studies.cli.arguments import machine_from
from pkm_gym.studies.cli.options import DesignFileOption, DesignOption, Name, OutOption
from pkm_gym.studies.cli.runs import output_path
from pkm_gym.studies.twins.model import model_text

MODELS = (".xml",)


def command(
    name: Name, set_: DesignOption = None, design: DesignFileOption = None, out: OutOption = None
) -> None:
    """Write the MuJoCo model (MJCF) of a design; without one, of the design that the paper prints.

    Writes runs/NAME/twin.xml if --out names no other file. Open it with
    python -m mujoco.viewer --mjcf=FILE: its servos hold the pose, their sliders move it.

    Example: pkm-gym export diamond --set l1=260mm e=150mm l2=640mm H=493mm --out diamond.xml
    """
    path = output_path(out, name, "twin", MODELS)
    machine, notes = machine_from(name, set_, design)
    text, wrong = model_text(machine)
    notes += (wrong,) if wrong else ()
    with whole_file(path) as part:
        part.write_text(text, encoding="utf-8")
    print(*notes, f"model: {path}", sep="\n")
