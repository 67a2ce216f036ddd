"""What is said of a posterior sample: divergences, chains that disagree, few independent draws."""

import numpy as np
import pytest

from stickslip.objects.posterior import FEW, trust

arviz = pytest.importorskip("arviz")
CHAINS, DRAWS = 4, 500


def sampled(shift: float = 0.0, diverging: int = 0, draws: int = DRAWS, chains: int = CHAINS):
    """Independent normal draws of two parameters, the first chain of one moved by some standard deviations."""
    rng = np.random.default_rng(0)
    length, stiffness = rng.standard_normal((2, chains, draws))
    length[0] += shift
    lost = np.arange(chains * draws).reshape(chains, draws) < diverging
    return arviz.from_dict(posterior={"length": length, "stiffness": stiffness}, sample_stats={"diverging": lost})


def test_a_good_sample_is_said_to_be_good():
    assert trust(sampled()) == [f"No divergence in {CHAINS * DRAWS} draws; the chains agree."]


def test_divergences_are_counted():
    (said,) = trust(sampled(diverging=7))
    assert said.startswith(f"7 of {CHAINS * DRAWS} draws diverged") and "tails" in said


def test_chains_that_disagree_are_said_with_their_parameter():
    said = trust(sampled(shift=3.0))
    assert "do not agree on length (R-hat above 1.05)" in said[0]
    assert all("stiffness" not in sentence for sentence in said) and not any("diverge" in s for s in said)


def test_few_draws_are_said():
    (said,) = trust(sampled(draws=40, chains=2))  # 80 independent draws
    assert said == f"Fewer than {FEW} independent draws of length, stiffness: intervals are rough."


def test_a_single_chain_is_not_compared_with_others():
    """R-hat compares chains: of one alone, its count of independent draws is what is said."""
    (said,) = trust(sampled(draws=60, chains=1, shift=3.0))
    assert said.startswith("Fewer than")
    assert trust(sampled(chains=1)) == [f"No divergence in {DRAWS} draws of a single chain."]


def test_all_that_speaks_against_a_sample_is_said():
    said = trust(sampled(shift=5.0, diverging=1, draws=40, chains=2))
    assert [word in sentence for word, sentence in zip(("diverged", "agree", "Fewer"), said, strict=True)] == [True] * 3
