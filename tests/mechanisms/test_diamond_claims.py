"""Each statement of the Diamond's paper gets its verdict, and paper.toml holds what is computed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from pkm_gym.core.reference import Reference
from pkm_gym.mechanisms.diamond.claims import claims
from pkm_gym.mechanisms.diamond.findings import Findings


@pytest.fixture(scope="module")
def findings() -> Findings:
    return Findings()


def test_the_claims_of_the_reference_are_those_computed(findings: Findings) -> None:
    recorded = Reference.load("pkm_gym.mechanisms.diamond").claims
    for one, other in zip(claims(findings), recorded, strict=True):
        assert one == other


def test_a_verdict_follows_the_maps(findings: Findings) -> None:
    turned = Findings()
    turned.maps = {
        lam_e: replace(one, sigma_min=2.0 - one.sigma_min, tau_G=1.0 - one.tau_G)
        for lam_e, one in reversed(findings.maps.items())
    }
    turned.printed = findings.printed
    before, after = (
        {said.claim: said.verdict for said in claims(found)} for found in (findings, turned)
    )
    changed = {claim for claim in before if before[claim] != after[claim]}
    assert {
        "Fig. 4: tau_G rises with lam_H and lam_l.",
        "Fig. 5: min sigma_min rises with lam_H.",
        "Fig. 5: min sigma_min falls with lam_l.",
    } <= changed
