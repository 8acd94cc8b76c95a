"""Formulas of the pages become MathML."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from docs.formulas import mathml

DEVELOPERS = Path(__file__).parents[2] / "docs" / "developers"
METHOD = "".join(
    page.read_text() for page in [DEVELOPERS / "method.md", *sorted((DEVELOPERS / "method").glob("*.md"))]
)
SPACE = "{http://www.w3.org/1998/Math/MathML}"


def test_a_fraction_and_a_sum() -> None:
    root = ElementTree.fromstring(mathml(r"\sum_m \frac{\phi_m}{\omega_m^2 - h\omega}", block=True))
    assert root.tag == f"{SPACE}math"
    assert root.get("display") == "block"
    (fraction,) = root.iter(f"{SPACE}mfrac")
    assert "".join(fraction.itertext()).split() == ["ϕ", "m", "ω", "m", "2", "−", "h", "ω"]


def test_a_formula_that_is_not_understood_is_named() -> None:
    with pytest.raises(ValueError, match=r"formula not understood: a \\nonsense b"):
        mathml(r"a \nonsense b", block=False)
    with pytest.raises(ValueError, match="with braces"):
        mathml(r"\frac12 x", block=False)


def test_every_symbol_of_the_method_is_in_its_table_once() -> None:
    table = METHOD.partition("## Symbols")[2].partition("\n## ")[0]
    listed = [
        symbol
        for line in table.splitlines()
        for symbol in re.findall(r"\$([^$]+)\$", line.split("|")[1] if "|" in line else "")
    ]
    assert len(listed) == len(set(listed)) > 40
    used = METHOD.partition("A superscript")[2]
    assert [symbol for symbol in listed if symbol.split("^")[0] not in used] == []
