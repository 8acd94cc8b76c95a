"""The README is short, and its numbers are those of the tables that it sums up."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()


def cells(page: str, first: str, second: str = "") -> list[str]:
    """Cells of the first row of a page that begins with these."""
    for line in (ROOT / "docs" / page).read_text().splitlines():
        found = [cell.strip() for cell in line.strip("|").split("|")]
        if found[0] == first and (not second or found[1] == second):
            return found
    raise AssertionError(f"docs/{page}: no row {first} {second}")


def row(what: str) -> str:
    """A row of the README's table of accuracy and speed."""
    return next(line for line in README.splitlines() if line.startswith(f"| {what}"))


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"\d+\.?\d*(?:e-?\d+)?", text)]


def test_it_is_short() -> None:
    assert len(README.split()) <= 1000


def test_its_source_fits_on_a_screen() -> None:
    text = re.sub(r"^```text\n.*?^```", "", README, flags=re.DOTALL | re.MULTILINE)  # what a run prints
    lines = [line for line in text.splitlines() if not line.startswith("|")]  # a row of a table is one line
    assert [line for line in lines if len(line) > 100] == []


def test_presets() -> None:
    seconds, errors = row("four curves").split("|")[2].split(";")
    measured = [
        cells("developers/performance.md", "accuracy =", f'"{name}"') for name in ("draft", "standard", "reference")
    ]
    assert numbers(seconds) == pytest.approx([float(found[5]) for found in measured], rel=0.02)
    assert numbers(errors) == [numbers(found[6])[0] for found in measured]


def test_run_times() -> None:
    names = (
        "default scene from nothing",
        "`shroud run`, nothing changed",
        "last-stage blade, `scenes/machine.toml`, from nothing",
    )
    first, again, machine = (float(cells("developers/performance.md", name)[2].split()[0]) for name in names)
    assert numbers(row("last-stage blade").split("|")[2]) == pytest.approx([machine], rel=0.03)
    assert numbers(row("the default scene").split("|")[2]) == pytest.approx([first, again], rel=0.03)
    dofs = float(cells("developers/performance.md", "142 000 dofs to reduced model")[2].split()[0])
    assert numbers(row("142 000 dofs").split("|")[2])[0] == pytest.approx(dofs, rel=0.03)


def test_beside_pyharm() -> None:
    faster = [int(cells("developers/performance.md", case)[3]) for case in ("A1", "A5", "V1", "V5", "S1")]
    assert numbers(row("a solved point").split("|")[2]) == [min(faster), max(faster)]


def test_beside_calculix_and_rings_in_time() -> None:
    text = (ROOT / "docs" / "developers" / "verification.md").read_text()
    table = text.partition("## Frequencies at speed")[2].partition("\n## ")[0]
    lines = [line.strip("|").split("|") for line in table.splitlines() if "e-0" in line and line[:1] == "|"]
    assert max(float(cell) for line in lines for cell in line[3:5]) <= numbers(row("natural frequencies"))[0]
    right, of, marginal = map(int, numbers(row("stability compared").split("|")[2]))
    assert f"{right} rings of {of} stay or leave as the exponents say" in text
    assert f"{marginal} are marginal" in text
