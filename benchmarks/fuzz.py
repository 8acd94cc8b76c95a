"""`make fuzz`: bytes of all kinds into everything that reads files, guided by the coverage of the code (atheris).

    python benchmarks/fuzz.py [--seconds 60] [--only scene|hdf5] [--out out/fuzz]

Whatever a reader does but return or raise the package's own input error is a finding: an exception, a crash of a
library, more than 2 GB of memory, more than 20 s for one file. It is saved, named, and makes the exit status 1.
"""

from __future__ import annotations

import argparse
import importlib.util
import re
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

HERE = Path(__file__).parent
TARGETS = ("scene", "hdf5")
MEMORY = 2048  # MB
SLOW = 20  # s for one input
GRACE = 60  # s beyond those asked for until a fuzzer that does not stop is ended


@dataclass(frozen=True)
class Fuzzed:
    """What fuzzing one reader came to. `handled`: files that the HDF5 library dies of; `findings`: saved files."""

    target: str
    executions: int
    seconds: float
    handled: int
    findings: tuple[Path, ...]
    last: str

    @property
    def failed(self) -> bool:
        """Whether something was found, or nothing was tried."""
        return bool(self.findings) or self.executions == 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Fuzz one reader after the other; the exit status says whether something was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=60, help="for each reader")
    parser.add_argument("--only", choices=TARGETS)
    parser.add_argument("--out", type=Path, default=Path("out/fuzz"))
    asked = parser.parse_args(arguments)
    if importlib.util.find_spec("atheris") is None:
        print(
            "fuzz: the package atheris is not installed here: pip install 'shroud[fuzz]' (Linux, x86_64)",
            file=sys.stderr,
        )
        return 2
    results = [fuzz(target, asked.seconds, asked.out) for target in TARGETS if asked.only in (None, target)]
    for result in results:
        count = len(result.findings)
        print(f"{result.target}: {result.executions} executions in {result.seconds:.0f} s, {count} findings")
        if result.handled:
            print(f"  {result.handled} files that the HDF5 library crashes or hangs on, each refused in one line")
        for path in result.findings:
            print(f"  {path}")
        if result.failed:
            print(f"  {result.last}")
    return int(any(result.failed for result in results))


def fuzz(target: str, seconds: int, out: Path) -> Fuzzed:
    """Run one fuzzer in processes of their own; what it finds is in `out`, what it says in `out`/TARGET.log.

    A library that dies takes the fuzzer with it. Then the file is tried as the program would, and unless that fails
    too, the fuzzer goes on.
    """
    corpus = out / f"corpus-{target}"
    corpus.mkdir(parents=True, exist_ok=True)
    before, log = set(out.glob(f"{target}-*")), out / f"{target}.log"
    executions, handled, end = 0, 0, time.monotonic() + seconds
    log.write_text("")
    while (left := int(end - time.monotonic())) > 0:
        start = log.stat().st_size
        with log.open("a") as said:
            ended_well = _round(target, out, left, said)
        text = log.read_text(errors="replace")[start:]
        done = max((int(count) for count in re.findall(r"^#(\d+)\s", text, flags=re.MULTILINE)), default=0)
        executions, handled = executions + done, handled + len(re.findall("^handled: ", text, flags=re.MULTILINE))
        if ended_well or done == 0:
            break
        suspects = [*(set(out.glob(f"{target}-*")) - before), *out.glob(f"current-{target}")]
        findings = [suspect for suspect in suspects if _is_finding(target, suspect, out)]
        if findings:
            break
        handled += 1
    found = tuple(sorted(set(out.glob(f"{target}-*")) - before))
    spent = seconds - max(end - time.monotonic(), 0.0)
    return Fuzzed(target, executions, spent, handled, found, _reason(log.read_text(errors="replace")))


def _round(target: str, out: Path, seconds: int, said: IO[str]) -> bool:
    """One process of the fuzzer; whether it ended as it should."""
    program = [sys.executable, str(HERE / f"fuzz_{target}.py"), str((out / f"corpus-{target}").resolve())]
    options = {
        "max_total_time": seconds,
        "timeout": SLOW,
        "rss_limit_mb": MEMORY,
        "artifact_prefix": f"{out.resolve()}/{target}-",
        **{f"handle_{name}": 0 for name in ("segv", "abrt", "bus", "fpe", "ill")},  # its own handlers hang at times
    }
    command = [*program, *(f"-{name}={value}" for name, value in options.items())]
    try:
        done = subprocess.run(
            command, stdout=said, stderr=subprocess.STDOUT, timeout=seconds + GRACE, check=False, cwd=out
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def _is_finding(target: str, suspect: Path, out: Path) -> bool:
    """Whether the program itself fails on a file that ended the fuzzer: then it is kept, otherwise removed."""
    program = [sys.executable, str(HERE / f"fuzz_{target}.py"), "--check", str(suspect.resolve())]
    try:
        failed = subprocess.run(program, capture_output=True, timeout=6 * SLOW, check=False).returncode != 0
    except subprocess.TimeoutExpired:
        failed = True
    if not failed:
        suspect.unlink()
    elif suspect.name.startswith("current-"):
        suspect.replace(out / f"{target}-died-{suspect.stat().st_mtime_ns}")
    return failed


def _reason(text: str) -> str:
    """The line of a log that says what went wrong."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    telling = [
        line for line in lines if re.match(r"(===|==\d+==\s*(ERROR|libFuzzer)|\w+(\.\w+)*(Error|Exception)\b)", line)
    ]
    return (telling or lines or ["nothing was said"])[-1 if telling else 0]


if __name__ == "__main__":
    sys.exit(main())
