"""Numbers in words that never promise more than was proved: rounded outward, exactly."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context, Decimal

_EXACT = Context(prec=1200)  # holds every double


def rounded_ball(middle: float, radius: float) -> str:
    """`m +- r` with r rounded up to two digits, so that it contains middle +- radius.

    Examples
    --------
    >>> from saltus.bounds import rounded_ball
    >>> rounded_ball(0.1, 1e-9)
    '0.10000000000 +- 1.1e-9'
    """
    if not (radius >= 0.0 and radius < float("inf")):
        return f"{middle:.17g} +- {radius}"
    exact = Decimal(middle)
    spread = Decimal(radius)
    if spread == 0:
        return f"{exact} +- 0"
    places = 2 - spread.adjusted()
    step = Decimal(1).scaleb(-places)
    printed = exact.quantize(step, rounding=ROUND_HALF_EVEN, context=_EXACT)
    total = _EXACT.add(spread, abs(_EXACT.subtract(exact, printed)))
    return f"{printed:f} +- {rounded_up(total)}"


def rounded_up(value: Decimal | float, digits: int = 2) -> str:
    """An upper bound with so many significant digits."""
    return _rounded(value, digits, ROUND_CEILING)


def rounded_down(value: Decimal | float, digits: int = 6) -> str:
    """A lower bound with so many significant digits."""
    return _rounded(value, digits, ROUND_FLOOR)


def _rounded(value: Decimal | float, digits: int, rounding: str) -> str:
    exact = Decimal(value)
    if not exact.is_finite() or exact == 0:
        return str(exact)
    step = Decimal(1).scaleb(exact.adjusted() - digits + 1)
    result = exact.quantize(step, rounding=rounding, context=_EXACT)
    if -5 < exact.adjusted() < 15:
        return f"{result:f}"
    text = f"{result:.{digits - 1}e}"
    return text.replace("e-0", "e-").replace("e+0", "e+")
