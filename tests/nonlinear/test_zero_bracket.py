"""Interpolation between two sides of a zero, on functions whose zero is known."""

import math
from collections.abc import Callable

import pytest

from nonlinear.branches.special_point_location import _Bracket

FUNCTIONS: dict[str, tuple[Callable[[float], float], float, int]] = {  # function, its zero, most evaluations
    "smooth": (lambda x: math.exp(x) - 2.0, math.log(2.0), 8),
    "kink before the zero": (lambda x: 0.3 - x if x > 0.29 else 0.01 + 40.0 * (0.29 - x), 0.3, 10),
    "kink at the zero": (lambda x: 0.3 - x if x < 0.3 else 50.0 * (0.3 - x), 0.3, 45),
    "jump": (lambda x: 1.0 + x if x < 0.3 else -1e-3, 0.3, 32),
    "of third order": (lambda x: (x - 0.3) ** 3, 0.3, 40),
}


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("turned", [False, True])
def test_the_bracket_closes_on_the_zero(name: str, turned: bool) -> None:
    function, zero, most = FUNCTIONS[name]
    if turned:
        function, zero = (lambda x, f=function: f(1.0 - x)), 1.0 - zero
    bracket, evaluations = _Bracket((0.0, function(0.0)), (1.0, function(1.0))), 0
    while bracket.width > 1e-9 and evaluations < most:
        arc = bracket.next_arc(5e-10)
        value = function(arc)
        evaluations += 1
        if value == 0.0:
            return
        bracket = bracket.narrowed(arc, value, value * function(1.0) > 0.0)
        assert (bracket.newest[0] - zero) * (bracket.other[0] - zero) <= 0.0
    assert bracket.width <= 1e-9, (name, evaluations, bracket)


@pytest.mark.parametrize("coefficients", [(1.0, -2.0, -3.0), (-0.5, 0.1, 2.0), (2.0, -3.0, 0.0), (-1.0, 5.0, -2.0)])
def test_a_quadratic_rate_with_its_integral_has_its_zero_found_at_once(coefficients: tuple[float, ...]) -> None:
    c0, c1, c2 = coefficients

    def rate(x: float) -> float:
        return c0 + c1 * x + c2 * x**2

    bracket = _Bracket((0.2, rate(0.2)), (1.1, rate(1.1)))
    assert bracket.newest[1] * bracket.other[1] < 0.0
    rise = sum(c * (1.1**n - 0.2**n) / n for n, c in enumerate(coefficients, start=1))
    assert rate(bracket.zero_of_derivative(rise)) == pytest.approx(0.0, abs=1e-12)
