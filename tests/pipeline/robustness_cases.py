"""What docs/developers/robustness.md says of bad input: each line is tried; run as a program, this writes it."""

import re
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from pipeline_support import WHOLE, ground_scene, shroud, small_scene, to_toml, write_ground_model, write_scene

DOCUMENT = Path(__file__).parents[2] / "docs" / "developers" / "robustness.md"
LONGEST = 150
Case = tuple[str, Callable[[Path], object]]


def scene(**changes: Any) -> Callable[[Path], object]:
    return lambda path: write_scene(path, small_scene(**(WHOLE | changes)))


def text(change: Callable[[str], str | bytes]) -> Callable[[Path], object]:
    """The small scene with its text changed."""

    def write(path: Path) -> None:
        content = change(to_toml(small_scene(**WHOLE)))
        path.write_bytes(content if isinstance(content, bytes) else content.encode())

    return write


SCENES: list[Case] = [
    ("`contact.friction` missing", scene(contact__friction=None)),
    ('`force = "1 N"`', scene(excitation__force="1 N")),
    ("`n_blades = 72.0`", scene(blade__n_blades=72.0)),
    ("`frction = 0.1`", scene(contact__frction=0.1)),
    ("`size = 1e-6`: a mesh of 1e12 elements", scene(mesh__size=1e-6)),
    ("15 x 15 contact nodes and 15 harmonics", scene(mesh__contact_grid=[15, 15], response__harmonics=15)),
    (
        "a swept list of 200 values, twice",
        scene(
            sweep={name: [0.1 + 0.001 * k for k in range(200)] for name in ("contact.friction", "excitation.force")}
        ),
    ),
    ("`young_modulus = 210`: GPa for Pa", scene(material__young_modulus=210.0)),
    ("`at = [0, 0, 450]`: mm for m", scene(excitation__at=[0.0, 0.0, 450.0])),
    ("`modes = [100]` of `[render]` where there are 33", scene(render={"modes": [100]})),
    ('`name = "../escape"`', scene(name="../escape")),
    ("a key twice", text(lambda t: t + "harmonics = 2\n")),
    ("UTF-16", text(lambda t: t.encode("utf-16"))),
    ("an empty file", text(lambda t: "")),
    ("a link to `/dev/zero`", lambda path: path.symlink_to("/dev/zero")),
]

WARNED: list[Case] = [
    ("`young_modulus = 2.1e9`", scene(material__young_modulus=2.1e9)),
    ("`friction = 4`", scene(contact__friction=4.0)),
    ("`angle = 1.22`: radians for degrees", scene(shroud__angle=1.22)),
    ("`damping_ratio = 0.3`: % for a fraction", scene(response__damping_ratio=0.3)),
    ("`normal_stiffness = 200`: N/mm for N/m", scene(contact__normal_stiffness=200.0)),
    ("`interference = 0.005`: mm for m", scene(contact__interference=0.005)),
]


def model(change: Callable[[h5py.File], object]) -> Callable[[Path], object]:
    """A reduced model with something changed in its file."""

    def write(path: Path) -> None:
        write_ground_model(path, contact_area=np.ones(3))
        with h5py.File(path, "r+") as file:
            change(file)

    return write


def dataset(name: str, value: Any) -> Callable[[Path], object]:
    def change(file: h5py.File) -> None:
        made = value(file[name][()]) if callable(value) else value
        del file[name]
        file[name] = made

    return model(change)


def _huge(file: h5py.File) -> None:
    del file["basis" if "basis" in file else "mass"]
    file.create_dataset("mass", shape=(15_000, 15_000), dtype="f8", chunks=True)


def _cut(path: Path) -> None:
    write_ground_model(path)
    path.write_bytes(path.read_bytes()[:3000])


FILES: list[Case] = [
    ("no dataset `mass`", model(lambda file: file.pop("mass"))),
    ("`stiffness` is not symmetric", dataset("stiffness", lambda a: a + np.triu(np.ones_like(a), 1))),
    ("`stiffness` lets the structure float", dataset("stiffness", lambda a: a * 0.0)),
    ("`contact/right` has a row too few", dataset("contact/right", lambda a: a[:-1])),
    ("`contact/area` is negative", dataset("contact/area", lambda a: -a)),
    ("`n_blades = 1000000000`", model(lambda file: file.attrs.update(n_blades=10**9))),
    ("`mass` is a link into another file", dataset("mass", h5py.ExternalLink("other.h5", "mass"))),
    ("`mass` claims 1.8 GB that nobody wrote", model(_huge)),
    ("`mass` has 30 000 rows", dataset("mass", lambda a: np.broadcast_to(np.int8(0), (30_000, 1)))),
    ("cut off", _cut),
]


def said_of_scenes(cases: list[Case]) -> Iterator[tuple[str, str]]:
    """Each case with what `shroud validate` says of it, and its exit status."""
    for what, make in cases:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "scene.toml"
            make(path)
            status, _, error = shroud("validate", path)
            yield what, _shown(status, error, path)


def said_of_files(cases: list[Case]) -> Iterator[tuple[str, str]]:
    """Each case with what `shroud respond --rom` says of it, and its exit status."""
    for what, make in cases:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "rom.h5"
            make(path)
            asked = write_scene(Path(folder) / "scene.toml", ground_scene())
            status, _, error = shroud("respond", asked, "--rom", path, "--out", Path(folder) / "out")
            assert not (Path(folder) / "out").exists()
            yield what, _shown(status, error, path)


def _shown(status: int, error: str, path: Path) -> str:
    first, *others = error.splitlines()
    line = first.replace(str(path.parent) + "/", "").replace("|", "\\|")
    line = line if len(line) <= LONGEST else line[: LONGEST - 3] + "..."
    return f"{status}: `{line}`" + (f", and {len(others)} more" if others else "")


def tables() -> dict[str, str]:
    """The tables of the document, by name."""
    rows = {"scenes": said_of_scenes(SCENES), "warnings": said_of_scenes(WARNED), "files": said_of_files(FILES)}
    return {
        name: "\n".join(
            ["| input | exit status, and what is said |", "|---|---|", *(f"| {a} | {b} |" for a, b in lines)]
        )
        for name, lines in rows.items()
    }


def with_tables(document: str) -> str:
    """The document with its tables made anew."""
    end = "<!-- end -->"
    for name, table in tables().items():
        start = f"<!-- robustness: {name} -->"
        document = re.sub(
            f"{re.escape(start)}.*?{end}", lambda _, t=table, s=start: f"{s}\n{t}\n{end}", document, flags=re.DOTALL
        )
    return document


if __name__ == "__main__":
    DOCUMENT.write_text(with_tables(DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
