"""Interpolation between two sides of a zero, on functions whose zero is known."""

import math
from collections.abc import Callable

import pytest

from nonlinear.continuation.zero_bracket import ZeroBracket, closed_bracket

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
    bracket, evaluations = ZeroBracket((0.0, function(0.0)), (1.0, function(1.0))), 0
    while bracket.width > 1e-9 and evaluations < most:
        place = bracket.next_place(5e-10)
        value = function(place)
        evaluations += 1
        if value == 0.0:
            return
        bracket = bracket.narrowed(place, value, value * function(1.0) > 0.0)
        assert (bracket.newest[0] - zero) * (bracket.other[0] - zero) <= 0.0
    assert bracket.width <= 1e-9, (name, evaluations, bracket)


@pytest.mark.parametrize("coefficients", [(1.0, -2.0, -3.0), (-0.5, 0.1, 2.0), (2.0, -3.0, 0.0), (-1.0, 5.0, -2.0)])
def test_a_quadratic_rate_with_its_integral_has_its_zero_found_at_once(coefficients: tuple[float, ...]) -> None:
    c0, c1, c2 = coefficients

    def rate(x: float) -> float:
        return c0 + c1 * x + c2 * x**2

    bracket = ZeroBracket((0.2, rate(0.2)), (1.1, rate(1.1)))
    assert bracket.newest[1] * bracket.other[1] < 0.0
    rise = sum(c * (1.1**n - 0.2**n) / n for n, c in enumerate(coefficients, start=1))
    assert rate(bracket.zero_of_derivative(rise)) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("ends", [(0.0, 1.0), (1.0, 0.0)])
def test_a_closed_bracket_has_its_sides_where_its_ends_were(name: str, ends: tuple[float, float]) -> None:
    function, zero, most = FUNCTIONS[name]
    places: list[float] = []

    def counted(x: float) -> float:
        places.append(x)
        return function(x)

    first, last = closed_bracket(counted, *((x, function(x)) for x in ends), 1e-13 if name == "smooth" else 1e-9)
    assert len(places) <= most + 2
    assert first[1] == 0.0 or (first[0] - last[0]) * (ends[0] - ends[1]) > 0.0
    assert first[1] * function(ends[0]) >= 0.0 >= last[1] * function(ends[0])
    assert min(abs(first[0] - zero), abs(last[0] - zero)) <= 1e-9
