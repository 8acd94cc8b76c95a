"""Export of one file in the format of its suffix: MATLAB file, universal file, mode shapes (VTU), and matrices of a
reduced model as Nastran OP4, Matrix Market, Abaqus and MATLAB 7.3 files.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError, input_error, reason_of, shown, system_reason
from pipeline.export.motions import MotionChoice, mesh_motion, write_motion, write_ring
from pipeline.export.source import WAVES, Kind, curves, kind_of
from pipeline.output_paths import check_output_path
from pipeline.process.isolated_reading import read_given_model
from pipeline.scene.schema import MEANINGS
from pipeline.store.disk_errors import storage_error
from rom.cyclic.reduced_model import ReducedModel

FORMATS = ("matrix-market", "abaqus", "mat-7.3")  # that `--format` names; the others follow from the suffix
BY_SUFFIX = {".mtx": "matrix-market", ".op4": "op4", ".mat": "mat"}
# names of at most 8 characters for OP4
SHORT_NAMES = {
    "stiffness": "K",
    "mass": "M",
    "coriolis": "CORIOLIS",
    "contact_right": "CRIGHT",
    "contact_left": "CLEFT",
    "contact_position": "CPOS",
    "contact_area": "CAREA",
    "contact_frame": "CFRAME",
    "cyclic_right": "CYCRIGHT",
    "cyclic_left": "CYCLEFT",
    "blade_stiffness": "KBLADE",
    "force_excitation": "FEXC",
    "force_centrifugal": "FCENT",
    "force_static": "FSTATIC",
    "basis": "BASIS",
}
_LONGEST = 8


def matrix_format(target: Path, wanted: str | None) -> str | None:
    """The format of `write_matrix_files` for a target; None where its suffix or MATLAB level 5 is not one of them."""
    suffix = target.suffix.lower()
    if wanted is None:
        return BY_SUFFIX[suffix] if suffix in (".mtx", ".op4") else None
    suffixes = {"matrix-market": ".mtx", "abaqus": ".mtx", "mat-7.3": ".mat"}
    if wanted not in FORMATS or suffixes[wanted] != suffix:
        fitting = [name for name in FORMATS if suffixes[name] == suffix]
        raise input_error("--format", "", wanted, ", ".join(fitting) or f"nothing with {suffix}")
    return wanted


def write_matrix_files(source: Path, target: Path, file_format: str) -> tuple[str, list[Path]]:
    """Write the matrices of a reduced model; returns a summary in words and the files."""
    from rom.errors import MatrixFileError
    from rom.matrix_files.matrix_file import write_matrices

    if kind_of(source) is not Kind.model:
        raise input_error(source, "", "a response", "a reduced model (rom.h5)")
    model = single_model(source)
    content = arrays_of(model)
    if file_format == "op4":
        content = _short(content)
    elif file_format == "abaqus":
        content = {name: content[name] for name in ("stiffness", "mass")}
    try:
        files = write_matrices(target, content, file_format)
    except MatrixFileError as error:
        raise InputError(reason_of(error)) from None
    return f"a reduced model of {model.size} coordinates: {', '.join(content)}", files


def single_model(source: Path) -> ReducedModel:
    """A reduced model whose matrices are those of the whole ring."""
    model = read_given_model(source)
    if model.wave_blocks:
        allowed = "a reduced model with one pair of matrices"
        raise input_error(source, WAVES, "a superelement for each nodal diameter", allowed)
    return model


def arrays_of(model: ReducedModel) -> dict[str, NDArray[Any]]:
    """All arrays of a reduced model by name; those of a mapping as `outputs_NAME`, `output_` for short."""
    found: dict[str, NDArray[Any]] = {}
    for field in fields(model):
        value = getattr(model, field.name)
        if isinstance(value, np.ndarray):
            found[field.name] = value.reshape(-1, 3) if value.ndim > 2 else value
        elif isinstance(value, Mapping) and field.name != "wave_blocks":
            prefix = "output" if field.name == "outputs" else field.name
            found |= {f"{prefix}_{name}": np.asarray(array) for name, array in value.items()}
    return {name: value for name, value in found.items() if value.size}


def _short(content: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """The same with names of at most 8 characters; those without a known one are numbered."""
    short: dict[str, NDArray[Any]] = {}
    for name, value in content.items():
        new = SHORT_NAMES.get(name, name.removeprefix("output_").upper())
        if len(new) > _LONGEST or new in short:
            new = f"X{len(short):03d}"
        short[new] = value
    return short


def moved(files: list[Path], beside: Path, target: Path) -> list[Path]:
    """Files written beside their target in its place, by their name."""
    placed = []
    for file in files:
        place = target.with_name(file.name.replace(beside.stem, target.stem, 1))
        os.replace(file, place)
        placed.append(place)
    return placed


LONGEST_NAME = 63


def write_matlab(source: Path, target: Path) -> str:
    """Write a response or a reduced model as a MATLAB file; returns a summary in words.

    A response becomes the cell array `curve`: structures with the name of a curve or branch (`0`, `0/branch/1`), its
    datasets and, in `parameter`, its attributes with underscores for dots. A reduced model becomes variables named
    as in `ReducedModel`.
    """
    from scipy.io import savemat

    if kind_of(source) is Kind.response:
        found = [_structure(*curve) for curve in curves(source)]
        cells = np.empty(len(found), dtype=object)
        cells[:] = found
        savemat(target, {"curve": cells}, oned_as="column", long_field_names=True, do_compression=True)
        return f"{len(found)} curve{'s' if len(found) != 1 else ''}, in the cell array curve"
    model = single_model(source)
    named = {field.name: getattr(model, field.name) for field in fields(model) if field.name != "wave_blocks"}
    for name in model.outputs:
        if not (name.isascii() and name.isidentifier() and name[0] != "_" and len(name) <= LONGEST_NAME):
            allowed = f"letters, digits and _, a letter first, {LONGEST_NAME} at most, as MATLAB has them"
            raise input_error(source, "output", shown(name), allowed)
    content = {name: value for name, value in named.items() if value is not None}
    savemat(target, content, oned_as="column", long_field_names=True)
    return f"a reduced model of {model.size} coordinates"


def _structure(name: str, datasets: dict[str, Any], attributes: dict[str, Any]) -> dict[str, Any]:
    parameter = {key.replace(".", "_"): value for key, value in attributes.items()}
    return {"name": name, **datasets, "parameter": parameter}


DISPLACEMENT, FORCE, FREQUENCY = 8, 13, 18  # specific data types
RESPONSE_FUNCTION = 4
SCALAR = 0  # direction: of the excitation, whichever it is


def write_universal(source: Path, target: Path) -> str:
    """Write x^(h) / F (m/N) of every curve, branch and harmonic h of the output; returns a summary in words.

    A curve with folds has several values at a frequency, so the abscissa is uneven and not monotonic.
    """
    if kind_of(source) is not Kind.response:
        raise input_error(source, "", "a reduced model", "a response (response.h5)")
    if importlib.util.find_spec("pyuff") is None:
        raise input_error(target.suffix, "", "needs the package pyuff", "pip install 'shroud[uff]', or a .mat file")
    import pyuff

    sets = list(_sets(source))
    with target.open("w", encoding="ascii"):
        pass  # pyuff ignores a folder that does not exist
    pyuff.UFF(str(target)).write_sets(sets, mode="overwrite")
    return f"{len(sets)} response function{'s' if len(sets) != 1 else ''}, data set 58, m/N over Hz"


def _sets(source: Path) -> Iterator[dict[str, Any]]:
    import pyuff

    for name, datasets, attributes in curves(source):
        force = float(attributes["excitation.force"])
        if len(datasets["frequency_hz"]) < 2:
            continue  # no function
        for harmonic in range(1, datasets["output"].shape[1]):
            yield pyuff.prepare_58(
                func_type=RESPONSE_FUNCTION,
                rsp_node=1,
                rsp_dir=SCALAR,
                ref_node=1,
                ref_dir=SCALAR,
                rsp_ent_name="tip",
                ref_ent_name="force",
                load_case_id=0,
                ver_num=harmonic,
                id1=f"curve {name}, harmonic {harmonic}"[:80],
                id2=_parameters(attributes)[:80],
                id3="NONE",
                id4="displacement of the harmonic over the force",
                id5="NONE",
                data=np.asarray(datasets["output"][:, harmonic]) / force,
                x=np.asarray(datasets["frequency_hz"]),
                abscissa_spacing=0,
                abscissa_spec_data_type=FREQUENCY,
                ordinate_spec_data_type=DISPLACEMENT,
                orddenom_spec_data_type=FORCE,
                abscissa_axis_units_lab="Hz",
                ordinate_axis_units_lab="m",
                orddenom_axis_units_lab="N",
                binary=0,
            )


def _parameters(attributes: dict[str, Any]) -> str:
    """The parameters in which curves usually differ."""
    known = {meaning.short: attributes.get(key) for key, meaning in MEANINGS.items() if meaning.short}
    return ", ".join(f"{short} {value:.6g}" for short, value in known.items() if isinstance(value, int | float))


_SUFFIXES = (".mat", ".uff", ".unv", ".vtu", ".pvd", ".op4", ".mtx")
_ON_MESH = (".vtu", ".pvd")


def export(
    source: Path,
    target: Path,
    sector_file: Path | None = None,
    file_format: str | None = None,
    choice: MotionChoice | None = None,
) -> str:
    """Export a response or a reduced model; returns a summary in words.

    The target is replaced in one step, or left as it is.
    """

    suffix, choice = target.suffix.lower(), choice or MotionChoice()
    note = ""
    matrices = matrix_format(target, file_format)
    if source.is_dir() and suffix in _SUFFIXES:
        of_model = bool(matrices) or suffix in _ON_MESH
        source, sector_file, choice, note = _in_folder(source, sector_file, choice, of_model)
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
        summary = _writers(source, matrices, files, (sector_file, choice, target.stem))[suffix](beside)
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
    source: Path, matrices: str | None, files: list[Path], motion: tuple[Path | None, MotionChoice, str]
) -> dict[str, Callable[[Path], str]]:
    """What writes each suffix; matrices in a format of their own, and animations, add the files written to `files`.

    `motion`: file of the mesh, what is asked for, name of the target.
    """
    sector_file, choice, stem = motion

    def write_frames(path: Path) -> str:
        said, written = write_ring(mesh_motion(source, sector_file, choice), choice, path, stem)
        files.extend(written)
        return said

    def write_them(path: Path) -> str:
        said, written = write_matrix_files(source, path, str(matrices))
        files.extend(written)
        return said

    return {
        ".mat": lambda path: write_matlab(source, path) if matrices is None else write_them(path),
        ".uff": lambda path: write_universal(source, path),
        ".unv": lambda path: write_universal(source, path),
        ".vtu": lambda path: write_motion(mesh_motion(source, sector_file, choice), path),
        ".pvd": write_frames,
        ".op4": write_them,
        ".mtx": write_them,
    }


def _in_folder(
    folder: Path, sector_file: Path | None, choice: MotionChoice, of_model: bool
) -> tuple[Path, Path | None, MotionChoice, str]:
    """The file of a run to export, the mesh of its model, the wave and the curves of its scene, and a remark."""
    from pipeline.results.run_folder import models_of_run, read_run_summary, response_of_run

    if not of_model:
        return response_of_run(folder), sector_file, choice, ""
    models = models_of_run(folder)
    first, which = models[0], f"; the first of {len(models)} models, {models[0].entry['rom']}" * (len(models) > 1)
    if (number := choice.curve) is not None:
        choice = replace(choice, response=response_of_run(folder))
        curves = read_run_summary(folder)["curves"] or []
        if not 0 <= number < len(curves):
            raise input_error("--curve", "", str(number), f"0 to {len(curves) - 1}")
        own = [model for model in models if model.entry["rom"] == curves[number]["rom"]]
        first, which = own[0] if own else first, ""
    if choice.engine_order is None:
        orders = [int(order) for order in first.entry.get("stuck_hz", {})]
        choice = replace(choice, engine_order=orders[0] if orders else None)
    return first.rom, sector_file or first.mesh, choice, which


def _remove(path: Path) -> None:
    """Remove a file if possible."""
    try:
        path.unlink(missing_ok=True)
    except OSError:
        return
