"""MJCF with all digits: MuJoCo writes six, which opens a twin's loops by a micrometre."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import mujoco
import numpy as np

DIGITS = 17  # that a float64 needs to be read back to the bit
LIBRARIES = ("libmujoco*", "mujoco.dll")
NUMBER = re.compile(r'(?<=[" ])-?\d+\.\d+(?:e[-+]\d+)?(?=[" ])')
SETTER, GETTER = "_mjPRIVATE__set_xml_precision", "_mjPRIVATE__get_xml_precision"


def mjcf(spec: mujoco.MjSpec) -> str:
    """Return a compiled model as MJCF from which the same model is read."""
    with _all_digits():
        text: str = spec.to_xml()
    return NUMBER.sub(lambda found: repr(float(found[0])), text)


def moved(spec: mujoco.MjSpec, text: str) -> float:
    """Return how far (m) a body or site of MJCF stands from where the compiled model has it."""
    places = []
    for model in (spec.compile(), mujoco.MjModel.from_xml_string(text)):
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        places.append(np.concatenate([data.xpos, data.site_xpos]))
    return float(np.abs(places[0] - places[1]).max())


@contextmanager
def _all_digits() -> Iterator[None]:
    """Have MuJoCo write all digits, as its own tests do; a release without that writes six."""
    folder = Path(mujoco.__file__).parent
    found = [path for pattern in LIBRARIES for path in folder.glob(pattern)]
    library = ctypes.CDLL(str(found[0])) if found else None
    if not (hasattr(library, SETTER) and hasattr(library, GETTER)):
        yield
        return
    before = getattr(library, GETTER)()
    getattr(library, SETTER)(DIGITS)
    try:
        yield
    finally:
        getattr(library, SETTER)(before)
