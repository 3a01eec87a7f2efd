"""The friction pyramid and rolling friction (Paper A, eqs 26–29)."""

import numpy as np

from wfbook.friction import friction_pyramid, rolling_friction


def test_the_pyramid_is_the_set_the_paper_writes():
    n, t, b = np.random.default_rng(0).uniform(-1, 1, (3, 20000))
    inside = np.max(friction_pyramid(n, t, b, 0.1, 0.7), axis=0) <= 0
    np.testing.assert_array_equal(inside, (n >= 0) & (np.abs(t) <= 0.1 * n) & (np.abs(b) <= 0.7 * n))
    assert inside.any()


def test_rolling_friction_opposes_forward_rolling():
    assert rolling_friction(50.0, 0.01) == -0.5
