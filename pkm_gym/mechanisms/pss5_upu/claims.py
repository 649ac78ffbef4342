"""What the paper says in words and a model can judge, each computed, with a verdict.

What is said of printed numbers is judged by them, what is said of the machine by our model: row 1
of Table 5 over the default box, and our own grid of designs.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pkm_gym.core.composite import Composite
from pkm_gym.core.reference import Claim
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.atlas import (
    LARGE,
    NAMES,
    own_composites,
    to_plane,
    values_of,
)
from pkm_gym.mechanisms.pss5_upu.declared import WEIGHTS
from pkm_gym.mechanisms.pss5_upu.facts import Facts, composite_map, level

SIGNIFICANT = 0.05  # chance that uncorrelated samples correlate as much
ALIKE = 0.9  # rank correlation of maps that look alike
RANDOM = 1000  # poses of the box


def claims(facts: Facts) -> tuple[Claim, ...]:
    """Return all statements in the paper's order."""
    return tuple(_claims(facts))


def _claims(facts: Facts) -> Iterator[Claim]:
    yield _all_performances(facts)
    yield _redundancy(facts)
    yield _freedoms(facts)
    yield _no_yaw(facts)
    yield _range_of_eta(facts)
    yield _different_maps(facts)
    yield _units(facts)
    yield _positive(facts)
    yield _one_for_all(facts)
    yield _map_of_composite(facts)
    yield _optimum(facts)
    yield _good_each(facts)
    yield _region(facts)
    yield _symmetric(facts)
    yield _best_at_centre(facts)
    yield _order(facts)
    yield _no_experience(facts)


def _all_performances(facts: Facts) -> Claim:
    feasible = own_composites(facts.evaluation)[0]
    punished = [n for n, w in zip(NAMES, feasible.weights, strict=True) if w < 0.0]
    return Claim(
        "Abstract: the method takes all performances into account.",
        f"of our own atlas the weights are {_numbers(feasible.weights)}: they punish "
        f"{' and '.join(punished)}",
        "contradicted by our atlas" if punished else "holds",
    )


def _redundancy(facts: Facts) -> Claim:
    """Count an index twice: what is redundant ought not to gain."""
    R, twice = facts.printed.correlation, [0, *range(len(NAMES))]
    doubled = Composite.from_correlation(
        R[np.ix_(twice, twice)], ("K_v again", *NAMES), directions=(LARGE[0], *LARGE),
        population="with K_v twice",
    ).weights  # fmt: skip
    before, after = (
        facts.printed.weights[0] / facts.printed.weights[3],
        doubled[:2].sum() / doubled[4],
    )
    return Claim(
        "English abstract: principal components reduce redundant data.",
        f"with K_v entered twice its weight over that of K_eta is {after:.2f}, once {before:.2f}",
        "contradicted: what is redundant counts more" if after > before else "holds",
    )


def _freedoms(facts: Facts) -> Claim:
    machine = facts.rows[0]
    poses = machine.in_box(np.random.default_rng(0).uniform(-1.0, 1.0, (RANDOM, 5)))
    home, away = machine.rank(machine.home), machine.rank(poses)
    return Claim(
        "Section 1: the platform has five freedoms, which the sliders control.",
        f"rank of the limbs' system {home:.0f} of 6 at home, {away.min():.0f} at {RANDOM:,} random "
        f"poses of the box; rcond there {machine.rcond(poses).min():.1e} to "
        f"{machine.rcond(poses).max():.1e}",
        "holds away from home only" if home < away.min() == 6 else "holds",
    )


def _no_yaw(facts: Facts) -> Claim:
    largest = np.degrees(np.abs(facts.true.alpha(facts.true.search_poses())).max())
    return Claim(
        "Section 2: alpha = 0.",
        f"a UPU limb turns the platform by up to {largest:.2f} deg in the default box",
        "contradicted" if largest > 0.0 else "holds",
    )


def _range_of_eta(facts: Facts) -> Claim:
    machine = facts.rows[0]
    poses = machine.search_poses()
    least = machine.local_indices(poses)["K_eta"].min()
    largest = machine.transmission(poses[machine.rank(poses) == 6])[..., 1].max()
    return Claim(
        "Section 4.2: 1 <= eta_i <= 1.",
        f"eta_i from {least:.3f}, at home, to {largest:.3f} at the nodes of the box",
        "a slip: 0 <= eta_i <= 1" if 0.0 <= least < 1.0 >= largest else "holds",
    )


def _different_maps(facts: Facts) -> Claim:
    chosen = facts.evaluation.feasible
    values, places = values_of(facts.evaluation)[chosen], to_plane(facts.evaluation.designs[chosen])
    best = ", ".join(
        f"{name} at {_place(places[column.argmax()])}"
        for name, column in zip(NAMES, values.T, strict=True)
    )
    alike = np.corrcoef(values[:, 0], values[:, 3]).item(1)
    return Claim(
        "Section 5: the four atlases differ; none alone shows the best size.",
        f"of our feasible designs the largest {best}; K_v and K_eta correlate with {alike:.3f}",
        "holds, but K_v and K_eta say the same" if alike > ALIKE else "holds",
    )


def _units(facts: Facts) -> Claim:
    mean, std = facts.reference.data["table2"]["mean"], facts.reference.data["table2"]["std"]
    return Claim(
        "Section 6: the indices have different units and levels, which z-scores make comparable.",
        f"all four are pure numbers from 0 to 1; of the 160 samples the means are "
        f"{_numbers(mean)}, the deviations {_numbers(std)}",
        "contradicted by Tables 1 and 2" if max(std) < 2.0 * min(std) else "holds",
    )


def _positive(facts: Facts) -> Claim:
    from scipy.stats import t

    printed = facts.printed.correlation[np.triu_indices(4, 1)]
    own = own_composites(facts.evaluation)[0].correlation[np.triu_indices(4, 1)]
    count = int(facts.reference["samples"].printed or 0)
    limit = t.isf(0.5 * SIGNIFICANT, count - 2)
    limit /= np.sqrt(count - 2 + limit**2)
    unclear = np.sort(printed[printed < limit])
    verdict = "holds" if own.min() > 0.0 else "holds of Table 3, not of our atlas"
    return Claim(
        "Section 6: all four indices correlate positively.",
        f"{_numbers(unclear, 3)} of Table 3 are less than {limit:.3f}, which {count} uncorrelated "
        f"samples exceed once in {1.0 / SIGNIFICANT:.0f} times; of our feasible designs "
        f"{own.min():.2f} to {own.max():.2f}",
        verdict if (printed > 0.0).all() else "contradicted by Table 3",
    )


def _one_for_all(facts: Facts) -> Claim:
    share, kept = facts.printed.shares[0], facts.printed.kept
    return Claim(
        "Section 6: as all correlate positively, one index can stand for all.",
        f"the first component has {share:.0%} of the variance, {kept} of 4 are kept",
        "contradicted by Table 4" if kept > 1 else "holds",
    )


def _map_of_composite(facts: Facts) -> Claim:
    from scipy.stats import spearmanr

    chosen = facts.evaluation.feasible
    F = facts.evaluation.indices["F"][chosen]
    ranks = [spearmanr(F, column)[0] for column in values_of(facts.evaluation)[chosen].T]
    return Claim(
        "Section 6: the map of F is like those of the four indices.",
        f"section 5 says that these differ; rank correlation of F with {', '.join(NAMES)} over our "
        f"feasible designs {_numbers(ranks)}",
        "contradicted by section 5 and by our atlas" if min(ranks) < ALIKE else "holds",
    )


def _optimum(facts: Facts) -> Claim:
    evaluation, printed = facts.evaluation, facts.reference
    F = evaluation.indices["F"]
    best = [
        int(np.argmax(np.where(allowed, F, -np.inf)))
        for allowed in (evaluation.feasible, np.isfinite(F))
    ]
    places = to_plane(evaluation.designs[best])
    X, Y = (printed[name].printed for name in ("X", "Y"))
    at = evaluation.problem.evaluate(evaluation.problem.printed_design()[None])
    word = "feasible" if at.feasible[0] else "infeasible"
    near = np.abs(places[0] - (X, Y)).max() < 0.03
    return Claim(
        f"Section 6: F is largest at X = {X}, Y = {Y}.",
        f"on our grid {F[best[0]]:.3f} at {_place(places[0])}, without limits {F[best[1]]:.3f} at "
        f"{_place(places[1])}; the printed design is {word}, with {at.indices['F'][0]:.3f}",
        "reproduced" if near and at.feasible[0] else "not reproducible",
    )


def _good_each(facts: Facts) -> Claim:
    best = facts.table_5.argmax(axis=0)
    elsewhere = [f"{NAMES[k]} in row {row + 1}" for k, row in enumerate(best) if row]
    return Claim(
        "Section 6: at the optimum each single index is good as well.",
        f"in Table 5 the largest {' and '.join(elsewhere)}",
        "contradicted by Table 5" if elsewhere else "holds",
    )


def _region(facts: Facts) -> Claim:
    F = facts.table_5 @ np.array(WEIGHTS)
    good = facts.reference["F_good"].printed or 0.0
    return Claim(
        f"Section 6: rows 1 and 2 of Table 5 lie where F >= {good}, row 3 doesn't.",
        f"F of their printed indices is {_numbers(F, 3)}; printed as "
        f"{_numbers(facts.reference.data['table5']['F'])}",
        "holds" if list(good <= F) == [True, True, False] else "contradicted: row 2 doesn't either",
    )


def _symmetric(facts: Facts) -> Claim:
    machine = facts.rows[0]
    F = composite_map(machine, level(machine))
    off = np.abs(F - F[::-1]).max()
    return Claim(
        "Fig. 7: F is symmetric over the positions.",
        f"F at y and -y differ by at most {off:.0e}",
        "reproduced" if off < 1e-12 else "contradicted",
    )


def _best_at_centre(facts: Facts) -> Claim:
    machine = facts.rows[0]
    line = np.repeat(machine.home[None], 50, axis=0)
    line[:, 0] = np.linspace(0.0, machine.x, 51)[1:]
    F, local = composite_map(machine, line), machine.local_indices(line)
    rises = (np.diff(F) < 0.0).all()
    K_v, K_w, _, K_eta = (local[name] for name in NAMES)
    return Claim(
        "Fig. 7: the nearer to the centre, the better the performance.",
        f"from {1e3 * line[-1, 0]:.0f} to {1e3 * line[0, 0]:.1f} mm F goes from {F[-1]:.2f} to "
        f"{F[0]:.2f}, K_w from {K_w[-1]:.2f} to {K_w[0]:.2f}, but K_v from {K_v[-1]:.3f} to "
        f"{K_v[0]:.4f} and K_eta from {K_eta[-1]:.3f} to {K_eta[0]:.4f}",
        "holds of F, which hides that the centre is singular" if rises else "contradicted",
    )


def _order(facts: Facts) -> Claim:
    means = [float(composite_map(machine, level(machine)).mean()) for machine in facts.rows]
    falls = means == sorted(means, reverse=True)
    return Claim(
        "Fig. 7: the nearer a size is to the optimum, the better its F over the positions.",
        f"mean F over the level box is {_numbers(means, 4)} in rows 1, 2, 3",
        "holds" if falls else "not reproducible",
    )


def _no_experience(facts: Facts) -> Claim:
    feasible, reachable = own_composites(facts.evaluation)
    vectors, values = facts.printed.vectors, facts.printed.eigenvalues
    flipped = facts.printed.weights - 2.0 * values[2] * vectors[2]
    return Claim(
        "Section 7: with principal components the weights depend less on experience.",
        f"they depend on the samples ({_numbers(feasible.weights)} of our feasible, "
        f"{_numbers(reachable.weights)} of our reachable designs) and on the sign of the third "
        f"component, which is free: {_numbers(flipped)} with the other one",
        "the samples take its place" if (feasible.weights < 0.0).any() else "holds",
    )


def _numbers(values: object, digits: int = 2) -> str:
    return ", ".join(f"{value:.{digits}f}" for value in np.asarray(values, dtype=float))


def _place(place: FloatArray) -> str:
    return f"({place[0]:.2f}, {place[1]:.2f})"
