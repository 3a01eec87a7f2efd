"""The swing splines against the conditions of Paper A, eqs 4–6, and against finite differences."""

import numpy as np
import pytest

from wfbook.swing import condition_matrix, conditions, quintic_basis, septic_basis, swing_position

START, END = np.array([0.1, -0.2, 0.0]), np.array([0.35, -0.15, 0.08])
V0, VF = np.array([0.4, 0.0, 0.0]), np.array([0.6, 0.1, 0.0])


def swing(phase, derivative=0):
    """The swing of these tests: 0.3 s, from one rolling wheel's place and speed to another's."""
    return swing_position(np.atleast_1d(phase), 0.3, START, END, 0.06, V0, VF, derivative)


def test_it_starts_and_ends_where_and_as_fast_as_asked():
    """What eqs 4 to 6 ask of a swing: places, velocities, no accelerations."""
    np.testing.assert_allclose(swing([0.0, 1.0]), [START, END], atol=1e-12)
    np.testing.assert_allclose(swing([0.0, 1.0], 1), [V0, VF], atol=1e-11)
    np.testing.assert_allclose(swing([0.0, 1.0], 2), np.zeros((2, 3)), atol=1e-9)


def test_the_apex_is_at_half_time_and_level():
    """Eq. 5's last two conditions."""
    assert swing(0.5)[0, 2] == pytest.approx(0.04 + 0.06)
    assert swing(0.5, 1)[0, 2] == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize("derivative", [1, 2])
def test_derivatives_are_those_of_finite_differences(derivative):
    phase, step = np.linspace(0.05, 0.95, 19), 1e-5
    ahead, behind = (swing(phase + sign * step, derivative - 1) for sign in (1, -1))
    np.testing.assert_allclose(swing(phase, derivative), (ahead - behind) / (2 * step * 0.3), atol=1e-6)


def test_a_swing_of_zero_step_stays_and_bases_sum_to_one():
    phase = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(quintic_basis(phase)[:, [0, 2]].sum(axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(septic_basis(phase).sum(axis=1), 1.0, atol=1e-11)


def test_time_reversal_swaps_the_ends():
    phase = np.linspace(0.0, 1.0, 11)
    back = swing_position(1 - phase, 0.3, END, START, 0.06, -VF, -V0)
    np.testing.assert_allclose(back, swing(phase), atol=1e-12)


@pytest.mark.parametrize("apex", [False, True])
@pytest.mark.parametrize("smoothness", [0, 1, 2])
def test_G_is_square_regular_and_says_what_a_polynomial_does(smoothness, apex):
    """Eq. 3, for polynomials of any coefficients."""
    G, found = condition_matrix(smoothness, apex), conditions(smoothness, apex)
    assert G.shape == (len(found),) * 2 and abs(np.linalg.det(G)) > 1e-6
    a = np.random.default_rng(0).standard_normal(len(found))
    polynomial = np.polynomial.Polynomial(a)
    for row, (phase, order) in zip(G, found, strict=True):
        assert row @ a == pytest.approx((polynomial.deriv(order) if order else polynomial)(phase))


@pytest.mark.parametrize("smoothness", [0, 1, 2])
def test_fewer_conditions_keep_the_rest(smoothness):
    def rough(phase, derivative):
        return swing_position(np.array(phase), 0.3, START, END, 0.06, V0, VF, derivative, smoothness)

    np.testing.assert_allclose(rough([0.0, 1.0], 0), [START, END], atol=1e-12)
    assert rough([0.5], 0)[0, 2] == pytest.approx(0.1) and rough([0.5], 1)[0, 2] == pytest.approx(
        0.0, abs=1e-11
    )
    met = np.abs(rough([0.0, 1.0], 1) - [V0, VF]).max() < 1e-9
    assert met == (smoothness >= 1)
    assert (np.abs(rough([0.0, 1.0], 2)).max() < 1e-9) == (smoothness >= 2)


def test_other_smoothness_is_refused():
    with pytest.raises(ValueError, match="smoothness"):
        quintic_basis(np.zeros(1), smoothness=3)
