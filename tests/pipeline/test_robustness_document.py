"""docs/robustness.md says what the program says."""

from robustness_cases import DOCUMENT, FILES, SCENES, WARNED, with_tables


def test_every_line_of_the_tables_is_what_comes_out() -> None:
    document = DOCUMENT.read_text(encoding="utf-8")
    assert document.count("<!-- robustness: ") == 3
    assert document.count("\n| ") >= len(FILES) + len(SCENES) + len(WARNED)
    assert with_tables(document).splitlines() == document.splitlines()
