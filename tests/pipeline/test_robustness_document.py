"""docs/developers/robustness.md in step with the program: its tables are made by `robustness_cases`.

That the messages are right is asserted elsewhere: test_scene_mutations, test_bad_files, tests/rom/test_damaged_*.
"""

from robustness_cases import DOCUMENT, FILES, SCENES, WARNED, with_tables


def test_every_line_of_the_tables_is_what_comes_out() -> None:
    document = DOCUMENT.read_text(encoding="utf-8")
    assert document.count("<!-- robustness: ") == 3
    assert document.count("\n| ") >= len(FILES) + len(SCENES) + len(WARNED)
    assert with_tables(document).splitlines() == document.splitlines()
