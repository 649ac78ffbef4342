"""Start-up: importing the package, and the first step of an environment, in a new process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

IMPORT = "import pkm_gym"
FIRST_STEP = """
import gymnasium
env = gymnasium.make("pkm_gym:PKM/Diamond-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
"""


def start(code: str, cache: Path | None = None) -> None:
    environment = {**os.environ, **({"NUMBA_CACHE_DIR": str(cache)} if cache else {})}
    subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=True)


def measure(benchmark: Any, row: str, target: str, rounds: int, *arguments: Any) -> None:
    benchmark.extra_info.update({"row": row, "target": target})
    benchmark.pedantic(start, arguments, rounds=rounds, warmup_rounds=int(rounds > 1))


def test_python(benchmark: Any) -> None:
    measure(benchmark, "python itself", "", 10, "pass")


def test_import(benchmark: Any) -> None:
    measure(benchmark, "python, import pkm_gym", "<= 1 s", 10, IMPORT)


def test_first_step_warm(benchmark: Any) -> None:
    measure(benchmark, "python to the first env step, warm cache", "", 5, FIRST_STEP)


def test_first_step_cold(benchmark: Any, tmp_path: Path) -> None:
    measure(benchmark, "python to the first env step, cold cache", "", 1, FIRST_STEP, tmp_path)
