"""The own limits of planar machines of two limbs, as a declaration names them."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from pkm_gym.core.rows import own


class ReachLimits(NamedTuple):
    """What ``core.planar`` fills; its ``reach_margins`` are the other two, with a minus."""

    dimensions: Annotated[float, own("the lengths make a machine")]
    reach_inner: Annotated[float, own("the limbs fold far enough for the workspace's top edge")]
    reach_outer: Annotated[float, own("the limbs reach the workspace's bottom corners")]


REACH = ReachLimits._fields
