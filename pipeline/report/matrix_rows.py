"""Rows of the report about a model made of the matrices of another program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.report.load_rows import load_rows
from pipeline.scene.labels import value_label
from pipeline.scene.schema import Scene
from pipeline.stages.model_chain import BuiltModel

if TYPE_CHECKING:
    from rom import ReducedModel


def matrix_rows(scene: Scene) -> list[tuple[str, str]]:
    """The files and what is said of them."""
    model = scene.model
    assert model is not None
    axis = model.axis if isinstance(model.axis, str) else ", ".join(f"{value:g}" for value in model.axis)
    return [
        ("blades of the ring", str(model.n_blades)),
        *((name, Path(file).name) for name, file in model.files.items()),
        ("unit, engine axis in the files", f"{model.unit}, {axis}"),
        ("speed that the stiffness holds at", f"{model.speed_rpm:g} rev/min"),
        ("speed", f"{scene.load.speed_rpm:g} rev/min"),
    ]


def model_rows(model: BuiltModel) -> list[tuple[str, str]]:
    """Sizes of the reduced model and what was found in the files."""
    facts = model.facts
    modes = "of the superelement" if facts["modes"] is None else str(facts["modes"])
    return [
        ("degrees of freedom", str(facts["dofs"])),
        *(("found in the files", line) for line in facts.get("notes", ())),
        ("reduced degrees of freedom", str(facts["reduced_dofs"])),
        ("fixed-interface modes", modes),
    ]


def nodal_contact_rows(reduced: ReducedModel, scene: Scene) -> list[tuple[str, str]]:
    """The contact nodes, their law and the excitation."""
    contact = scene.contact
    stiffness = [
        value_label(f"contact.{name}_stiffness", getattr(contact, f"{name}_stiffness"))
        for name in ("normal", "tangential")
    ]
    area = 0.0 if reduced.contact_area is None else float(reduced.contact_area.sum())
    return [
        ("contact nodes", f"{reduced.n_contacts} pairs of nodes"),
        ("area of a face", f"{1e6 * area:.3g} mm²"),
        ("stiffness of the whole face", ", ".join(stiffness)),
        ("interference", value_label("contact.interference", contact.interference)),
        *load_rows(scene),
    ]
