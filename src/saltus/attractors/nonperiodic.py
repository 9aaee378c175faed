"""Motions that do not repeat themselves: the 0-1 test for chaos, and whether a motion is
quasi-periodic or can be (errata 22).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from saltus.attractors.stroboscopic_section import certify, check_periodic
from saltus.bounds import area_contraction, largest_pushes
from saltus.checks import Numbers, check_count, check_size, real_array
from saltus.errors import ParameterError
from saltus.flow import ContactRegularity, contact_regularity, find_recurrence
from saltus.orbits import PeriodicOrbit
from saltus.systems import System, check_system
from saltus.taylor import trace

FEWEST_ENTRIES = 100  # the shortest series, as lags reach a tenth of it
# the bands that are tried at most, and the fewest numbers that are then used
MOST_BANDS = 8
FEWEST_OF_BANDS = 500
CONSTANT = 1e-9  # a series that varies by less than this, relatively, counts as constant


@dataclass(frozen=True, slots=True)
class ZeroOne:
    """The outcome of the 0-1 test: K is near 0 for regular motion and near 1 for chaos.

    Attributes
    ----------
    K
        The median of the correlations over the frequencies.
    spread
        Half the distance between their quartiles.
    samples
        How many numbers of the series were used.
    every
        Every n-th number of the series was used.

    Examples
    --------
    >>> bool(saltus.zero_one_test(np.sin(np.arange(2000.0))).K < 0.1)  # regular
    True
    """

    K: float
    spread: float
    samples: int
    every: int = 1


def zero_one_test(series: Numbers, *, every: int = 1, seed: int = 0, count: int = 100) -> ZeroOne:
    """The 0-1 test of Gottwald and Melbourne (SIAM J. Appl. Dyn. Syst. 8 (2009) 129), by the
    correlation method.

    At random frequencies c in (pi/5, 4 pi/5) the series phi drives p + i q = sum of phi_j exp(i j
    c), which wanders like a Brownian path in chaos and stays bounded in regular motion. Its mean
    square displacement M(n) over lags n up to a tenth of the series, less the term E[phi]^2 (1 -
    cos n c) / (1 - cos c) that oscillates with n, is compared with n: K is their correlation, and
    the median over the frequencies is taken.

    The series must be sampled coarsely, such as once in each forcing period: for a finely sampled
    series the test gives 0 whatever the motion is. Where chaos lies in n narrow bands that it
    visits in turn, as after a cascade of period doublings, the test sees the regular change of
    band: K is near 0 however long the series is, and near 1 on every n-th number. Weak chaos takes
    long series, and the test does not resolve the fine structure of many tori.

    Parameters
    ----------
    series
        Numbers, of which at least 100 are used.
    every
        Only every so-many-th number is used, as if the motion was looked at that much less often.
    seed
        The seed of the frequencies.
    count
        The number of frequencies.

    Raises
    ------
    ParameterError
        A series of other shape, too short, or not finite; a count below 1.

    Examples
    --------
    >>> logistic = [0.3]
    >>> for _ in range(2000):
    ...     logistic.append(4 * logistic[-1] * (1 - logistic[-1]))
    >>> saltus.zero_one_test(np.sin(np.arange(2000.0))).K < 0.1, saltus.zero_one_test(logistic).K > 0.9
    (True, True)
    """
    check_count("every", every, 1)
    check_size(series, "series")
    try:
        values = real_array(series)
        values = values[:: int(every)] if values.ndim == 1 else values
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            "the 0-1 test takes a series of numbers, one a forcing period", "series"
        ) from None
    if values.ndim != 1 or values.size < FEWEST_ENTRIES or not np.isfinite(values).all():
        raise ParameterError(
            f"the 0-1 test takes at least {FEWEST_ENTRIES} finite numbers in one row, got shape"
            f" {values.shape}",
            "series",
        )
    check_count("count", count, 1, 100_000)
    check_count("seed", seed, 0)
    if np.ptp(values) <= CONSTANT * max(1.0, float(np.abs(values).max())):
        return ZeroOne(0.0, 0.0, values.size, int(every))
    lags = np.arange(1, values.size // 10 + 1)
    c = np.random.default_rng(int(seed)).uniform(np.pi / 5, 4 * np.pi / 5, (int(count), 1))
    bounded = values.mean() ** 2 * (1 - np.cos(lags * c)) / (1 - np.cos(c))
    found = [_correlation(lags, row) for row in _displacement(values, c, lags.size) - bounded]
    low, middle, high = np.quantile(found, [0.25, 0.5, 0.75])
    return ZeroOne(float(middle), float(high - low) / 2, values.size, int(every))


def zero_one_of_bands(series: np.ndarray, *, seed: int = 0) -> ZeroOne:
    """The 0-1 test on every n-th number of a series, n = 1, 2, ..., for the n with the largest K:
    chaos in n bands is seen there.

    So many n are tried that 500 numbers are left (all numbers are taken if there are fewer): with
    less, K of tori scatters by more than 0.1.
    """
    tried = range(1, max(1, min(MOST_BANDS, series.size // FEWEST_OF_BANDS)) + 1)
    return max(
        (zero_one_test(series, every=every, seed=seed) for every in tried),
        key=lambda found: found.K,
    )


def _displacement(values: np.ndarray, c: np.ndarray, longest: int) -> np.ndarray:
    """M(n) for n = 1, ..., longest: the mean of abs(z_{j+n} - z_j)^2 over all j with j + longest <=
    samples, (frequencies, lags).

    The squares are summed by cumulative sums, the products by Fourier transforms.
    """
    path = np.cumsum(values * np.exp(1j * c * np.arange(1, values.size + 1)), axis=1)
    base = values.size - longest
    size = 1 << (values.size + base - 1).bit_length()
    spectrum = np.fft.fft(path, size) * np.conj(np.fft.fft(path[:, :base], size))
    products = np.fft.ifft(spectrum)[:, 1 : longest + 1].real
    squares = np.cumsum(np.pad(np.abs(path) ** 2, ((0, 0), (1, 0))), axis=1)
    later = squares[:, base + 1 : base + longest + 1] - squares[:, 1 : longest + 1]
    result: np.ndarray = (later + squares[:, base : base + 1] - 2.0 * products) / base
    return result


def _correlation(lags: np.ndarray, displacement: np.ndarray) -> float:
    if np.ptp(displacement) == 0.0:
        return 0.0
    return float(np.corrcoef(lags, displacement)[0, 1])


def excludes_tori(system: System) -> str | None:
    """Why a system with one coordinate has no quasi-periodic motion, as a sentence; None where it
    may have one (errata 22).

    Under one forcing frequency a quasi-periodic motion lies on closed curves that the stroboscopic
    map P carries onto themselves; where a curve is mapped to another one, a power of P does. There
    is none where

    * P is continuous on the plane of states, in which the states before and after an impact are one
      point. It is discontinuous
      only if the contact pushes away on both sides at one instant, as motions beside the state of
      rest then leave to different sides: for equal layers, where V cos(beta0) > 0. It is continuous
      with bounces from one wall, with a contact that changes neither the velocity nor the
      acceleration, and without a contact;
    * and P shrinks areas: da/dv < 0 on every side, and no impact raises the speed.

    For then P maps the curve onto itself and, being continuous, the area within the curve onto at
    least the same area, although it shrinks areas. Both conditions are checked by interval bounds
    over the whole forcing period and all states. They are sufficient, not necessary: if the bounds
    decide nothing, the system may have tori.

    Parameters
    ----------
    system
        What moves, with one coordinate, under a load with a frequency.

    Raises
    ------
    ParameterError
        Something that is no system; a load by records or pulses.

    Examples
    --------
    >>> saltus.excludes_tori(system) is not None  # the damping shrinks areas
    True
    """
    check_system(
        system,
        "excludes_tori",
        several_contacts=True,
        multipliers=True,
        switches=True,
        resets=True,
        relays=True,
    )
    check_periodic(system)
    if not system.model.has_state_plane:
        return None
    rate = area_contraction(system)
    continuous = None if rate is None or rate == 0.0 else _continuous(system)
    if continuous is None:
        return None
    assert rate is not None
    if system.load.period is None:
        return (
            "under constant loads a motion of one coordinate has no room for a torus, and"
            f" {continuous} and areas shrink"
        )
    left = math.exp(-rate * system.load.period)
    return (
        f"the stroboscopic map is continuous, as {continuous}, and it shrinks areas, in a forcing"
        f" period to at most {left:.3g} of what they were, so that it has no invariant closed curve"
        " (errata 22)"
    )


def _continuous(system: System) -> str | None:
    """Why the stroboscopic map is continuous, as a part of a sentence; None if the contact may push
    away on both sides.
    """
    traced = trace(system)
    if traced.side_count == 0:
        return "the motion has no contact"
    if traced.side_count == 1:
        return "a bounce from one wall joins its states before and after without a gap"
    if (
        contact_regularity(traced, tuple(system.parameters.values()))
        is ContactRegularity.CONTINUOUS
    ):
        return "neither the velocity nor the acceleration changes at the contact"
    assert traced.contact_acceleration is not None
    pushes = largest_pushes(system, traced.contact_acceleration)
    if not np.all(np.minimum(*pushes) < 0.0):
        return None
    if np.all(np.maximum(*pushes) < 0.0):
        return "the load presses on the contact from both sides at all times"
    return "the load never pushes away from the contact on both sides at once"


# the 0-1 test shows a regular motion where its K is below this, on every n-th state too
ORDER = 0.2


@dataclass(frozen=True, eq=False)
class RegularMotion:
    """What is known of a motion whose largest exponent may be 0: an orbit that it approaches
    slowly, or that it is on a torus.
    """

    orbit: PeriodicOrbit | None  # an attracting orbit that passes the motion
    zero_one: ZeroOne | None  # the 0-1 test, if it shows order and nothing excludes a torus


def regular_motion(system: System, state: np.ndarray, periods: int, tol: float) -> RegularMotion:
    """Whether a motion from a state (d,) whose largest exponent is 0, as far as that is known, is
    on a torus.

    It is if nothing excludes tori, and if no attracting orbit is near, which it might approach
    slowly. The 0-1 test of its coordinate must also see order in all of the states at phase 0 and
    in every n-th of them.
    """
    if periods < FEWEST_OF_BANDS or excludes_tori(system) is not None:
        return RegularMotion(None, None)
    ends = find_recurrence(system, state[None], periods, kept=periods, tol=tol)
    if not ends.unsettled[0]:
        return RegularMotion(None, None)
    found = zero_one_of_bands(ends.states[0, :, 0])
    if found.K >= ORDER:
        return RegularMotion(None, None)
    certificate = certify(system, ends.last[0], None)
    return (
        RegularMotion(certificate.orbit, None) if certificate.sound else RegularMotion(None, found)
    )
