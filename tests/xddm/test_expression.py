"""Expressions: values as mathematics has them, exact derivatives, and errors with their place."""

import cmath
import math
import random
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from moldline.errors import ParameterError
from moldline.xddm.expression import parsed

POINT = {"x": 0.7, "y": 1.9, "Model__w__Variable__dz[3,1]": -0.4}
Z = "Model__w__Variable__dz[3,1]"


def complex_value(text, values):
    """Python's own reading of the same text, for numbers with an imaginary part."""
    names = {name: f"v{i}" for i, name in enumerate(values)}
    for name, short in names.items():
        text = re.sub(rf"\b{re.escape(name)}(?!\w)", short, text)
    known = {f: getattr(cmath, f) for f in ("exp", "log", "sqrt", "sin", "cos", "tan")}
    known |= {names[name]: value for name, value in values.items()}
    return complex(eval(text.replace("^", "**"), {"__builtins__": {}}, known))


def complex_step(text, values, name):
    """The derivative without differences: the imaginary part of a tiny imaginary step."""
    return complex_value(text, {**values, name: complex(values[name], 1e-30)}).imag / 1e-30


CASES = [
    "x + 10*(1-y/0.56)^2",
    "x^2^y",
    "2^-x*3 - -x",
    "-x^2 + (-x)^2 / +y",
    "1 - 2 - x - 4/2/y*3",
    f"exp(-x*y)*sin({Z})/cos(x)^3 + tan({Z})",
    "log(x)*sqrt(y) - y^x + x^-3",
    f"{Z}^2*{Z}^3 + 1.5e-3*.5/2.",
    "x^0 + 0*y + (x - x)^2*log(y)",
]


@pytest.mark.parametrize("text", CASES)
def test_values_and_derivatives_are_those_of_complex_steps(text):
    value, gradient = parsed(text).value_and_gradient(POINT)
    assert value == pytest.approx(complex_value(text, POINT).real, rel=1e-14, abs=1e-14)
    assert set(gradient) == set(parsed(text).names)
    for name, slope in gradient.items():
        assert slope == pytest.approx(complex_step(text, POINT, name), rel=1e-13, abs=1e-14)


def random_text(source, depth):
    if depth == 0:
        return source.choice([*POINT, "2", "0.5", "3.25e0"])
    a, b = random_text(source, depth - 1), random_text(source, source.randrange(depth))
    return source.choice(
        [f"{a} + {b}", f"{a} - {b}", f"({a})*({b})", f"{a} / (2 + ({b})^2)", f"-{a}", f"({a})^2"]
        + [f"{f}({a})" for f in ("sin", "cos")]
    )


def test_random_expressions_have_the_derivatives_of_complex_steps():
    source = random.Random(8)
    for _ in range(60):
        text = random_text(source, 4)
        value, gradient = parsed(text).value_and_gradient(POINT)
        assert value == pytest.approx(complex_value(text, POINT).real, rel=1e-12, abs=1e-12)
        for name, slope in gradient.items():
            expected = complex_step(text, POINT, name)
            assert slope == pytest.approx(expected, rel=1e-11, abs=1e-11), text


def test_the_remainder_of_a_first_order_expansion_is_of_second_order():
    expression = parsed("exp(x*y) - sqrt(y)^3/(1 + x^2) + log(x + y)*sin(x)")
    value, gradient = expression.value_and_gradient(POINT)
    rest = []
    for step in (1e-2, 5e-3):
        moved = {**POINT, "x": POINT["x"] + 0.8 * step, "y": POINT["y"] - 0.6 * step}
        linear = value + step * (0.8 * gradient["x"] - 0.6 * gradient["y"])
        rest.append(abs(expression.value(moved) - linear))
    assert math.log2(rest[0] / rest[1]) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize(
    "text, value, slope",
    [
        ("min(x, 3, 1)", 0.7, 1.0),
        ("max(x, 3, 1)", 3.0, 0.0),
        ("max(x, 0.7)", 0.7, 1.0),
        ("abs(-x)", 0.7, 1.0),
        ("abs(x - x)", 0.0, 0.0),
        ("(x - 0.7)^1", 0.0, 1.0),
        ("(x - 0.7)^2", 0.0, 0.0),
        ("sqrt(4)*x", 1.4, 2.0),
        ("2^-3^2*512", 1.0, None),
        ("-2^2", -4.0, None),
        ("2^3^2", 512.0, None),
    ],
)
def test_closed_forms(text, value, slope):
    found, gradient = parsed(text).value_and_gradient(POINT)
    assert found == pytest.approx(value, rel=1e-15)
    assert gradient.get("x") == slope


def test_names_may_hold_brackets_dots_and_spaces_in_brackets():
    expression = parsed("Lattice__rows[2]__Variable__dz[ 3, 1 ] + a.b + Länge + max + a.b")
    assert expression.names == ("Lattice__rows[2]__Variable__dz[3,1]", "a.b", "Länge", "max")


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "the expression is empty"),
        ("CD + ", r"column 6 of 'CD \+ ': expected a number, a name .*found the end"),
        ("(a + b", r"column 7 .*expected '\)' for the '\(' in column 1, found the end"),
        ("a b", "column 3 of 'a b': expected an operator or the end, found 'b'"),
        ("a ** b", r"column 4 .*found '\*'; write a power as a\^b"),
        ("a = b", "column 3 .*'=' has no meaning in an expression; an expression only computes"),
        ("__import__('os')", "no function '__import__'; known are exp, log"),
        ("sin x", "expected an operator"),
        ("sin(x, y)", "sin takes one value, got 2"),
        ("min(x)", "min takes at least 2 values, got 1"),
        ("2(x)", "column 2 .*functions are"),
        ("1e999", "column 1 .*too large"),
        ("x;y", "column 2 .*';' has no meaning"),
        ("x + \x1b[31m", r"column 5 of 'x \+ \\x1b"),
        ("(" * 65 + "1" + ")" * 65, "nested more than 64 deep"),
        ("-" * 100 + "1", "nested more than 64 deep"),
        ("2^" * 100 + "1", "nested more than 64 deep"),
        ("1+" * 40000, "80000 characters, expected at most 65536"),
    ],
)
def test_what_cannot_be_read_is_told_with_its_column(text, message):
    with pytest.raises(ParameterError, match=message):
        parsed(text)


@pytest.mark.parametrize(
    "text, message",
    [
        ("1 + 2/(x - 0.7)", "column 6 of .*: division by zero"),
        ("log(x - 0.7)", "column 1 .*the logarithm of 0"),
        ("sqrt(-x)", "the square root of -0.7"),
        ("(-x)^0.5", "-0.7 to the power 0.5 is no real number"),
        ("(x - 0.7)^-1", "division by zero: 0 to the power -1"),
        ("exp(2000*x)", "column 1 .*too large"),
        ("1e300*1e300*x", "column 6 .*too large"),
        ("10^(1000*x)", "too large"),
        ("unknown + x", "column 1 .*'unknown' has no value"),
        ("sqrt(x - 0.7)", "no finite slope at zero"),
        ("(x - 0.7)^0.5", "no finite slope"),
        ("(x - 0.7)^(y - y)", "no slope by the power"),
        ("(-2)^(x - x + 2)", "-2 to a power that varies"),
    ],
)
def test_what_has_no_value_or_slope_is_told_with_its_column(text, message):
    with pytest.raises(ParameterError, match=message):
        parsed(text).gradient(POINT)


def test_a_value_that_is_not_finite_is_told():
    with pytest.raises(ParameterError, match="'x' is nan"):
        parsed("x").value({"x": float("nan")})


def test_long_sums_need_no_depth():
    expression = parsed("+".join(["x*2"] * 10000))
    assert expression.gradient({"x": 1.0}) == {"x": 20000.0}


@settings(max_examples=150, deadline=None)
@given(st.text("xy01.e+-*/^(), []sinmaxlogpqrt_\n=é", max_size=24))
def test_any_text_is_computed_or_refused(text):
    try:
        value, gradient = parsed(text).value_and_gradient({"x": 0.5, "y": -2.0})
    except ParameterError:
        return
    assert math.isfinite(value) and all(map(math.isfinite, gradient.values()))
