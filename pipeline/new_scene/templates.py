"""A new scene: a commented scene file, and the schema by which editors complete and check it."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Annotated

from pydantic import TypeAdapter, ValidationError

from pipeline.errors import InputError, input_error, shown, system_reason
from pipeline.output_paths import check_output_path
from pipeline.scene.json_schema import scene_schema
from pipeline.scene.presets import PRESETS, SIZE
from pipeline.scene.schema import Scene
from pipeline.scene.validation_errors import allowed_values

SCENE, SCHEMA = "scene.toml", "scene.schema.json"
PRESET = "standard"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


def write_new_scene(folder: Path, title: str = "") -> list[Path]:
    """Write a scene and its schema into a folder, which is created where it does not exist."""
    check_new_folder(folder)
    return new_files(folder, scene_text(folder.resolve().name, title), {})


def check_new_folder(folder: Path, *further: str) -> None:
    """Refuse a folder that cannot name a scene or that has files of these names."""
    check_output_path(folder, "DIR", len(SCHEMA) + 1)
    name = folder.resolve().name
    if not _NAME.fullmatch(name):
        allowed = "letters, digits, '.', '_' and '-', beginning with a letter or a digit, 64 at most"
        raise input_error(folder, "", f'"{name}" is to name the scene', allowed)
    names = (SCENE, SCHEMA, *further)
    for target in (folder / each for each in names):
        if target.exists() or target.is_symlink():
            raise input_error(target, "", "already exists", f"a folder without {' and '.join(names)}")


def new_files(folder: Path, text: str, further: Mapping[str, bytes]) -> list[Path]:
    """Write the text of a scene, its schema and further files by their names; nothing is overwritten."""
    check_new_folder(folder, *further)
    schema = json.dumps(scene_schema(), indent=1) + "\n"
    contents = {SCENE: text.encode(), SCHEMA: schema.encode(), **further}
    targets = [folder / name for name in contents]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for target, content in zip(targets, contents.values(), strict=True):
            _write(target, content)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {system_reason(error)}") from None
    return targets


def check_title(title: str) -> str:
    """The title, which is to be one that a scene may have."""
    try:
        TypeAdapter(Annotated[str, Scene.model_fields["title"]]).validate_python(title)
    except ValidationError:
        raise input_error("--title", "", shown(title), allowed_values("title")) from None
    return title


def _write(target: Path, content: bytes) -> None:
    """Write a file that is not there yet, or nothing."""
    with target.open("xb") as file:
        try:
            file.write(content)
            file.flush()
        except OSError:
            target.unlink()
            raise


def scene_text(name: str, title: str = "") -> str:
    """The default scene as a user's own: its name and title, a preset, and a line that names the schema."""
    template = files("pipeline").joinpath("scene", "template", SCENE).read_text(encoding="utf-8")
    rest = template.partition("\n#\n")[2]
    heading = f"title = {json.dumps(title, ensure_ascii=False)}" if title else '# title = "..."'
    top = [
        f'name = "{name}"'.ljust(30) + f"# also the output folder: out/{name}",
        heading.ljust(30) + "# heading of the figures",
        f'accuracy = "{PRESET}"'.ljust(30)
        + '# of mesh, modes, harmonics and tolerances: "draft", "standard" or "reference";',
        " " * 30 + "# a key of these that is set below overrides it (shroud validate lists them)",
    ]
    lines, table = [], ""
    for line in rest.splitlines():
        table = line.strip("[]") if line.startswith("[") else table
        key = line.partition("=")[0].strip()
        dotted = f"{table}.{key}" if table else key
        if dotted == "name":
            lines += top
        elif dotted != "title" and dotted not in {SIZE, *PRESETS[PRESET].values}:
            lines.append(line)
    body = re.sub(r"^\[\w+\]\n\n", "", "\n".join(lines) + "\n", flags=re.MULTILINE)  # tables without a key
    return f"#:schema ./{SCHEMA}\n#\n# A scene to change; run it with `shroud run {SCENE}`.\n#\n{body}"
