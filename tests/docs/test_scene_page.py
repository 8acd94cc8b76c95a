"""The page of the keys of a scene has every key, as the classes of the sections have it."""

from docs.scene_tables import PAGE, TABLE, with_tables
from pipeline.scene.schema import SECTIONS


def test_the_tables_of_keys_are_made_from_the_classes() -> None:
    text = PAGE.read_text()
    assert text == with_tables(text), "python docs/scene_tables.py renews the tables"


def test_every_section_has_its_table() -> None:
    assert {*SECTIONS, "interface"} <= {name for _, name in TABLE.findall(PAGE.read_text())}
