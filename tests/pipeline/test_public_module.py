"""`import shroud`: the public names, at no cost, and what is said where another module has the name of a package."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from pipeline_support import shroud as command

import pipeline
import shroud

REPOSITORY = Path(__file__).parents[2]


def python(code: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """A script in a folder; the program is found, as where it is installed, after the folder of the script."""
    (cwd / "script.py").write_text(code)
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
    asked = [sys.executable, "script.py"]
    return subprocess.run(asked, cwd=cwd, env=environment, capture_output=True, text=True, check=False)


def test_it_has_the_public_names_of_the_pipeline_and_the_objects_behind() -> None:
    assert set(pipeline.__all__) < set(shroud.__all__)
    for name in shroud.__all__:
        assert getattr(shroud, name) is not None
        assert name in dir(shroud)
    assert shroud.run_scene is pipeline.run_scene
    assert shroud.Peak.__module__.startswith("nonlinear.")
    assert shroud.rom.Material.__name__ == "Material"
    with pytest.raises(AttributeError, match="'shroud' has no attribute 'solve'"):
        _ = shroud.solve


def test_the_import_costs_nothing(tmp_path: Path) -> None:
    found = python("import shroud, sys; print(*sys.modules)", tmp_path)
    assert found.returncode == 0, found.stderr
    loaded = {name.partition(".")[0] for name in found.stdout.split()}
    assert "pipeline" in loaded
    assert not loaded & {"numpy", "scipy", "h5py", "pydantic", "typer", "numba", "matplotlib", "geometry", "rom"}


@pytest.mark.parametrize("name", ["geometry", "rom", "nonlinear", "pipeline"])
@pytest.mark.parametrize("before", ["", "import {name}; "])
def test_a_file_of_ones_own_with_the_name_of_a_package(tmp_path: Path, name: str, before: str) -> None:
    (tmp_path / f"{name}.py").write_text("LENGTH = 0.15\n")
    found = python(before.format(name=name) + "import shroud", tmp_path)
    last = found.stderr.splitlines()[-1]
    assert last == (
        f"shroud.PackageNameError: {tmp_path / name}.py: has the name of the package {name} of shroud; rename it"
    )


def test_a_folder_of_ones_own_with_the_name_of_a_package(tmp_path: Path) -> None:
    (tmp_path / "rom").mkdir()  # of results, say: no package
    assert python("import shroud; print(shroud.rom.Material)", tmp_path).returncode == 0
    (tmp_path / "rom" / "__init__.py").write_text("")
    last = python("import shroud", tmp_path).stderr.splitlines()[-1]
    assert last.startswith(f"shroud.PackageNameError: {tmp_path / 'rom'}: ")


def test_the_version() -> None:
    assert command("--version") == (0, f"shroud {shroud.__version__}\n", "")
    assert command("--version", "--version")[0] == 0
