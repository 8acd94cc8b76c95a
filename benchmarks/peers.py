"""This program and pyHarm on the peers' problem: `python benchmarks/peers.py` from the project folder.

Solves problems A and V (`peers_programs.py`) with 1 and 5 harmonics, and one of the size of a shrouded blade
(`peers_blade.py`) with 1, by `forced_response` and by pyHarm, each in
processes of their own with one thread, prints the tables and writes out/bench/peers/peers.json and peers.md. pyHarm
is installed from the Python index into an environment of its own, once (some 1.3 GB). Exit status: 0 all solved, 1
if pyHarm could not be installed (this program alone is measured then) or a curve is missing or incomplete.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from peers_blade import write_blade
from peers_programs import Request
from peers_report import name, report
from tables import OUT, ROOT, hardware, load, today

PEER, PEER_VERSION = "pyHarm-os", "1.2.2"
TOLERANCE, REFERENCE_TOLERANCE = 1e-9, 1e-13
CHECK_SAMPLES = 16384
FREQUENCIES = (0.80, 1.00, 1.05, 1.10, 1.15, 1.20)
# What three other programs (V: two) agree on, 128 samples a period.
AGREED = {
    "A1": (0.447322883, 0.898440686, 1.264494453, 2.617636182, 2.324599740, 1.942844850),
    "A5": (0.447322883, 0.898440686, 1.264494453, 2.623080902, 2.329617441, 1.945808167),
    "V1": (0.428134832, 0.848186249, 1.182370796, 2.969930143, 2.441742470, 1.924253035),
}
CASES = {"A1": ("A", 1), "A5": ("A", 5), "V1": ("V", 1), "V5": ("V", 5), "S1": ("S", 1)}
OF_BLADE = (0.91, 0.98, 1.02, 1.06, 1.10, 1.18)  # frequencies of problem S
OURS = ("exact", "sampled")
THEIRS = {"A": ("Jenkins x", "Jenkins x, y"), "V": ("Penalty3D", "Penalty3D, hybrid"), "S": ("Penalty3D",)}
ONE_THREAD = {
    **{f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "OMP", "MKL", "NUMBA")},
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
    "JAX_ENABLE_X64": "1",  # pyHarm does not ask for it, and 32 bits do not reach the tolerance
}


class ProgramError(Exception):
    """A program could not be installed or run."""


@dataclass(frozen=True)
class Bench:
    """Where the programs are and how often they solve."""

    peer: Path | None
    home: Path
    curves: int
    first_use: bool
    blade: str = ""

    def run(self, request: Request, cache: Path | None = None) -> dict[str, Any]:
        """The answer of a process of its own; `cache` holds its compiled kernels.

        Raises
        ------
        ProgramError
            The process failed.
        """
        environment = os.environ | ONE_THREAD
        if request.program == "pyHarm":  # it writes its settings at home and its state where it is started
            environment |= {"HOME": str(self.home), "PYHARM_CONTEXT_FILE": str(self.home / "context.json")}
        if cache is not None:
            environment["NUMBA_CACHE_DIR"] = str(cache)
        python = sys.executable if request.program == "shroud" else str(self.peer)
        command = [python, str(Path(__file__).with_name("peers_programs.py")), json.dumps(asdict(request))]
        done = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise ProgramError(f"{request.program} failed: {_last_line(done.stderr)}")
        answer: dict[str, Any] = json.loads(_last_line(done.stdout))
        return answer

    def row(self, case: str, request: Request) -> dict[str, Any]:
        """One line of the comparison: a process with empty caches, then one that is timed. Times: [wall, CPU]."""
        with tempfile.TemporaryDirectory() as folder:
            cache = Path(folder) if self.first_use else None
            cold = self.run(replace(request, frequencies=()), cache) if self.first_use else None
            warm = self.run(replace(request, curves=self.curves, frequencies=frequencies(case)), cache)
        points = warm["curve"]["points"]
        seconds = [statistics.median(times) for times in zip(*warm["timed"], strict=True)]  # wall, CPU
        a_point = [value / points for value in seconds]
        return {
            "case": case,
            "program": request.program,
            "variant": request.variant,
            "samples": request.samples,
            **{key: warm[key] for key in ("curve", "timed", "response", "versions")},
            "seconds": seconds,
            "ms_a_point": [1e3 * value for value in a_point],
            "first_use": _overhead(cold, a_point) if cold else None,
            "each_start": _overhead(warm, a_point),
            "faster": None,
        }

    def reference(self, case: str) -> dict[str, Any]:
        """The exact element to the last digit, and the sampled one with very many samples as a check of it."""
        kind, harmonics = CASES[case]
        asked = frequencies(case)
        request = Request("shroud", "exact", kind, harmonics, REFERENCE_TOLERANCE, frequencies=asked, file=self.blade)
        exact = self.run(request)
        top = exact["curve"]["peak_frequency"]
        many = replace(request, variant="sampled", samples=CHECK_SAMPLES, frequencies=(*asked, top), curve=False)
        check = self.run(many)["response"]
        return {
            "agreed": AGREED.get(case),
            "response": exact["response"],
            "peak_frequency": top,
            "peak": exact["curve"]["peak"],
            "check": check[:-1],
            "check_peak": check[-1],
        }


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the comparison; the exit status."""
    options = _parser().parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    peer: Path | None = None
    without = "not asked for" if options.skip_pyharm else None
    if not options.skip_pyharm:
        try:
            peer = peer_python(options.env)
        except ProgramError as error:
            print(f"peers: {error}; this program only", file=sys.stderr)
            without = "it could not be installed"
    blade = options.out / "blade.npz"
    if any(CASES[case][0] == "S" for case in options.cases):
        write_blade(blade, ROOT / "scenes" / "dummy.toml", options.out.parent / "store")
    bench = Bench(peer, options.env, options.curves, not options.no_first_use, str(blade.resolve()))
    results = compare(bench, options.cases) | {"without_peer": without}
    (options.out / "peers.json").write_text(json.dumps(results, indent=1), encoding="utf-8")
    text = report(results)
    (options.out / "peers.md").write_text(text, encoding="utf-8")
    print(text)
    print(f"written: {options.out / 'peers.json'}, {options.out / 'peers.md'}")
    complete = all(row["curve"]["complete"] for row in results["rows"]) and not results["failures"]
    return 0 if complete and (peer is not None or options.skip_pyharm) else 1


def _parser() -> argparse.ArgumentParser:
    out = OUT / "peers"
    parser = argparse.ArgumentParser(description="This program and pyHarm on the peers' problem.")
    parser.add_argument("--skip-pyharm", action="store_true", help="this program only; needs no network")
    parser.add_argument(
        "--env", type=Path, default=out / "env", help="environment of pyHarm, made if it is not there"
    )
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES), help="problem and harmonics (all)")
    parser.add_argument("--curves", type=int, default=5, help="curves timed a row; 3 where they are long (5)")
    parser.add_argument("--no-first-use", action="store_true", help="no processes with empty caches")
    parser.add_argument("--out", type=Path, default=out, help="output folder")
    return parser


def peer_python(folder: Path) -> Path:
    """The interpreter of the environment with the peer's program, made at the first call.

    Raises
    ------
    ProgramError
        pip did not install it, or `folder` is the environment of this program.
    """
    if folder.resolve() == Path(sys.prefix).resolve():
        raise ProgramError(f"--env: {folder} is the environment of this program, allowed: any other folder")
    python = folder.absolute() / "bin" / "python"
    if _installed(python):
        return python
    print(f"peers: installing {PEER} {PEER_VERSION} into {folder}, once", file=sys.stderr)
    commands = (
        [sys.executable, "-m", "venv", str(folder)],
        [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", f"{PEER}=={PEER_VERSION}"],
    )
    for command in commands:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise ProgramError(f"{PEER} {PEER_VERSION} not installed: {_last_line(done.stderr or done.stdout)}")
    return python


def _installed(python: Path) -> bool:
    if not python.exists():
        return False
    asked = f"from importlib.metadata import version; print(version({PEER!r}))"
    done = subprocess.run([str(python), "-c", asked], capture_output=True, text=True, check=False)
    return done.returncode == 0 and done.stdout.strip() == PEER_VERSION


def compare(bench: Bench, cases: Sequence[str]) -> dict[str, Any]:
    """All rows and references, as `peers.json` holds them."""
    before = load()
    rows: list[dict[str, Any]] = []
    failures: list[str] = []
    for case in cases:
        of_case: list[dict[str, Any]] = []
        for request in _requests(case, bench):
            points = of_case[0]["curve"]["points"] if of_case else 0
            fitted = replace(request, points=points if request.program == "pyHarm" else 0)
            try:
                row = bench.row(case, fitted)
            except ProgramError as error:
                failures.append(f"{case}, {request.variant}: {error}")
                print(f"peers: {failures[-1]}", file=sys.stderr)
                continue
            print(f"peers: {case}, {name(row)}: {row['ms_a_point'][1]:.2f} CPU ms a point", file=sys.stderr)
            of_case.append(row)
        theirs = [row["ms_a_point"] for row in of_case if row["program"] == "pyHarm" and row["curve"]["complete"]]
        for row in of_case:
            if theirs:
                row["faster"] = [min(times[i] for times in theirs) / row["ms_a_point"][i] for i in (0, 1)]
        rows += of_case
    return {
        "when": today(),
        "machine": hardware(),
        "load": [before, load()],
        "tolerance": TOLERANCE,
        "check_samples": CHECK_SAMPLES,
        "frequencies": {case: frequencies(case) for case in cases},
        "versions": {row["program"]: row.pop("versions") for row in rows},
        "rows": rows,
        "references": {case: bench.reference(case) for case in cases},
        "failures": failures,
    }


def frequencies(case: str) -> tuple[float, ...]:
    """w at which the responses of a case are compared."""
    return OF_BLADE if CASES[case][0] == "S" else FREQUENCIES


def _requests(case: str, bench: Bench) -> Iterator[Request]:
    kind, harmonics = CASES[case]
    for variant in OURS:
        yield Request("shroud", variant, kind, harmonics, TOLERANCE, file=bench.blade)
    for variant in THEIRS[kind] if bench.peer is not None else ():
        yield Request("pyHarm", variant, kind, harmonics, TOLERANCE, file=bench.blade)


def _overhead(answer: dict[str, Any], seconds_a_point: Sequence[float]) -> list[float]:
    """Seconds of the import, and of the first curve beyond what it takes later: [wall, CPU]."""
    parts = zip(answer["imported"], answer["first"], seconds_a_point, strict=True)
    return [imported + first - answer["first_points"] * later for imported, first, later in parts]


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1] if lines else "no message"


if __name__ == "__main__":
    sys.exit(main())
