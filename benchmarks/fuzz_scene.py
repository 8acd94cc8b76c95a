"""Fuzzing the scene reader: bytes -> `read_scene` and `check_scene` (see fuzz.py).

Some inputs are mutated as bytes, most as TOML with the words of the schema: a key gets another value, is doubled,
dropped, misspelt or moved.
"""

from __future__ import annotations

import random
import re
import sys
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["pipeline", "geometry", "tomllib"]):
    from pipeline.errors import InputError
    from pipeline.scene.consistency import check_scene, check_scene_for_model
    from pipeline.scene.plausibility import plausibility_warnings
    from pipeline.scene.reading import read_scene
    from pipeline.scene.schema import SECTIONS

SCENES = Path(__file__).resolve().parents[1] / "scenes"
TEMPLATE = Path(__file__).resolve().parents[1] / "pipeline" / "templates" / "scene.toml"
LONGEST = 8192
ODD = (
    *(
        "nan",
        "inf",
        "-inf",
        "0",
        "-1",
        "-0.0",
        "1e300",
        "1e-300",
        "1e15",
        "1e16",
        "1e-12",
        "1e-13",
        "+5",
        "5.",
        "1_000",
    ),
    *(
        "true",
        "false",
        "0x10",
        "9223372036854775808",
        "1979-05-27",
        "07:32:00",
        "1979-05-27T07:32:00Z",
        "100000",
        "65536",
    ),
    *(
        "[]",
        "[[]]",
        "{}",
        "{a=1}",
        "[1,2]",
        "[1,2,3]",
        "[0,0,0]",
        "[nan,1]",
        "[1,]",
        "[true]",
        "[15,15]",
        "[1e-6,1e3]",
    ),
    *("''", '"x"', "'''a'''", '"auto"', '"punch"', '"tip"', '"-z"', '"hex27"', '"draft"', '"reference"'),
)


def words() -> list[str]:
    """Sections, keys and dotted keys of the schema."""
    keys = [(name, key) for name, section in SECTIONS.items() for key in section.model_fields]
    return [*SECTIONS, "sweep", *(key for _, key in keys), *(f'"{name}.{key}"' for name, key in keys)]


WORDS = words()


def mutated(data: bytes, size: int, seed: int) -> bytes:
    """Another input made of this one, of `size` bytes at most."""
    draw = random.Random(seed)
    if draw.random() < 0.4:
        return bytes(atheris.Mutate(data, size))
    lines = data.decode("utf-8", "replace").split("\n")
    for _ in range(draw.randint(1, 3)):
        _mutate_line(lines, draw)
    return "\n".join(lines).encode()[:size]


def _mutate_line(lines: list[str], draw: random.Random) -> None:
    place = draw.randrange(len(lines))
    line = lines[place]
    head, equals, _ = line.partition("=")
    action = draw.randrange(7)
    if action == 0:
        lines.insert(place, line)
    elif action == 1 and len(lines) > 1:
        del lines[place]
    elif action == 2:
        lines.insert(place, f"[{draw.choice([*SECTIONS, 'sweep', 'a.b', '[x]'])}]")
    elif action == 3:
        lines.insert(place, f"{draw.choice(WORDS)} = {_value(draw)}")
    elif action == 4 and len(line) > 1:
        at = draw.randrange(len(line))
        lines[place] = line[:at] + draw.choice("\"'[]{}=#.,\\\t -_e0\x00\u202e") + line[at + draw.randint(0, 1) :]
    elif action == 5:
        numbers = list(re.finditer(r"[-+]?\d[\d_.]*(e[-+]?\d+)?", line))
        if numbers:
            found = draw.choice(numbers)
            lines[place] = line[: found.start()] + _value(draw) + line[found.end() :]
    elif equals:
        lines[place] = f"{head}= {_value(draw)}"


def _value(draw: random.Random) -> str:
    kind = draw.randrange(4)
    if kind == 0:
        return repr(10.0 ** draw.uniform(-13, 16) * draw.choice((1.0, -1.0)))
    if kind == 1:
        return "[" + ", ".join(draw.choice(ODD) for _ in range(draw.randint(0, 5))) + "]"
    return draw.choice(ODD)


def attempt(path: Path, data: bytes) -> None:
    """Read and check as `shroud validate` and `shroud respond` do; only the package's own error may come out."""
    path.write_bytes(data)
    for given_model in (False, True):
        try:
            file = read_scene(path, given_model)
            if given_model:
                check_scene_for_model(file, 4, True)
            else:
                check_scene(file)
            plausibility_warnings(file)
        except InputError as error:
            if "\n" in str(error) or not str(error).startswith(f"{path}: "):
                raise AssertionError(f"not one line about the file: {error}") from None


def main() -> None:
    """Seed the corpus with the scenes that ship, then fuzz; with --check, try one file."""
    if sys.argv[1] == "--check":
        attempt(Path(sys.argv[2]), Path(sys.argv[2]).read_bytes())
        return
    corpus = Path(sys.argv[1])
    for number, scene in enumerate([*sorted(SCENES.glob("*.toml")), TEMPLATE]):
        (corpus / f"seed-{number}").write_bytes(scene.read_bytes())
    path = Path("current-scene").resolve()
    arguments = [*sys.argv, f"-max_len={LONGEST}"]
    atheris.Setup(arguments, lambda data: attempt(path, data), custom_mutator=mutated)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
