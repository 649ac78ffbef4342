"""pkm_gym: a gymnasium for designing parallel kinematic machines.

``problems()`` names the design problems and ``make_problem(name)`` makes one; importing the package
registers its Gymnasium environments.
"""

from pkm_gym.mechanisms import make_problem, problems

__all__ = ["make_problem", "problems"]
