"""The benchmark: tasks with certified optima, one metric, tracks, opponents. See docs/benchmark.md.

``load_split`` gives tasks with their optima, ``method`` makes a method that can be entered, ``run``
runs one, ``regrets`` and ``score`` measure what it did.
"""

from pkm_gym.benchmark.interpolation import Interpolation
from pkm_gym.benchmark.methods import METHODS, Method, find_method, method, proposing
from pkm_gym.benchmark.record import Cost, EvaluationLog, Setting
from pkm_gym.benchmark.recording import RecordEvaluations
from pkm_gym.benchmark.run import run, setting
from pkm_gym.benchmark.scoring import duel, interval, regrets, score
from pkm_gym.benchmark.session import Session, Spent
from pkm_gym.benchmark.splits import load_split
from pkm_gym.benchmark.training import Training
from pkm_gym.benchmark.view import Told, View
from pkm_gym.core.declaration import SPLITS

__all__ = [
    "METHODS",
    "SPLITS",
    "Cost",
    "EvaluationLog",
    "Interpolation",
    "Method",
    "RecordEvaluations",
    "Session",
    "Setting",
    "Spent",
    "Told",
    "Training",
    "View",
    "duel",
    "find_method",
    "interval",
    "load_split",
    "method",
    "proposing",
    "regrets",
    "run",
    "score",
    "setting",
]
