"""The five-bar as a Mechanism: the planar machine of two limbs, with what is mapped of it."""

from __future__ import annotations

from dataclasses import dataclass

from pkm_gym.core.mechanism import IndexMap
from pkm_gym.core.planar import PlanarMachine
from pkm_gym.core.types import FloatArray


@dataclass(frozen=True, slots=True)
class FiveBar(PlanarMachine):
    """A symmetric five-bar over its workspace: the rods meet in the tool, elbows outwards."""

    twin_module = "five_bar.twin"

    def index_maps(self, pose: FloatArray) -> dict[str, IndexMap]:
        """Return conditioning, arm rate and transmission angles at poses (..., 2)."""
        local = self.local_indices(pose)
        maps = self.limb_maps(local)
        conditioning = 1.0 / maps["condition"].values
        rate = 1.0 / (self.l1 * local["sin_beta"])
        return {
            "gci": IndexMap(
                "conditioning", "", "mean", conditioning, doc="1 / condition number of J"
            ),
            "rate": IndexMap(
                "rate", "1/m", "max", rate, doc="larger arm rate (rad/s) at a tool's speed of 1 m/s"
            ),
            **maps,
        }
