"""Expressions of a document: values, derivatives by the chain rule, and their place in it."""

import pytest
from xddm_documents import DESIGN, MODEL

from moldline.errors import FileError, ParameterError
from moldline.xddm.chain import Quantity, evaluated, quantities
from moldline.xddm.document import Document
from moldline.xddm.model import Design
from moldline.xddm.order import ordered
from moldline.xddm.results import filled

ALPHA = "Optimize__DesignPoint__A__Variable__alpha"
SPAN = "Model__wing__Variable__span"
VOLUME = {"Model__wing__Analysis__Volume": Quantity(0.9, {SPAN: 0.15})}


def design(text):
    return Design(Document(text.encode(), "d.xml"))


def test_the_chain_rule_goes_through_results_to_variables():
    found = evaluated(design(DESIGN), VOLUME)
    a = found["Optimize__DesignPoint__A__Function__J"]
    by_lift = -2 * 10 * (1 - 0.5 / 0.56) / 0.56
    assert a.value == pytest.approx(0.02 + 10 * (1 - 0.5 / 0.56) ** 2, rel=1e-15)
    assert a.gradient == pytest.approx({ALPHA: 0.002 + 0.1 * by_lift, SPAN: 0.01 * by_lift})
    assert found["Optimize__Constraint__vol"] == Quantity(0.9, {SPAN: 0.15})
    assert found["Optimize__Sum__drag"] == Quantity(0.04, {ALPHA: 0.004})


def test_without_derivatives_of_a_result_there_are_none_of_what_it_makes():
    found = evaluated(design(DESIGN), VOLUME)
    b = found["Optimize__DesignPoint__B__Function__J"]
    total = found["Optimize__Objective__total"]
    assert b.gradient is total.gradient is None
    known = quantities(design(DESIGN))
    assert known["Optimize__DesignPoint__B__Analysis__CL"] == Quantity(0.4, None)
    assert known["Optimize__DesignPoint__A__Constant__Mach"].gradient == {}
    alpha_b = ALPHA.replace("__A__", "__B__")
    more = {
        "Optimize__DesignPoint__B__Analysis__CL": Quantity(0.5, {alpha_b: 0.2}),
        "Optimize__DesignPoint__B__Analysis__CD": Quantity(0.02, {}),
    }
    total = evaluated(design(DESIGN), VOLUME | more)["Optimize__Objective__total"]
    assert total.value == pytest.approx(2 * (0.02 + 10 * (1 - 0.5 / 0.56) ** 2), rel=1e-15)
    assert set(total.gradient) == {ALPHA, SPAN, alpha_b}


@pytest.mark.parametrize(
    "expression, message",
    [
        (
            "a + nothing",
            r"d.xml: line 3: Function 'f': Expr: column 5: nothing is named 'nothing'; k",
        ),
        (
            "a + g",
            "Function 'g': Expr: circular: M__Function__g -> M__Function__f -> M__Function__g",
        ),
        ("f", "Expr: circular: M__Function__f -> M__Function__f"),
        ("unset * 2", "Expr: column 1: M__Analysis__unset has no Value yet"),
        ("1/(a - 1)", "Function 'f': Expr: column 2 of '1/(a - 1)': division by zero"),
        ("1 +", "Function 'f': Expr: column 4 of"),
        ("", "Function 'f': Expr: the expression is empty"),
    ],
)
def test_expressions_that_fail_are_told_with_their_line(expression, message):
    text = (
        "<M><Variable ID='a' Value='1'/><Analysis ID='unset'/>\n<Function ID='g' Expr='f'/>\n"
        f"<Function ID='f' Expr='{expression}'/></M>"
    )
    with pytest.raises(FileError, match=message.replace("(", r"\(").replace(")", r"\)")):
        evaluated(design(text))


def test_long_chains_are_put_in_order():
    names = [f"f{i}" for i in range(3000)]
    order, circle = ordered({a: [b, b, "x"] for a, b in zip(names, names[1:] + ["x"], strict=True)})
    assert order == names[::-1] and not circle
    assert ordered({"a": ["b"], "b": ["c"], "c": ["b"]})[1] == ["b", "c"]


def test_results_take_their_places_and_leave_the_rest():
    given = design(DESIGN)
    results = {
        "Optimize__DesignPoint__A__Analysis__CL": Quantity(0.5, {"new": 3.0, ALPHA: 0.25}),
        "Optimize__DesignPoint__A__Analysis__CD": Quantity(0.125, None),
        "Optimize__DesignPoint__B__Analysis__CL": Quantity(0.375, {}),
        "Optimize__DesignPoint__B__Variable__alpha": Quantity(2.5, {"x": 1.0}),
        "Optimize__Sum__drag": Quantity(0.25, {ALPHA: 2.0}),
    }
    cd_array = DESIGN[DESIGN.index("\n      <SensitivityArray>\n        <Sensitivity") :]
    cd_array = cd_array[: cd_array.index("</SensitivityArray>") + len("</SensitivityArray>")]
    expected = DESIGN.replace(
        f'<Sensitivity P="{ALPHA}" Value="0.1"/>\n        <Sensitivity P="{SPAN}" Value="0.01"/>',
        f'<Sensitivity P="{ALPHA}" Value="2.50000000000000000e-01"/>\n'
        '        <Sensitivity P="new" Value="3.00000000000000000e+00"/>',
    )
    expected = expected.replace('Value="0.02"', 'Value="1.25000000000000000e-01"')
    expected = expected.replace(cd_array, "")
    expected = expected.replace(
        '"CL" Value="0.4"/>',
        '"CL" Value="3.75000000000000000e-01">\n      <SensitivityArray/>\n    </Analysis>',
    ).replace('Value="2.0"', 'Value="2.50000000000000000e+00"')
    expected = expected.replace(
        'CD * 2"/>',
        'CD * 2" Value="2.50000000000000000e-01">\n    <SensitivityArray>\n'
        f'      <Sensitivity P="{ALPHA}" Value="2.00000000000000000e+00"/>\n'
        "    </SensitivityArray>\n  </Sum>",
    )
    assert filled(given, results).data.decode() == expected
    again = Design(filled(given, results))
    read = quantities(again)
    assert read["Optimize__DesignPoint__A__Analysis__CL"].gradient == {ALPHA: 0.25, "new": 3.0}
    assert filled(again, results).data == again.document.data


def test_sensitivities_by_short_names_are_understood():
    text = MODEL.replace(
        'Sensitivity="required"/>',
        'Value="2"><SensitivityArray><Sensitivity P="dz[3,1]" Value="4"/></SensitivityArray>'
        "</Analysis>",
    )
    name = "Model__wing__Lattice__sections__Variable__dz[3,1]"
    assert quantities(design(text))["Model__wing__Analysis__Volume"].gradient == {name: 4.0}
    ratio = evaluated(design(text))["Model__wing__Function__Ratio"]
    assert ratio == Quantity(0.5, {name: 1.0})
    changed = filled(design(text), {"Model__wing__Analysis__Volume": Quantity(2.0, {name: 5.0})})
    assert b'<Sensitivity P="dz[3,1]" Value="5.0000' in changed.data


def test_a_result_without_a_place_is_told():
    with pytest.raises(ParameterError, match=r"d.xml: nothing is named 'Area'"):
        filled(design(MODEL), {"Area": Quantity(1.0)})
