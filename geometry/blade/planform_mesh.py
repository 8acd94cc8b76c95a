"""Quadrilateral mesh of a whole planform: two upper halves by gmsh, the second one rotated by 180 degrees.

Without camber the two halves are the same mesh.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geometry.blade.layouts import Layout, MeshingError, Patch, grid_fractions, half_layouts
from geometry.blade.planform import Planform
from geometry.blade.section import straight_edged_half_thickness
from geometry.gmsh_start import start_gmsh
from geometry.quality import quadrilateral_scaled_jacobian
from geometry.sector import FloatArray, IntArray

# Reproducible meshes: no threads, a fixed seed, no configuration files.
OPTIONS = {
    "General.Terminal": 0,
    "General.Verbosity": 0,
    "General.NumThreads": 1,
    "Mesh.MaxNumThreads1D": 1,
    "Mesh.MaxNumThreads2D": 1,
    "Mesh.RandomSeed": 1,
    "Mesh.RandomFactor": 1e-9,
    "Mesh.ElementOrder": 1,
    "Mesh.MeshSizeMin": 0,
    "Mesh.MeshSizeFactor": 1,
    "Mesh.SubdivisionAlgorithm": 0,
    "Mesh.Algorithm": 8,  # Frontal-Delaunay for quads
}
# blossom with full-quad subdivision leaves no triangle; patches in rows must not be smoothed
FREE_OPTIONS = OPTIONS | {"Mesh.RecombinationAlgorithm": 3, "Mesh.Smoothing": 5}
ROW_OPTIONS = OPTIONS | {"Mesh.RecombinationAlgorithm": 0, "Mesh.Smoothing": 0}
GOOD_QUALITY = 0.4  # scaled Jacobian above which a mesh in rows is accepted and no unstructured one is tried
FAIR_QUALITY = 0.2  # scaled Jacobian above which no finer mesh is tried
ANY_QUALITY = 0.0
# Size over that of the elements, quality that is enough, whether only the unstructured layout is tried.
TRIES = (
    (1.0, GOOD_QUALITY, False),
    *((fineness, FAIR_QUALITY, True) for fineness in (2.0, 3.0, 4.0, 6.0)),
    *((fineness, ANY_QUALITY, False) for fineness in (1.4, 1.2, 0.8, 1.7, 2.5, 5.0)),
)


@contextmanager
def _session(options: dict[str, float]) -> Iterator[Any]:
    """A new gmsh model, in the gmsh session of the caller if there is one, whose options are restored."""
    import gmsh

    ours = not gmsh.isInitialized()
    if ours:
        start_gmsh(gmsh)
        _restore_signals()
    before = "" if ours else gmsh.model.getCurrent()
    saved = {name: gmsh.option.getNumber(name) for name in options}
    try:
        for name, value in options.items():
            gmsh.option.setNumber(name, value)
        gmsh.model.add("shroud planform")
        yield gmsh
    except MeshingError:
        raise
    except Exception as error:  # the gmsh API raises bare Exception
        raise MeshingError(f"gmsh: {error}") from error
    finally:
        if ours:
            gmsh.finalize()
        else:
            gmsh.model.remove()
            for name, value in saved.items():
                gmsh.option.setNumber(name, value)
            gmsh.model.setCurrent(before)


def _restore_signals() -> None:
    """gmsh resets the handlers of these signals; a write to a closed pipe would end the process."""
    if threading.current_thread() is not threading.main_thread():
        return  # Python sets handlers in the main thread only
    for number in (signal.SIGPIPE, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        handler = signal.getsignal(number)
        if handler not in (None, signal.SIG_DFL):
            signal.signal(number, handler)


@dataclass(frozen=True)
class QuadMesh:
    """Points (n, 2), the quadrilaterals (q, 4) of each patch, and each curve's nodes (k,) from start to end."""

    points: FloatArray
    quads: tuple[IntArray, ...]
    curve_nodes: dict[tuple[str, str], IntArray]

    def along(self, names: tuple[str, ...]) -> IntArray:
        """Nodes along a path of point names, ends included."""
        parts: list[IntArray] = []
        for a, b in pairwise(names):
            nodes = self.curve_nodes[a, b] if (a, b) in self.curve_nodes else self.curve_nodes[b, a][::-1]
            parts.append(nodes if not parts else nodes[1:])
        return np.concatenate(parts)


def mesh_layout(layout: Layout, size: float) -> QuadMesh:
    """Mesh every patch of ``layout`` with quadrilaterals, counterclockwise, of about ``size`` (m) where it is free.

    Raises ``MeshingError`` where gmsh does not succeed.
    """
    options = (FREE_OPTIONS if layout.free else ROW_OPTIONS) | {"Mesh.MeshSizeMax": size}
    with _session(options) as gmsh:
        corners = {name: gmsh.model.geo.addPoint(*xy, 0.0) for name, xy in layout.points.items()}
        curves = _add_curves(gmsh, layout, corners)
        surfaces = [_add_surface(gmsh, patch, curves) for patch in layout.patches]
        gmsh.model.geo.synchronize()
        mesh = gmsh.model.mesh
        for ends, curve in layout.curves.items():
            mesh.setTransfiniteCurve(curves[ends], len(curve.fractions))
        for patch, surface in zip(layout.patches, surfaces, strict=True):
            if patch.corners:
                mesh.setTransfiniteSurface(surface, cornerTags=[corners[name] for name in patch.corners])
            mesh.setRecombine(2, surface)
        mesh.generate(1)
        _place_curve_nodes(gmsh, layout, curves)
        mesh.generate(2)
        return _collect(gmsh, corners, curves, surfaces)


def _add_curves(gmsh: Any, layout: Layout, corners: dict[str, int]) -> dict[tuple[str, str], int]:
    geo = gmsh.model.geo
    tags = {}
    for (start, end), curve in layout.curves.items():
        inner = [geo.addPoint(*xy, 0.0) for xy in curve.through]
        add = geo.addSpline if inner else geo.addLine
        ends = corners[start], corners[end]
        tags[start, end] = add([ends[0], *inner, ends[1]]) if inner else add(*ends)
    return tags


def _add_surface(gmsh: Any, patch: Patch, curves: dict[tuple[str, str], int]) -> int:
    pairs = zip(patch.loop, patch.loop[1:] + patch.loop[:1], strict=True)
    loop = [curves[a, b] if (a, b) in curves else -curves[b, a] for a, b in pairs]
    return gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop(loop)])


def _place_curve_nodes(gmsh: Any, layout: Layout, curves: dict[tuple[str, str], int]) -> None:
    """Move the nodes of straight curves, which gmsh puts at equal steps, to their fractions."""
    mesh = gmsh.model.mesh
    for (start, end), curve in layout.curves.items():
        if len(curve.through) or len(curve.fractions) < 3:
            continue
        a, b = layout.points[start], layout.points[end]
        nodes, _, at = mesh.getNodes(1, curves[start, end])
        for node, fraction in zip(nodes[np.argsort(at)], curve.fractions[1:-1], strict=True):
            mesh.setNode(node, [*(a + fraction * (b - a)), 0.0], [fraction])


def _collect(gmsh: Any, corners: dict[str, int], curves: dict[tuple[str, str], int], surfaces: list[int]) -> QuadMesh:
    mesh = gmsh.model.mesh
    # only nodes of quadrilaterals: the inner points of a spline leave unused nodes
    tables = []
    for surface in surfaces:
        types, _, nodes = mesh.getElements(2, surface)
        if list(types) != [3]:
            raise MeshingError("gmsh left triangles among the quadrilaterals")
        tables.append(nodes[0].astype(np.int64).reshape(-1, 4))
    used = np.unique(np.concatenate([table.ravel() for table in tables]))
    tags, xyz, _ = mesh.getNodes()
    order = np.argsort(tags)
    points = xyz.reshape(-1, 3)[order[np.searchsorted(tags[order], used)], :2]

    def ends(name: str) -> IntArray:
        return mesh.getNodes(0, corners[name])[0].astype(np.int64)

    curve_nodes = {}
    for (start, end), tag in curves.items():
        inner, _, at = mesh.getNodes(1, tag)
        path = np.concatenate([ends(start), inner[np.argsort(at)].astype(np.int64), ends(end)])
        curve_nodes[start, end] = np.searchsorted(used, path)
    return QuadMesh(points, tuple(np.searchsorted(used, table) for table in tables), curve_nodes)


Half = tuple[Layout, QuadMesh]


@dataclass(frozen=True)
class PlanformMesh:
    """A mesh that without camber is its own image, bit for bit, under (x, s) -> (-x, -s)."""

    points: FloatArray  # (n, 2), nodes, m
    quads: IntArray  # (q, 4), quadrilaterals, counterclockwise
    airfoil: NDArray[np.bool_]  # (q,), which quadrilaterals belong to the section of the airfoil
    # `right`, `left`: (n_t1,), contact nodes of the two sides along +x, opposite each other
    right: IntArray
    left: IntArray
    # `right_face`, `left_face`: (k,), all nodes on the contact segments
    right_face: IntArray
    left_face: IntArray
    origin: int  # the node at (0, 0), with camber the nearest to it
    # (k,), places of the nodes on the upper and on the lower flank of the airfoil along the section, ascending, m
    flanks: tuple[FloatArray, FloatArray]
    foot: IntArray  # (f,), nodes of the airfoil, ascending
    strip: FloatArray  # (f, 2), their places along and across the camber line, m

    @property
    def border(self) -> IntArray:
        """Nodes (b,) on the outline of the platform."""
        edges = np.concatenate([self.quads[:, [k, (k + 1) % 4]] for k in range(4)])
        edges, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
        return np.unique(edges[count == 1])


def mesh_planform(plan: Planform, size: float, contact_nodes: int) -> PlanformMesh:
    """Mesh with elements of about ``size`` (m) and ``contact_nodes`` grid nodes on each contact segment.

    Raises ``MeshingError`` where no layout gives a valid mesh.
    """
    (layout, upper), (other_layout, lower) = _best_halves(plan, size, contact_nodes)
    cut, other_cut = upper.along(layout.cut), lower.along(other_layout.cut)
    contact, other_contact = (half.along(("CB", "CT")) for half in (upper, lower))
    points = _exact_points(plan, layout, upper)
    others = points.copy() if lower is upper else _exact_points(plan.turned, other_layout, lower)
    joint = (points[cut] - others[other_cut][::-1]) / 2
    if plan.section.camber:
        airfoil = np.isin(cut, upper.along(_between_ends(layout.cut)))
        along = plan.unplace(joint[airfoil])[:, 0]
        joint[airfoil] = plan.place(np.stack([along, 0 * along], axis=-1))
    points[cut], others[other_cut] = joint, -joint[::-1]

    # the lower half rotated by 180 degrees; the nodes on the cut exist already
    n = len(points)
    inner = np.setdiff1d(np.arange(len(others)), other_cut)
    turned = np.empty(len(others), dtype=np.int64)
    turned[other_cut] = cut[::-1]
    turned[inner] = n + np.arange(len(inner))
    in_airfoil = [
        np.full(len(quads), patch.airfoil)
        for half in (upper, lower)
        for quads, patch in zip(half.quads, layout.patches, strict=True)
    ]
    fractions = layout.curves["CB", "CT"].fractions
    grid = np.array([np.argmin(np.abs(fractions - f)) for f in grid_fractions(contact_nodes)])
    left_face = turned[other_contact][::-1]
    everything = np.vstack([points, -others[inner]])
    quads, airfoil = np.vstack([*upper.quads, turned[np.vstack(lower.quads)]]), np.concatenate(in_airfoil)
    foot = np.unique(quads[airfoil])
    return PlanformMesh(
        points=everything,
        quads=quads,
        airfoil=airfoil,
        right=contact[grid],
        left=left_face[grid],
        right_face=contact,
        left_face=left_face,
        origin=int(np.argmin(np.hypot(*everything.T))),
        flanks=(
            plan.unplace(points[upper.along(layout.flank)])[:, 0],
            -plan.turned.unplace(others[lower.along(layout.flank)])[::-1, 0],
        ),
        foot=foot,
        strip=plan.unplace(everything[foot]),
    )


def _between_ends(cut: tuple[str, ...]) -> tuple[str, ...]:
    """The part of the cut in the airfoil, from leading to trailing edge."""
    return cut[cut.index("LE") : cut.index("TE") + 1]


def _best_halves(plan: Planform, size: float, contact_nodes: int) -> tuple[Half, Half]:
    """The layout and mesh whose worst element is best: upper half, and that of the planform rotated by 180 degrees.

    Layouts are tried until one is good enough: first meshes in rows, then an unstructured one of the same size, then
    finer ones for features much smaller than the size; where none is valid, all layouts with other sizes.
    """
    best: tuple[float, Half, Half] | None = None
    tried, highest = 0, -1.0
    for fineness, wanted, free_only in TRIES:
        if best is not None and best[0] > wanted:
            continue
        layouts = half_layouts(plan, size / fineness, contact_nodes)
        others = half_layouts(plan.turned, size / fineness, contact_nodes) if plan.section.camber else layouts
        for layout, other in zip(layouts, others, strict=True):
            enough = best is not None and best[0] > wanted
            if (free_only and not layout.free) or (enough and (layout.free or wanted == ANY_QUALITY)):
                continue
            tried += 1
            try:
                upper = mesh_layout(layout, size / fineness)
                lower = upper if other is layout else mesh_layout(other, size / fineness)
            except MeshingError:
                continue
            quality = min(
                float(quadrilateral_scaled_jacobian(half.points, np.vstack(half.quads)).min())
                for half in (upper, lower)
            )
            highest = max(highest, quality)
            if quality > 0 and (best is None or quality > best[0]):
                best = quality, (layout, upper), (other, lower)
    if best is None:
        raise MeshingError(f"{tried} layouts tried, worst scaled Jacobian {highest:.2g} at best")
    return best[1], best[2]


def _exact_points(plan: Planform, layout: Layout, half: QuadMesh) -> FloatArray:
    """The points of the half with exact positions on contact segment and flank."""
    points = half.points.copy()
    _, start, end, _ = plan.right_profile()
    points[half.along(("CB", "CT"))] = start + layout.curves["CB", "CT"].fractions[:, None] * (end - start)
    flank = half.along(layout.flank)
    along = plan.unplace(points[flank])[:, 0]
    across = straight_edged_half_thickness(plan.section, along)
    points[flank] = plan.place(np.stack([along, across], axis=-1))
    return points
