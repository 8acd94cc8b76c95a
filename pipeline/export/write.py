"""Export of one file, in the format of its suffix."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from pipeline.errors import InputError, input_error, system_reason
from pipeline.output_paths import check_output_path
from pipeline.store.disk_errors import storage_error

_SUFFIXES = (".mat", ".uff", ".unv", ".vtu", ".op4", ".mtx")


def export(source: Path, target: Path, sector_file: Path | None = None, file_format: str | None = None) -> str:
    """Export a response or a reduced model; returns a summary in words.

    The target is replaced in one step, or left as it is.
    """
    from pipeline.export.matrices import matrix_format, moved

    suffix = target.suffix.lower()
    note = ""
    matrices = matrix_format(target, file_format)
    if source.is_dir() and suffix in _SUFFIXES:
        source, sector_file, note = _in_folder(source, sector_file, ".vtu" if matrices else suffix)
    files: list[Path] = []
    if suffix not in _SUFFIXES:
        raise input_error(target, "", f'ends with "{suffix}"', ", ".join(_SUFFIXES))
    check_output_path(target, "--to")
    for name, read in (("the file to export", source), ("--mesh", sector_file)):
        if read is not None and target.exists() and read.exists() and target.samefile(read):
            raise input_error("--to", str(target), f"is also {name}", "another file")
    beside = target.with_name(f".export-{os.getpid()}{suffix}")
    made = [folder for folder in target.parents if not folder.exists()]
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        summary = _writers(source, sector_file, matrices, files)[suffix](beside)
        places = moved(files or [beside], beside, target)
        if len(places) > 1:
            note += f"; files {places[0].name} to {places[-1].name}"
    except OSError as error:
        storage = storage_error(error, target.parent)
        if storage is not None and storage.full:
            raise storage from None
        raise InputError(f"{target}: cannot be written: {system_reason(error)}") from None
    finally:
        for path in (beside, *files):
            _remove(path)
        with suppress(OSError):  # not empty after an export
            for folder in made:
                folder.rmdir()
    return summary + note


def _writers(
    source: Path, sector_file: Path | None, matrices: str | None, files: list[Path]
) -> dict[str, Callable[[Path], str]]:
    """What writes each suffix; matrices in a format of their own add the files written to `files`."""
    from pipeline.export.matlab import write_matlab
    from pipeline.export.matrices import write_matrix_files
    from pipeline.export.shapes import write_shapes
    from pipeline.export.universal import write_universal

    def write_them(path: Path) -> str:
        said, written = write_matrix_files(source, path, str(matrices))
        files.extend(written)
        return said

    return {
        ".mat": lambda path: write_matlab(source, path) if matrices is None else write_them(path),
        ".uff": lambda path: write_universal(source, path),
        ".unv": lambda path: write_universal(source, path),
        ".vtu": lambda path: write_shapes(source, sector_file, path),
        ".op4": write_them,
        ".mtx": write_them,
    }


def _in_folder(folder: Path, sector_file: Path | None, suffix: str) -> tuple[Path, Path | None, str]:
    """The file of a run to export, the mesh of its model, and a remark."""
    from pipeline.results.run_folder import models_of_run, response_of_run

    if suffix != ".vtu":
        return response_of_run(folder), sector_file, ""
    models = models_of_run(folder)
    first = models[0]
    which = f"; the first of {len(models)} models, {first.entry['rom']}" if len(models) > 1 else ""
    return first.rom, sector_file or first.mesh, which


def _remove(path: Path) -> None:
    """Remove a file if possible."""
    try:
        path.unlink(missing_ok=True)
    except OSError:
        return
