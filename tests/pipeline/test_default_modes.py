"""The default number of fixed-interface modes: what it leaves on the blade of the default scene."""

from pathlib import Path

import pytest

from geometry import build_sector
from pipeline.scene.elastic_material import elastic_material
from pipeline.scene.geometry_parameters import geometry_parameters
from pipeline.scene.presets import PRESETS
from pipeline.scene.reading import read_scene
from pipeline.scene.response_section import DEFAULT_MODES
from pipeline.stages.model.build_reduced_model import boundary_choice
from pipeline.stages.scene_to_solver import linear_operation
from rom import ReductionOptions, assemble, reduce_sector
from rom.reduction.mode_selection import reduction_errors

SCENES = Path(__file__).parents[2] / "scenes"
COARSE = 0.008  # m: the modes left out hardly depend on the mesh
RECEPTANCE = 2e-3


def test_it_leaves_little_of_a_receptance() -> None:
    """Free, sliding and stuck, resonances included."""
    scene = read_scene(SCENES / "dummy.toml").first
    assert scene.mesh is not None
    assert scene.material is not None
    scene = scene.model_copy(update={"mesh": scene.mesh.model_copy(update={"size": COARSE})})
    sector = build_sector(**geometry_parameters(scene))
    material = elastic_material(scene.material.properties)
    full = assemble(sector, material, scene.mesh.element)
    options = ReductionOptions(DEFAULT_MODES, store_basis=False)
    made = reduce_sector(full, sector, options, boundary_choice(scene, sector, material), augment=True)
    assert made.augmented is not None
    errors = reduction_errors(made.model, made.augmented, made.highest_mode_hz, linear_operation(scene, sector))
    assert errors is not None
    assert len(errors) == 3
    assert 0.0 < max(max(error.contact, error.output) for error in errors) < RECEPTANCE
    assert max(error.frequency for error in errors) < 1e-5


def test_one_default_in_both_packages() -> None:
    assert ReductionOptions().modes == DEFAULT_MODES


@pytest.mark.parametrize("path", sorted(SCENES.glob("*.toml")), ids=lambda path: path.stem)
def test_scenes_that_ship_have_no_fewer(path: Path) -> None:
    modes = read_scene(path).first.rom.fixed_interface_modes
    assert isinstance(modes, int)
    assert modes >= DEFAULT_MODES


def test_no_preset_but_the_draft_has_fewer() -> None:
    assert all(PRESETS[name].values["rom.modes"] >= DEFAULT_MODES for name in ("standard", "reference"))
