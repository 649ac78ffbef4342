"""What the paper says of trends and of its optimum in words, each computed, with a verdict."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reference import Claim
from pkm_gym.mechanisms import make_problem
from pkm_gym.mechanisms.diamond.cycle import driven
from pkm_gym.mechanisms.diamond.declared import DiamondTask
from pkm_gym.mechanisms.diamond.findings import INTERVALS, Findings
from pkm_gym.mechanisms.diamond.mechanism import Diamond
from pkm_gym.mechanisms.diamond.problem import REFERENCE, SCAN
from pkm_gym.mechanisms.diamond.transmission import least_angles

MOSTLY = 0.8  # share of the steps from which on a trend counts as reproduced in so many of them
COARSE = ((0.08, 0.01), (0.16, 0.01), (0.1, 0.02), (0.04, 0.03), (0.02, 0.05))  # lam_l, lam_H
FINE = ((0.01, 0.01), (0.02, 0.02))


def claims(findings: Findings | None = None) -> tuple[Claim, ...]:
    """Return all statements in the paper's order; a few seconds."""
    return tuple(_claims(findings or Findings()))


def _claims(findings: Findings) -> Iterator[Claim]:
    yield _inertia_dominates(findings)
    yield _speed_against_accuracy(findings)
    yield _only_necessary(findings)
    yield _falls_with_lam_e(findings)
    yield _rises_with_both(findings)
    yield _folded(findings, "Fig. 4, conclusion 1: tau_G has a near-linear valley.", "tau_G")
    yield _sigma_min(findings, 1, "Fig. 5: min sigma_min rises with lam_H.", rises=True)
    yield _sigma_min(findings, 0, "Fig. 5: min sigma_min falls with lam_l.", rises=False)
    yield _narrowed(findings, "sigma_min")
    yield _folded(findings, "Fig. 6: max sigma_max is folded like tau_G.", "sigma_max")
    yield _narrowed(findings, "sigma_max")
    yield _empty(findings)
    yield _active(findings)
    yield _shrinks(findings)
    yield _wide_spacing(findings)
    yield _reaches_the_bound(findings)
    yield _place()
    yield _least_torque(findings)


def _inertia_dominates(findings: Findings) -> Claim:
    machine = findings.problem.mechanism(findings.problem.printed_design())
    assert isinstance(machine, Diamond)
    found = driven(machine, findings.problem.task).parts
    parts = {name: np.abs(torque).max() for name, torque in found.items()}
    inertia, velocity, gravity = (parts[name] for name in ("inertia", "velocity", "gravity"))
    return Claim(
        "Section 2.2: inertia dominates the torque, gravity and velocity terms may be dropped.",
        f"on our cycle the printed design has peaks of {inertia:.1f}, {velocity:.1f} (velocity) "
        f"and {gravity:.1f} N m (gravity)",
        f"inertia dominates; the velocity terms are {_percent(velocity / inertia)} of it",
    )


def _speed_against_accuracy(findings: Findings) -> Claim:
    optima = [REFERENCE.optima[name].design for name in ("sigma_min", "sigma_max")]
    rows = np.array([findings.problem.design(values) for values in optima])
    found = findings.problem.evaluate(rows).indices
    (low, other_low), (other_high, high) = found["sigma_min"], found["sigma_max"]
    return Claim(
        "Section 2.3.2, (16), (17): accuracy and speed contradict each other.",
        f"the largest sigma_min, {low:.4f}, has sigma_max {other_high:.4f}; the least sigma_max, "
        f"{high:.4f}, has sigma_min {other_low:.4f}",
        "reproduced" if low > other_low and high < other_high else "contradicted",
    )


def _only_necessary(findings: Findings) -> Claim:
    found = findings.problem.evaluate(findings.problem.printed_design()[None]).indices
    task = DiamondTask()
    beta, alpha = np.degrees(least_angles(task.sigma_low, task.sigma_high))
    least = np.degrees(found["beta_min"][0]), np.degrees(found["alpha_min"][0])
    return Claim(
        "Section 2.3.2: limits of alpha and beta are turned into (19).",
        f"[0.6, 1.5] belongs to theta_F = {beta:.1f}, theta_T = {alpha:.1f} deg; the printed "
        f"design keeps it with beta down to {least[0]:.1f} deg, alpha to {least[1]:.1f} deg",
        "only necessary: limits of the angles imply (19)" if least[0] < beta else "reproduced",
    )


def _falls_with_lam_e(findings: Findings) -> Claim:
    maps = list(findings.maps.values())
    least = [float(np.nanmin(one.tau_G)) for one in maps]
    regular, reached = [], []
    for one, other in pairwise(maps):
        falls = one.tau_G > other.tau_G
        both = np.isfinite(one.tau_G) & np.isfinite(other.tau_G)
        regular.append(float(falls[one.regular & other.regular].mean()))
        reached.append(float(falls[both].mean()))
    shown, everywhere = (
        " and ".join(f"{100.0 * share:.1f}" for share in x) for x in (regular, reached)
    )
    return Claim(
        "Fig. 4: tau_G falls with lam_e (0.2, 0.25, 0.3).",
        f"the least over the map are {', '.join(f'{x:.3f}' for x in least)}; it falls at {shown} % "
        f"of the regular designs, at {everywhere} % of all in reach",
        "reproduced for the minima" if least == sorted(least)[::-1] else "contradicted",
    )


def _rises_with_both(findings: Findings) -> Claim:
    last = findings.last
    in_lam_H, in_lam_l = (last.rising("tau_G", axis) for axis in (1, 0))
    lam_l, _, least = last.valley("tau_G")
    start = int(least.argmin())
    along = float((np.diff(least[start:]) > 0.0).mean())
    verdict = "contradicted"
    if min(in_lam_H, along) > MOSTLY:
        verdict = "reproduced" if in_lam_l > MOSTLY else "reproduced for lam_H, along the valley"
    return Claim(
        "Fig. 4: tau_G rises with lam_H and lam_l.",
        f"between regular designs it rises in {_percent(in_lam_H)} of the steps of lam_H, in "
        f"{_percent(in_lam_l)} of those of lam_l; along the valley, from lam_l = "
        f"{lam_l[start]:.2f} on, in {_percent(along)} of its steps (lam_e = 0.3)",
        verdict,
    )


def _folded(findings: Findings, claim: str, name: str) -> Claim:
    maps = {e: m for e, m in findings.maps.items() if name == "tau_G" or m is findings.last}
    lines = "; ".join(f"{one.line(name)} at lam_e = {lam_e:g}" for lam_e, one in maps.items())
    straight = all(
        np.corrcoef(*one.valley(name)[:2])[0, 1] > 0.99  # rows of one number each
        for one in maps.values()
    )
    return Claim(claim, lines, "reproduced" if straight else "not reproduced")


def _sigma_min(findings: Findings, axis: int, claim: str, *, rises: bool) -> Claim:
    share = findings.last.rising("sigma_min", axis)
    kept = share if rises else 1.0 - share
    verdict = f"reproduced in {_percent(kept)} of the steps" if kept > MOSTLY else "contradicted"
    return Claim(
        claim, f"it falls in {_percent(1.0 - share)} of the steps between regular designs", verdict
    )


def _narrowed(findings: Findings, name: str) -> Claim:
    """Judge which range a stricter bound narrows first."""
    one, values = findings.last, getattr(findings.last, name)
    lower = name == "sigma_min"
    bounds = SCAN.b_l if lower else SCAN.b_u
    spans = [one.ranges(values >= bound if lower else values <= bound) for bound in bounds]
    words = [
        f"{bound:g}: {x[0]:.2f} to {x[1]:.2f}, {y[0]:.2f} to {y[1]:.2f}"
        for bound, (x, y) in zip(bounds, spans, strict=True)
    ]
    wide, narrow = (np.ptp(np.array(spans[k]), axis=1) for k in (0, 1))
    first = "lam_l" if (narrow / wide).argmin() == 0 else "lam_H"
    said = "lam_l" if lower else "lam_H"
    return Claim(
        f"Fig. {5 if lower else 6}: {'raising b_l' if lower else 'lowering b_u'} narrows both "
        f"ranges, that of {said} reaches its end first.",
        f"ranges of lam_l and lam_H for {'; '.join(words)}",
        "reproduced" if first == said else f"both narrow, that of {first} first",
    )


def _empty(findings: Findings) -> Claim:
    solved = findings.printed
    empty = {lam_e: int((~one.solvable).sum()) for lam_e, one in solved.items()}
    shown = ", ".join(f"{count} at {lam_e:.2f}" for lam_e, count in empty.items())
    return Claim(
        "Section 3: where a bound leaves no lam_H and lam_l there is no solution.",
        f"of the six intervals [0.4, 1.3] to [0.9, 1.8] so many have none: {shown}",
        "reproduced",
    )


def _active(findings: Findings) -> Claim:
    names = findings.problem.constraint_names
    counts = []
    for solved in (findings.printed, findings.solved("static")):
        active = np.concatenate([one.active[one.solvable] for one in solved.values()])
        upper, lower = (int(active[:, names.index(n)].sum()) for n in ("sigma_max", "sigma_min"))
        counts.append((len(active), upper, lower))
    (n, upper, lower), (others, other_upper, other_lower) = counts
    return Claim(
        "Fig. 7: intervals further right put the optimum on the bound of lam_l, further left on "
        "that of lam_H.",
        f"b_u is active at {upper} of {n} optima with the inertia as printed, b_l at {lower}; with "
        f"the preset static at {other_upper} and {other_lower} of {others}",
        "not reproduced with the printed tables" if lower == 0 else "reproduced in part",
    )


def _shrinks(findings: Findings) -> Claim:
    intervals = ((0.6, 1.5), (0.7, 1.5), (0.6, 1.4))
    counts = {interval: findings.feasible(*interval) for interval in intervals}
    shown = "; ".join(
        f"[{low:g}, {high:g}]: {', '.join(str(x) for x in count)}"
        for (low, high), count in counts.items()
    )
    falls = all((np.diff(count) <= 0).all() for count in counts.values())
    within = all((counts[intervals[0]] >= counts[other]).all() for other in intervals[1:])
    return Claim(
        "Fig. 7: narrower intervals and larger lam_e shrink the feasible ranges.",
        f"feasible designs of our grid at lam_e = 0.43, 0.51, 0.60, 0.70: {shown}",
        "reproduced" if falls and within else "contradicted",
    )


def _wide_spacing(findings: Findings) -> Claim:
    solvable = findings.printed[SCAN.lam_e[-1]].solvable
    kept = [interval for interval, good in zip(INTERVALS, solvable, strict=True) if good]
    shown = ", ".join(f"[{low:g}, {high:g}]" for low, high in kept)
    return Claim(
        "Fig. 7: lam_e = 0.7 has a solution in the interval [0.7, 1.6] only.",
        f"of [0.4, 1.3] to [0.9, 1.8] only {shown} has feasible designs",
        "reproduced" if kept == [(0.7, 1.6)] else "contradicted",
    )


def _reaches_the_bound(findings: Findings) -> Claim:
    at, name = INTERVALS.index((0.6, 1.5)), findings.problem.constraint_names.index("sigma_max")
    active = {e: bool(one.active[at, name]) for e, one in findings.printed.items()}
    bound = [f"{lam_e:.2f}" for lam_e, on in active.items() if on]
    return Claim(
        "Section 3: in [0.6, 1.5] the optimum reaches the bound of lam_H when lam_e grows to 0.6.",
        f"b_u is active at lam_e = {', '.join(bound)}",
        "reproduced at 0.6; it is active below as well" if len(bound) > 1 else "reproduced",
    )


def _place() -> Claim:
    lam_e, lam_l, lam_H = (REFERENCE[n].printed or np.nan for n in ("lam_e", "lam_l", "lam_H"))
    problem = make_problem("diamond", fixed={"lam_e": lam_e})
    coarse = sum(_best_of(problem, lam_l, lam_H, *steps) == (lam_l, lam_H) for steps in COARSE)
    fine = sum(_best_of(problem, lam_l, lam_H, *steps) == (lam_l, lam_H) for steps in FINE)
    verdict = "the best point of coarse grids, not the optimum"
    return Claim(
        "Section 3, Fig. 8: at lam_e = 0.6 the optimum is lam_l = 2.56, lam_H = 1.97.",
        f"it is the best feasible point of {coarse} of {len(COARSE)} coarse grids through it "
        f"(lam_l by lam_H in steps of {_steps(COARSE)}), of {fine} of {len(FINE)} fine ones "
        f"({_steps(FINE)})",
        verdict if coarse == len(COARSE) and fine == 0 else "not reproduced",
    )


def _best_of(
    problem: DesignProblem,
    lam_l: float,
    lam_H: float,
    wide: float,
    high: float,
) -> tuple[float, float]:
    """Return lam_l and lam_H of the best design of a grid through a point, in such steps."""
    x = lam_l + wide * np.arange(-int(1.2 / wide), int(1.0 / wide) + 1)
    y = lam_H + high * np.arange(-int(1.2 / high), int(1.2 / high) + 1)
    u, v = (axis.ravel() for axis in np.meshgrid(x, y, indexing="ij"))
    best = problem.evaluate(np.stack([u, v - u + 1.0], axis=1)).best()
    return round(float(u[best]), 9), round(float(v[best]), 9)


def _least_torque(findings: Findings) -> Claim:
    printed = findings.problem.evaluate(findings.problem.printed_design()[None]).objectives[0, 0]
    optimum = REFERENCE.optima["tau_G_at_printed_lam_e"].value
    return Claim(
        "Section 3: the optimised dimensions make the drive torque least.",
        f"{printed:.4f} at the printed design, {optimum:.4f} at the optimum for lam_e = 0.6",
        f"within {100.0 * (printed / optimum - 1.0):.1f} %",
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def _steps(grids: tuple[tuple[float, float], ...]) -> str:
    return ", ".join(f"{wide:g} by {high:g}" for wide, high in grids)
