"""``pkm-gym zoo``: the trained designers that are shipped, and how one is taken in."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from pkm_gym.agents.designer import Designer
from pkm_gym.agents.files import CONFIG, Origin, load_designer_file
from pkm_gym.core.names import check_known
from pkm_gym.studies.terminal import console, table

FOLDER = Path(__file__).parent / "zoo"
