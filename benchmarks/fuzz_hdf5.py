"""Fuzzing the readers of HDF5 files: reduced models, responses, full models, sectors (see fuzz.py).

The inputs are small valid files with bytes changed, cut off or copied from elsewhere in the file: HDF5's structures
are found by flipping what is there. The first seeds are files of each kind, written by the package itself.
"""

from __future__ import annotations

import random
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["pipeline", "geometry", "rom"]):
    from geometry import SectorFileError
    from pipeline import info, reading
    from pipeline.errors import InputError
    from pipeline.export import source
    from pipeline.export.source import Kind, curves, kind_of
    from pipeline.process.isolated_reading import read_apart
    from pipeline.results.file_info import contents
    from rom import FullModelFileError, ReducedModelError, load_full_model, load_sector, read_reduced_model

from fuzz_seeds import write_seeds

LONGEST = 65536
PATIENCE = 2.0  # s for one file
INTERESTING = (0, 1, 2, 7, 8, 16, 31, 32, 63, 64, 127, 128, 254, 255)


def mutated(data: bytes, size: int, seed: int) -> bytes:
    """Another file made of this one, of `size` bytes at most. Most keep the length: HDF5 counts every byte."""
    draw = random.Random(seed)
    if draw.random() < 0.1 or not data:
        return bytes(atheris.Mutate(data, size))
    changed = bytearray(data)
    for _ in range(draw.choice((1, 1, 1, 2, 4, 16))):
        place = draw.randrange(len(changed))
        action = draw.randrange(6)
        if action == 0:
            changed[place] ^= 1 << draw.randrange(8)
        elif action == 1:
            changed[place] = draw.choice(INTERESTING)
        elif action == 2:
            width = draw.choice((2, 4, 8))
            changed[place : place + width] = draw.choice((b"\xff", b"\x00", b"\x7f"))[:1] * len(
                changed[place : place + width]
            )
        elif action == 3:
            width, other = draw.choice((1, 2, 4, 8, 16, 64)), draw.randrange(len(changed))
            changed[place : place + width] = changed[other : other + width][: len(changed[place : place + width])]
        elif action == 4:
            changed[place] = (changed[place] + draw.choice((1, 255))) % 256
        elif draw.random() < 0.1:
            del changed[place + 1 :]
    return bytes(changed[:size])


READERS: tuple[tuple[Callable[[Path], object], type[Exception]], ...] = (
    (lambda path: contents(path), InputError),
    (read_reduced_model, ReducedModelError),
    (load_full_model, FullModelFileError),
    (load_sector, SectorFileError),
    (lambda path: curves(path) if kind_of(path) is Kind.response else None, InputError),
)


def attempt(path: Path, data: bytes) -> None:
    """Read as every kind of file; only the package's own errors may come out, one line each.

    Files over which the HDF5 library itself crashes or goes round in circles are sorted out as the program does it,
    by reading them in another process first; the log says of each.
    """
    path.write_bytes(data)
    try:
        read_apart(path, "a file", lambda: _tried(path))
    except InputError as error:
        print(f"handled: {error}".replace(str(path), "file"), flush=True)
        return
    for reader in READERS:
        _read(path, *reader)


def _tried(path: Path) -> None:
    for read, _ in READERS:
        with suppress(Exception):
            read(path)


def _read(path: Path, read: Callable[[Path], object], own: type[Exception]) -> None:
    try:
        read(path)
    except own as error:
        if "\n" in str(error) or not str(error).startswith(f"{path}: "):
            raise AssertionError(f"not one line about the file: {error}") from None


def check(path: Path) -> None:
    """Read one file as the program does: where the library dies of it, one line says so."""
    for read, own in READERS:
        with suppress(InputError):
            read_apart(path, "a file", partial(_read, path, read, own))


def main() -> None:
    """Seed the corpus with small files of every kind, then fuzz; with --check, try one file."""
    if sys.argv[1] == "--check":
        check(Path(sys.argv[2]))
        return
    write_seeds(Path(sys.argv[1]))
    for seed in Path(sys.argv[1]).glob("seed-*"):
        _tried(seed)  # whatever is imported on the way is imported here, and not in every process that reads first
    reading.PATIENCE = PATIENCE
    for module in (info, source):  # here and now, so that their coverage is seen
        module.read_apart = lambda path, allowed, read: read()
    path = Path("current-hdf5").resolve()
    arguments = [*sys.argv, f"-max_len={LONGEST}"]
    atheris.Setup(arguments, lambda data: attempt(path, data), custom_mutator=mutated)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
