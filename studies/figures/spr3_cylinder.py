"""The figures of the 3-SPR that covers a cylinder: the machine and its index maps."""

from __future__ import annotations

from pkm_gym.studies.figures import machine_pictures

PICTURES = machine_pictures("spr3_cylinder")
