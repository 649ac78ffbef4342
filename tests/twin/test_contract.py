"""What a mechanism's twin.py must hold, and what is said where it doesn't."""

from __future__ import annotations

import sys
from types import ModuleType

import numpy as np
import pytest

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.twin import CONTRACT, TwinModule, twin_module
from pkm_gym.twin.rig import Rig


def test_the_contract_is_the_protocol() -> None:
    said = {name for name in (*TwinModule.__annotations__, *vars(TwinModule)) if name[0] != "_"}
    assert set(CONTRACT) == said


def test_what_a_module_lacks_is_named(machine: Mechanism, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = twin_module(machine)
    lacking = ModuleType("lacking")
    vars(lacking).update({name: getattr(whole, name) for name in CONTRACT})
    del lacking.margins, lacking.course
    monkeypatch.setitem(sys.modules, "lacking", lacking)
    monkeypatch.setattr(type(machine), "twin_module", "lacking")
    with pytest.raises(ValueError, match=r"^lacking lacks margins, course: the module of a twin"):
        twin_module(machine)


def test_a_twin_that_cannot_stand_in_its_mode_is_not_driven(
    machine: Mechanism, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = twin_module(machine)
    assert Rig(machine).assembled
    monkeypatch.setattr(module, "margins", lambda *_: np.array([1.0, -1e-9]))
    with pytest.raises(ValueError, match="its twin can't stand in its assembly mode"):
        Rig(machine)
