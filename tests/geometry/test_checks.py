"""Bad parameters are refused before anything is built, in one line that says what would do."""

import pickle
import re
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from geometry_support import FIGURE, SLENDER, figure_shroud, jacobians, mid_radius, slender_shroud, volume
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from geometry import BladeParameters, GeometryError, MeshParameters, ShroudParameters, build_sector
from geometry.blade.checks import check_parameters
from geometry.quality import hexahedron_scaled_jacobian

GOOD = {"blade": SLENDER, "shroud": slender_shroud(70.0), "mesh": MeshParameters(0.004)}
NAN, INF = float("nan"), float("inf")


def check(parts):
    check_parameters(parts["blade"], parts["shroud"], parts["mesh"])


def changed(table, parameter, value):
    return GOOD | {table: replace(GOOD[table], **{parameter: value})}


BAD = [
    *(
        ("blade", name, bad)
        for name in ("hub_radius", "length", "chord", "thickness")
        for bad in (0.0, -1.0, NAN, INF, "1", None, True)
    ),
    *(("blade", "tip_thickness", bad) for bad in (0.0, -1e-3, NAN, 0.5)),
    *(("blade", "n_blades", bad) for bad in (0, 2, -72, 72.0, "72", True, 10**6)),
    *(("blade", "twist", bad) for bad in (NAN, 90.0, -400.0, "25")),
    *(("blade", "root_stagger", bad) for bad in (NAN, 81.0, -INF, "25", None)),
    *(("blade", "section", bad) for bad in ("circle", "", None, 3)),
    ("blade", "thickness", 0.030),  # more than the pitch at the hub
    ("blade", "chord", 0.080),
    *(
        ("shroud", name, bad)
        for name in ("thickness", "axial_width", "contact_length")
        for bad in (0.0, -1.0, NAN, INF, "x")
    ),
    *(("shroud", "angle", bad) for bad in (0.0, -10.0, 180.5, NAN, INF, "70")),
    *(("shroud", "gap", bad) for bad in (-1e-6, 0.03, NAN, None)),
    *(("shroud", "edge_angle", bad) for bad in (NAN, 76.0, -INF, "axial", None)),
    *((table, "fillet_radius", bad) for table in ("blade", "shroud") for bad in (-1e-3, 1e-9, 0.08, NAN, "1", None)),
    *(("blade", "camber", bad) for bad in (NAN, 91.0, -INF, "30", None)),
    ("shroud", "thickness", 0.15),
    *(("mesh", "size", bad) for bad in (0.0, -1.0, NAN, INF, 0.5, 1e-7, "fine")),
    *(("mesh", "contact_grid", bad) for bad in ((3,), (3, 3, 3), 9, "33", None)),
    *(("mesh", "grading", bad) for bad in (0.0, 0.99, 101.0, -2.0, NAN, INF, "fine", None)),
]


@pytest.mark.parametrize(("table", "parameter", "value"), BAD, ids=str)
def test_bad_values_are_named(table, parameter, value):
    with pytest.raises(GeometryError) as caught:
        check(changed(table, parameter, value))
    error = caught.value
    assert (error.table, error.parameter) == (table, parameter)
    assert error.value is value or error.value == value
    message = str(error)
    assert message == f"{table}.{parameter} = {value!r}: {error.allowed}"
    assert "\n" not in message
    assert len(error.allowed) > 10


@pytest.mark.parametrize("grid", [(0, 3), (3, -1), (3, 2.0), (True, 3), (3, 1000), (3, "3")])
def test_bad_grid_counts_are_named(grid):
    with pytest.raises(GeometryError, match=r"mesh\.contact_grid = .*integer from 1 to"):
        check(changed("mesh", "contact_grid", grid))


def test_numpy_numbers_and_lists_are_welcome():
    blade = replace(SLENDER, n_blades=np.int64(72), chord=np.float64(0.034))
    check_parameters(blade, GOOD["shroud"], MeshParameters(np.float32(0.004), [3, 3]))
    assert build_sector(blade, GOOD["shroud"], MeshParameters(0.005, [2, 2])).right.area.shape == (4,)


@pytest.mark.parametrize("camber", [5e-324, -1e-12, 2e-3])
def test_a_camber_of_next_to_nothing_is_a_straight_section(camber):
    straight = build_sector(*GOOD.values())
    bent = build_sector(replace(SLENDER, camber=camber), GOOD["shroud"], GOOD["mesh"])
    assert volume(bent) == pytest.approx(volume(straight), rel=1e-5)
    assert hexahedron_scaled_jacobian(bent.points, bent.hexahedra).min() > 0.4


def test_error_survives_a_process_boundary():
    error = GeometryError("shroud", "angle", 90.0, "does not fit")
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "shroud.angle = 90.0: does not fit"
    assert again.parameter == "angle"
    assert isinstance(again, ValueError)


def notch_clearance(blade, shroud):
    """Left between notch and an axial rectangular airfoil: half of pitch less rise less thickness."""
    rise = shroud.contact_length * np.sin(np.radians(shroud.angle))
    return np.pi * mid_radius(blade, shroud) / blade.n_blades - rise / 2 - blade.thickness / 2


@pytest.mark.parametrize("angle", [40.0, 90.0, 150.0])
def test_notch_that_cuts_the_airfoil_is_refused_with_the_nearest_that_fits(angle):
    """The rule can be solved by hand: contact_length sin(alpha) / 2 + thickness / 2 < pitch / 2."""
    shroud = figure_shroud(angle, contact_length=0.032)
    assert notch_clearance(FIGURE, shroud) < 0
    with pytest.raises(GeometryError, match=r"shroud\.angle.*notch.*airfoil") as caught:
        check_parameters(FIGURE, shroud, MeshParameters(0.004))
    nearest = float(re.search(r"angle that fits is ([\d.]+)", caught.value.allowed)[1])
    longest = float(re.search(r"contact_length at most ([\d.e-]+)", caught.value.allowed)[1])
    for fitting in (replace(shroud, angle=nearest), replace(shroud, contact_length=longest)):
        mesh = build_sector(FIGURE, fitting, MeshParameters(0.004))
        assert hexahedron_scaled_jacobian(mesh.points, mesh.hexahedra).min() > 0.15
        assert 0 < notch_clearance(FIGURE, fitting) < 0.0012
    # the suggestions are the nearest ones: a little further is refused again
    beyond = nearest + (0.2 if nearest < angle else -0.2)
    for refused in (replace(shroud, angle=beyond), replace(shroud, contact_length=longest + 2e-5)):
        with pytest.raises(GeometryError):
            check_parameters(FIGURE, refused, MeshParameters(0.004))


def test_contact_longer_than_the_platform_is_refused_with_the_nearest_that_fits():
    shroud = slender_shroud(30.0, contact_length=0.050)  # 50 cos 30 = 43 mm of 40 mm; the rise still fits the pitch
    with pytest.raises(GeometryError, match=r"contact_length \|cos\(angle\)\|") as caught:
        check_parameters(replace(SLENDER, twist=0.0, chord=0.01), shroud, MeshParameters(0.004))
    nearest = float(re.search(r"angle that fits is ([\d.]+)", caught.value.allowed)[1])
    assert 0.050 * np.cos(np.radians(nearest)) < 0.040
    longest = float(re.search(r"contact_length at most ([\d.e-]+)", caught.value.allowed)[1])
    assert 0.035 < longest * np.cos(np.radians(30)) < 0.040


@pytest.mark.parametrize("twist", [0.0, 30.0, -60.0])
def test_airfoil_larger_than_the_platform_is_refused_with_the_longest_chord(twist):
    blade, shroud = replace(SLENDER, twist=twist, chord=0.060), slender_shroud(180.0, edge_angle=0.0)
    with pytest.raises(GeometryError, match=r"blade\.chord = 0\.06: .*at most") as caught:
        check_parameters(blade, shroud, MeshParameters(0.004))
    longest = float(re.search(r"at most ([\d.e-]+)", caught.value.allowed)[1])
    # a rectangle's corners reach this far along x and along the circumference
    c, s = np.cos(np.radians(twist)), abs(np.sin(np.radians(twist)))
    pitch = 2 * np.pi * 0.4475 / 72
    by_hand = min((0.040 - 0.004 * s) / c, (pitch - 0.004 * c) / max(s, 1e-9))
    assert 0.94 * by_hand < longest < by_hand
    check_parameters(replace(blade, chord=longest), shroud, MeshParameters(0.004))


def test_airfoil_thicker_than_the_pitch_at_the_shroud_is_refused():
    with pytest.raises(GeometryError, match=r"blade\.tip_thickness = 0\.05: .*at most"):
        check_parameters(
            replace(FIGURE, chord=0.052, tip_thickness=0.050), figure_shroud(180.0), MeshParameters(0.004)
        )


@pytest.mark.parametrize("angle", range(30, 181, 5))
@pytest.mark.parametrize(("blade", "shroud"), [(FIGURE, figure_shroud(30.0)), (SLENDER, slender_shroud(30.0))])
def test_every_angle_from_30_to_180_is_accepted(blade, shroud, angle):
    assert check_parameters(blade, replace(shroud, angle=float(angle)), MeshParameters(0.004)) is None


BLADES = st.builds(
    BladeParameters,
    n_blades=st.integers(40, 150),
    hub_radius=st.just(0.4),
    length=st.floats(0.06, 0.3),
    chord=st.floats(0.010, 0.060),
    thickness=st.floats(0.002, 0.010),
    tip_thickness=st.one_of(st.none(), st.floats(0.002, 0.008)),
    twist=st.floats(-45.0, 45.0),
    section=st.sampled_from(["rectangle", "lens"]),
)
SHROUDS = st.builds(
    ShroudParameters,
    angle=st.floats(5.0, 180.0),
    thickness=st.floats(0.003, 0.010),
    axial_width=st.floats(0.020, 0.070),
    contact_length=st.floats(0.004, 0.040),
    gap=st.sampled_from([0.0, 1e-4]),
)
MESHES = st.builds(
    MeshParameters,
    size=st.floats(0.002, 0.008),
    contact_grid=st.tuples(st.integers(1, 5), st.integers(1, 5)),
    grading=st.floats(1.0, 20.0),
)


def refusal_of(function, *parameters):
    try:
        function(*parameters)
    except GeometryError as error:
        return str(error)
    return None


@settings(max_examples=8, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(blade=BLADES, shroud=SHROUDS, mesh=MESHES)
# Whether named values mesh is tested in test_random_blades.py.
@patch("geometry.blade.checks._meshes", lambda *_: True)
def test_what_passes_the_check_builds_and_what_does_not_is_refused_alike(blade, shroud, mesh):
    refusal = refusal_of(check_parameters, blade, shroud, mesh)
    if refusal:
        assert refusal_of(build_sector, blade, shroud, mesh) == refusal
        return
    sector = build_sector(blade, shroud, mesh)
    assert jacobians(sector, [-1.0, 0.0, 1.0]).min() > 0
    assert len(sector.right.nodes) == mesh.contact_grid[0] * mesh.contact_grid[1]
    assert len(sector.node_sets["tip"]) == 1
