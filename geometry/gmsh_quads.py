"""Quadrilaterals by gmsh."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from geometry.gmsh_start import start_gmsh
from geometry.layout import Layout, MeshingError, Patch
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
