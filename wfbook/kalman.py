"""Chapter 7: the Kalman filter on a line, as the warm-up for :mod:`wfbook.estimator`.

A cart feels its acceleration and measures its speed, both with noise. Two lines predict, three correct, and
all that the filter for the Go1 adds are matrices. Its state here is one number, the speed ``v``, with a
variance ``P``. Many carts are filtered at once: arrays are ``(runs, N)``.

:func:`nees` and :func:`nees_bounds` ask of any filter whether its errors are as large as it says.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

PERIOD = 0.02
"""Time from one reading of the cart's sensors to the next, s."""


@dataclass(frozen=True)
class Cart:
    """Carts that ran, and what they measured.

    Attributes:
        t: ``(N,)`` time, :data:`PERIOD` apart.
        v: ``(runs, N)`` true speed.
        felt: ``(runs, N)`` acceleration as measured over the period that ends at ``t``.
        measured: ``(runs, N)`` speed as measured.
    """

    t: np.ndarray
    v: np.ndarray
    felt: np.ndarray
    measured: np.ndarray


def drive(
    seed: int = 0,
    runs: int = 1,
    felt_noise: float = 1.0,
    measured_noise: float = 0.1,
    wrong: float = 0.0,
    duration: float = 4.0,
) -> Cart:
    """Let carts set off, coast and brake.

    Args:
        seed: of all noise.
        runs: how many carts.
        felt_noise: standard deviation of a measured acceleration, m/s².
        measured_noise: of a measured speed, m/s.
        wrong: share of the speeds measured that have nothing to do with the speed (a wheel in the air).
        duration: time until they stand again, s.
    """
    random = np.random.default_rng([seed, 7])
    t = PERIOD * np.arange(1, round(duration / PERIOD) + 1)
    phase = t / duration
    speed = 0.5 * (1.0 - np.cos(2 * np.pi * phase))
    v = np.tile(speed, (runs, 1))
    a = np.diff(speed, prepend=0.0) / PERIOD
    felt = a + felt_noise * random.standard_normal(v.shape)
    measured = v + measured_noise * random.standard_normal(v.shape)
    free = random.random(v.shape) < wrong
    return Cart(t, v, felt, np.where(free, random.uniform(-1.0, 3.0, v.shape), measured))


def predict(v: np.ndarray, P: np.ndarray, a: np.ndarray, felt_noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Return speed and variance one period later, from a felt acceleration ``a``: the guess gets worse."""
    return v + PERIOD * a, P + (PERIOD * felt_noise) ** 2


def correct(
    v: np.ndarray, P: np.ndarray, z: np.ndarray, measured_noise: float, gate: float = np.inf
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return speed and variance after a measured speed ``z``, and which measurements were refused.

    Args:
        v: ``(...)`` predicted speed.
        P: ``(...)`` its variance.
        z: ``(...)`` measured speed.
        measured_noise: standard deviation of ``z``.
        gate: squared distance ``(z − v)² / S`` beyond which a measurement is not believed.

    Example:
        A measurement as good as the guess counts as much, and halves the variance:

        >>> from wfbook.kalman import correct
        >>> v, P, refused = correct(np.array(1.0), np.array(0.04), np.array(2.0), 0.2)
        >>> float(v), float(P.round(9)), bool(refused)
        (1.5, 0.02, False)
    """
    S = P + measured_noise**2
    refused = (z - v) ** 2 / S > gate
    K = np.where(refused, 0.0, P / S)
    return v + K * (z - v), (1.0 - K) * P, refused


def follow(
    cart: Cart, felt_noise: float = 1.0, measured_noise: float = 0.1, gate: float = np.inf
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Filter carts that start at rest.

    Args:
        cart: what they measured.
        felt_noise: that the filter assumes, see :func:`drive`.
        measured_noise: likewise.
        gate: see :func:`correct`.

    Returns:
        Estimated speed, its variance, and which measurements were refused, ``(runs, N)`` each.
    """
    v, P = np.zeros(len(cart.v)), np.full(len(cart.v), 1e-4)
    estimates, variances, refusals = [], [], []
    for a, z in zip(cart.felt.T, cart.measured.T, strict=True):
        v, P = predict(v, P, a, felt_noise)
        v, P, refused = correct(v, P, z, measured_noise, gate)
        estimates.append(v)
        variances.append(P)
        refusals.append(refused)
    return np.array(estimates).T, np.array(variances).T, np.array(refusals).T


def nees(error: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Return the normalised estimation error squared, ``eᵀ P⁻¹ e``.

    If errors are as large as the filter says, its mean is the number of states, whatever their units.

    Args:
        error: ``(..., n)`` what is true less what is estimated.
        covariance: ``(..., n, n)`` of it, as the filter has it.
    """
    return (error * np.linalg.solve(covariance, error[..., None])[..., 0]).sum(axis=-1)


def nees_bounds(states: int, runs: int, share: float = 0.95) -> tuple[float, float]:
    """Return between which numbers the mean NEES of independent runs is to be, with that probability.

    The sum over the runs is chi-squared, of ``states * runs`` degrees of freedom.
    """
    tails = 0.5 * (1.0 - share), 0.5 * (1.0 + share)
    low, high = chi2.ppf(tails, states * runs) / runs
    return float(low), float(high)
