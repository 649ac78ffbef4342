"""Agents that are trained to design, and the trained ones that are shipped.

``load_designer(name)`` loads one; ``pkm-gym zoo`` lists them.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pkm_gym.agents.designers.library import load_designer
    from pkm_gym.agents.designers.sampler import DesignerSampler

_HOMES = {
    "DesignerSampler": "pkm_gym.agents.designers.sampler",
    "load_designer": "pkm_gym.agents.designers.library",
}

__all__ = ["DesignerSampler", "load_designer"]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
