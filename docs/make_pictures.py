"""Make the pictures of README and pages again, and record what they were made from: `make pictures`.

    python docs/make_pictures.py               # those that are old; scenes run into out/pictures (minutes)
    python docs/make_pictures.py blade report  # these, old or not
    python docs/make_pictures.py --all         # all
    python docs/make_pictures.py --stale       # only list those that are old

The picture of the report needs a browser. A test fails where a picture is old (picture_record.py).
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from importlib import import_module
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

from docs.picture_record import (  # noqa: E402
    IMAGES,
    Maker,
    Picture,
    code_cells,
    read_record,
    record_of,
    stale,
    write_record,
)

OUT = ROOT / "out" / "pictures"
SCENES = ("dummy", "figure6", "campbell", "disk")
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
QUIET_BROWSER = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run")
STYLE, LINE = "pipeline/figures/style.py", "pipeline/figures/curve_line.py"
CURVES = (STYLE, LINE, "pipeline/figures/data.py", "pipeline/figures/response.py")
DUMMY, DISK, WEAR = "scenes/dummy.toml", "scenes/disk.toml", "scenes/wear.toml"
UNCERTAIN, FLOW = "docs/uncertainty.toml", "docs/flutter.toml"  # sections of the default blade
FLUTTER = "scenes/flutter.toml"
PAPER = tuple(f"scenes/figure{number}.toml" for number in (5, 6, 7))


def pictures() -> dict[str, Picture]:
    """All pictures of README and pages."""
    drawings, tutorials = "docs/drawings", "docs/tutorials"
    made = [
        Picture("blade", (drawings, DUMMY), _drawn("blade", "blade_figure")),
        Picture("contact_element", (drawings,), _drawn("contact_element", "element_figure")),
        Picture("architecture", (drawings,), _drawn("architecture", "architecture_figure")),
        Picture("frames", (drawings, DUMMY), _drawn("frames", "frames_figure")),
        Picture("damper", (f"{drawings}/damper.py", f"{drawings}/lines.py"), _drawn("damper", "damper_figure")),
        Picture("dummy_response", (DUMMY, *CURVES), _of_run("dummy", "figures/response.png")),
        Picture("dummy_peaks", (DUMMY, STYLE, "pipeline/figures/peaks.py"), _of_run("dummy", "figures/peaks.png")),
        Picture(
            "dummy_mode_1",
            (DUMMY, "pipeline/render/mode_shapes.py", "pipeline/render/ring.py"),
            _of_run("dummy", "renders/mode_1.png"),
        ),
        Picture("figure6", ("scenes/figure6.toml", *CURVES), _of_run("figure6", "figures/response.png")),
        Picture(
            "campbell",
            ("scenes/campbell.toml", STYLE, "pipeline/figures/campbell.py"),
            _of_run("campbell", "figures/campbell.png"),
        ),
        Picture(
            "nodal_diameters",
            (DUMMY, STYLE, "pipeline/figures/campbell.py"),
            _of_run("dummy", "figures/nodal_diameters.png"),
        ),
        Picture(
            "disk_nodal_diameters",
            (DISK, STYLE, "pipeline/figures/campbell.py", "rom/cyclic/mode_families.py"),
            _of_run("disk", "figures/nodal_diameters.png"),
        ),
        Picture(
            "disk_mode_1",
            (DISK, "pipeline/render/mode_shapes.py", "pipeline/render/ring.py", "pipeline/render/ring.py"),
            _of_run("disk", "renders/mode_1.png"),
        ),
        Picture(
            "backbone",
            (DUMMY, STYLE, "pipeline/studies/backbone/figure.py"),
            _of_straight_shrouds("backbone"),
        ),
        Picture(
            "backbone_response",
            (DUMMY, *CURVES, "pipeline/studies/backbone/figure.py"),
            _of_straight_shrouds("response"),
        ),
        Picture(
            "check_of_a_motion",
            (DUMMY, STYLE, "pipeline/check/check_run.py", "pipeline/check/check_point.py"),
            _check,
        ),
        Picture(
            "uncertainty",
            (DUMMY, UNCERTAIN, STYLE, "pipeline/studies/uncertainty/figure.py"),
            _of_default_blade(UNCERTAIN),
        ),
        Picture(
            "flutter",
            (DUMMY, FLOW, STYLE, "pipeline/figures/flutter.py", "rom/cyclic/natural_frequencies.py"),
            _of_default_blade(FLOW),
        ),
        Picture("bladed_disk", ("benchmarks/disk_effect.py", *PAPER, STYLE), _disk_effect),
        Picture("mistuning", (DUMMY, STYLE, "pipeline/studies/mistuning/figure.py"), _mistuning),
        Picture("wear", (WEAR, STYLE, "pipeline/studies/wear/figure.py", "nonlinear/wear"), _wear),
        Picture("limit_cycles", (FLUTTER, STYLE, "pipeline/studies/flutter/figure.py"), _limit_cycles),
        Picture("mistuned_disk", (DISK, STYLE, "pipeline/studies/mistuning/figure.py"), _mistuned_disk),
        Picture("report", (DUMMY, STYLE, "pipeline/report/templates", "pipeline/report/error_budget.py"), _report),
        *(
            Picture(
                f"explore_{name}",
                (DUMMY, "pipeline/explore/templates", "pipeline/explore/charts.py"),
                _explored(name),
            )
            for name in ("begin", "turned", "phone")
        ),
        Picture("first_blade_shrouds", (f"{tutorials}/first_blade.md",), _of_page("first_blade")),
        *(
            Picture(
                f"designing_a_shroud_{name}",
                (f"{tutorials}/designing_a_shroud.md", STYLE, *drawn),
                _of_page("designing_a_shroud"),
            )
            for name, drawn in (
                ("response", CURVES),
                ("optimum", ("pipeline/studies/optimum/figure.py",)),
                ("joint", ("pipeline/studies/optimum/figure.py",)),
                ("haigh", ("pipeline/stress/haigh.py",)),
            )
        ),
        Picture("first_blade_response", (f"{tutorials}/first_blade.md", STYLE, LINE), _of_page("first_blade")),
        *(
            Picture(f"damper_{name}", (f"{tutorials}/damper.md", STYLE, LINE), _of_page("damper"))
            for name in ("response", "performance")
        ),
        *(
            Picture(f"flutter_{name}", (f"{tutorials}/flutter.md", STYLE), _of_page("flutter"))
            for name in ("waves", "cycles", "in_time")
        ),
        Picture(
            "test_cell",
            (f"{tutorials}/test_cell.md", STYLE, "pipeline/studies/identify/figure.py"),
            _of_page("test_cell"),
        ),
        Picture("matrices_response", (f"{tutorials}/matrices.md",), _of_page("matrices")),
        Picture(
            "own_mesh_faces",
            (f"{tutorials}/own_mesh.md", "pipeline/new_scene/new_from_mesh.py"),
            _of_page("own_mesh"),
        ),
        Picture("own_mesh_response", (f"{tutorials}/own_mesh.md", STYLE, LINE), _of_page("own_mesh")),
        Picture("friction_map", (f"{tutorials}/friction_map.ipynb", f"{tutorials}/friction_map.toml"), _of_notebook),
    ]
    for study in ("whole", "mesh", "modes", "harmonics", "integration", "continuation"):
        made.append(Picture(f"bench_{study}", (f"benchmarks/measured/{study}.csv",), _of_table(study)))
    return {picture.name: picture for picture in made}


def _drawn(module: str, function: str) -> Maker:
    def make(path: Path) -> bool:
        draw = getattr(import_module(f"docs.drawings.{module}"), function)
        draw(ROOT / DUMMY).savefig(path, dpi=130)
        return True

    return make


def _disk_effect(path: Path) -> bool:
    """The curves of the benchmark, solved where they are not stored."""
    study = import_module("disk_effect")
    for figure in study.FIGURES:
        for disk in (False, True):
            study.results_of(figure, disk, OUT / study.NAME / f"{figure}_{disk}")
    study.draw(OUT / study.NAME, path)
    return True


def _of_run(scene: str, name: str) -> Maker:
    def make(path: Path) -> bool:
        _shroud("run", f"scenes/{scene}.toml", "--out", OUT / scene, "--quiet")
        shutil.copyfile(OUT / scene / name, path)
        return True

    return make


def _of_straight_shrouds(figure: str) -> Maker:
    """A figure of the default blade with straight shroud sides, with its nonlinear modes."""

    def make(path: Path) -> bool:
        from pipeline import run_scene

        scene = tomllib.loads((ROOT / DUMMY).read_text(encoding="utf-8"))
        scene["title"] = "Dummy blade, shroud angle 180°"
        scene["shroud"]["angle"] = 180.0
        scene["response"] |= {"harmonics": 5, "truncation": False, "search": "off"}
        scene["sweep"] = {"contact.interference": [-50e-6, 0.0, 5e-6]}
        scene["backbone"] = {}
        del scene["render"]
        run_scene(scene, OUT / "backbone")
        shutil.copyfile(OUT / "backbone" / "figures" / f"{figure}.png", path)
        return True

    return make


def _wear(path: Path) -> bool:
    _shroud("run", WEAR, "--out", OUT / "wear", "--until", "figures", "--quiet")
    shutil.copyfile(OUT / "wear" / "figures" / "wear.png", path)
    return True


def _limit_cycles(path: Path) -> bool:
    _shroud("run", FLUTTER, "--out", OUT / "flutter", "--until", "figures", "--quiet")
    shutil.copyfile(OUT / "flutter" / "figures" / "limit_cycles.png", path)
    return True


def _mistuning(path: Path) -> bool:
    """Rings of the default blade under engine order 6, with contacts that slip."""
    values = {"engine_order": 6, "interference": 5e-6, "frequency": [190.0, 290.0], "samples": 5}
    return _rings(DUMMY, path, **values)


def _mistuned_disk(path: Path) -> bool:
    """Rings of the blade on its disk under engine order 2: the disk carries the vibration around."""
    values = {"engine_order": 2, "interference": 5e-6, "frequency": [190.0, 230.0], "samples": 4}
    return _rings(DISK, path, **values)


def _rings(
    source: str, path: Path, engine_order: int, interference: float, frequency: list[float], samples: int
) -> bool:
    """Rings of the blade of a scene with one harmonic."""
    from pipeline import run_scene

    scene = tomllib.loads((ROOT / source).read_text(encoding="utf-8"))
    scene["excitation"]["engine_order"] = engine_order
    scene["contact"]["interference"] = interference
    quiet = {"truncation": False, "search": "off", "detached": False}
    scene["response"] |= {"frequency": frequency, "harmonics": 1, **quiet}
    scene["mistuning"] = {"samples": samples, "linear_samples": 100}
    del scene["render"], scene["sweep"]
    run_scene(scene, OUT / path.stem, until="figures", quiet=True)
    shutil.copyfile(OUT / path.stem / "figures" / "mistuning.png", path)
    return True


def _check(path: Path) -> bool:
    _shroud("check", DUMMY, "--out", OUT / "dummy", "--curve", "3", "--frequency", "452.5", "--quiet")
    newest = max((OUT / "dummy" / "check").glob("*.png"), key=lambda file: file.stat().st_mtime)
    shutil.copyfile(newest, path)
    return True


def _of_default_blade(sections: str) -> Maker:
    """The figure of the name of the picture, of the default blade with one interference and further sections."""

    def make(path: Path) -> bool:
        from pipeline import run_scene

        tables, others = (tomllib.loads((ROOT / name).read_text(encoding="utf-8")) for name in (DUMMY, sections))
        contact = {**tables["contact"], "interference": 20e-6}
        scene = {name: table for name, table in tables.items() if name not in ("sweep", "render")}
        run_scene({**scene, "contact": contact, **others}, OUT / path.stem, until="figures", quiet=True)
        shutil.copyfile(OUT / path.stem / "figures" / path.name, path)
        return True

    return make


def _report(path: Path) -> bool:
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        print(f"{path.name}: stays as it is, there is no browser ({', '.join(BROWSERS)})", file=sys.stderr)
        return False
    _shroud("report", DUMMY, "--out", OUT / "dummy", "--quiet")
    page = (OUT / "dummy" / "report.html").resolve().as_uri()
    look = (f"--user-data-dir={OUT / 'browser'}", "--window-size=1280,1500", "--virtual-time-budget=8000")
    subprocess.run([browser, *QUIET_BROWSER, *look, f"--screenshot={path}", page], check=True, capture_output=True)
    return True


def _explored(name: str) -> Maker:
    """The page of `shroud explore` as it opens, after turns of the interference, and on a phone."""

    def make(path: Path) -> bool:
        from pipeline.explore.start import page_server, serve_aside

        driven = import_module("browser")
        if driven.CHROMIUM is None:
            print(f"{path.name}: stays as it is, there is no browser ({', '.join(BROWSERS)})", file=sys.stderr)
            return False
        with page_server(ROOT / DUMMY, OUT / "explore") as (server, _), driven.browser() as browser:
            serve_aside(server)
            width, height = {"begin": (1280, 800), "turned": (1280, 1310), "phone": (390, 844)}[name]
            tab = browser.open(server.address, width, height)
            tab.wait("window.explore && explore.answered > 0")
            if name == "phone":
                tab.size(width, height, phone=True, scale=2.0)
            if name == "turned":
                tab.evaluate("document.getElementById('pin').click()")
                for value in (60, 40, 20, 10, 5, 2, 0, -2, -5, -10, -15, -20):
                    tab.type('[data-key="contact.interference"] input[type=number]', str(value))
                    tab.wait("explore.answered === explore.sent")
            tab.wait("document.querySelector('#steps li:last-child').className === 'done'", 300.0)
            time.sleep(4.0)  # the shape of the blade
            tab.screenshot(path)
            server.stop()
        return True

    return make


def _of_table(study: str) -> Maker:
    def make(path: Path) -> bool:
        figure, tables = import_module("work_precision.figure"), import_module("work_precision.study")
        figure.save_figure(tables.read_csv(ROOT / "benchmarks" / "measured" / f"{study}.csv"), path)
        return True

    return make


def _of_page(name: str) -> Maker:
    def make(path: Path) -> bool:
        page = DOCS / "tutorials" / f"{name}.md"
        subprocess.run([sys.executable, DOCS / "execute.py", "--update", page], cwd=ROOT, check=True)
        return True

    return make


def _of_notebook(path: Path) -> bool:
    """The figure that the code of the notebook leaves."""
    notebook = DOCS / "tutorials" / f"{path.stem}.ipynb"
    code = f"{code_cells(notebook)}\nplt.savefig({str(path)!r})\n"
    environment = os.environ | {"MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)}
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(notebook.with_suffix(".toml"), folder)
        subprocess.run([sys.executable, "-W", "ignore", "-c", code], cwd=folder, env=environment, check=True)
    return True


def _shroud(*arguments: Any) -> None:
    subprocess.run([sys.executable, "-m", "pipeline", *map(str, arguments)], cwd=ROOT, check=True)


def make_all(wanted: list[Picture], only_record: bool = False) -> None:
    """Make the pictures and record them, or only record them."""
    IMAGES.mkdir(exist_ok=True)
    for picture in wanted:
        if only_record or picture.make(picture.path):
            record = read_record()
            made = record["pictures"] | {picture.name: record_of(picture)}
            record["pictures"] = {name: made[name] for name in pictures() if name in made}
            done = [scene for scene in SCENES if (OUT / scene / "summary.json").exists()]
            record["peaks"] |= {scene: peaks(OUT / scene) for scene in done}
            write_record(record)
            print(picture.path.relative_to(ROOT), flush=True)


def peaks(folder: Path) -> list[list[float]]:
    """Frequency (Hz) and amplitude (m) of the main peak and of the worst motion of every curve of a run."""
    names = ("peak_frequency_hz", "peak_amplitude_m", "worst_frequency_hz", "worst_amplitude_m")
    curves = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["curves"]
    return [[float(f"{curve[name]:.4g}") for name in names] for curve in curves]


def main(arguments: list[str] | None = None) -> int:
    """The program; returns its exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="pictures; by default those that are old")
    parser.add_argument("--all", action="store_true", help="make all")
    parser.add_argument("--stale", action="store_true", help="list those that are old, and make none")
    parser.add_argument("--record", action="store_true", help="record the pictures as they are, and make none")
    options = parser.parse_args(arguments)
    known = pictures()
    if unknown := [name for name in options.names if name not in known]:
        parser.error(f"{unknown[0]}: no picture of this name; known: {', '.join(known)}")
    chosen = [known[name] for name in options.names or known]
    old = list(stale(chosen))
    if options.stale:
        print("\n".join(old) or "no picture is old")
        return 1 if old else 0
    named = {line.partition(":")[0] for line in old}
    make_all([one for one in chosen if options.names or options.all or one.name in named], options.record)
    return 0


if __name__ == "__main__":
    sys.exit(main())
