"""The set-up's look for system libraries: what is missing is named, installed where allowed, or a command printed."""

import subprocess
from pathlib import Path
from typing import Any

import pytest

from pipeline import bootstrap
from pipeline.errors import StageError


def test_this_machine_has_everything() -> None:
    assert bootstrap.missing_packages() == []
    assert bootstrap.main() == 0


def test_one_of_two_libraries_is_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bootstrap, "_loads", lambda name: name != "libEGL.so.1")
    assert bootstrap.missing_packages() == []
    monkeypatch.setattr(bootstrap, "_loads", lambda name: "EGL" not in name and "Mesa" not in name)
    assert bootstrap.missing_packages() == ["libegl1"]


def test_a_user_without_rights_gets_the_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bootstrap, "_loads", lambda name: name != "libGLU.so.1")
    monkeypatch.setattr(bootstrap, "_is_root", lambda: False)
    monkeypatch.setattr(bootstrap, "_sudo_without_password", lambda: False)
    assert bootstrap.main() == 1
    assert capsys.readouterr().err.splitlines() == [
        "missing system packages: libglu1-mesa",
        "install them with: sudo apt-get update && sudo apt-get install -y --no-install-recommends libglu1-mesa",
    ]


def test_root_installs(monkeypatch: pytest.MonkeyPatch) -> None:
    installed: list[list[str]] = []

    def run(command: list[str], **_: Any) -> subprocess.CompletedProcess[str]:
        installed.append(command)
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(bootstrap, "_loads", lambda name: name != "libGLU.so.1" or len(installed) == 2)
    monkeypatch.setattr(bootstrap, "_is_root", lambda: True)
    monkeypatch.setattr(bootstrap.shutil, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(bootstrap.subprocess, "run", run)
    assert bootstrap.main() == 0
    assert [command[2] for command in installed] == ["update", "install"]
    assert installed[1][-1] == "libglu1-mesa"


def test_programs_that_tests_compare_with_are_brought(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    present = {"google-chrome"}
    monkeypatch.setattr(bootstrap.shutil, "which", lambda name: name if name in present else None)
    monkeypatch.setattr(bootstrap, "_is_root", lambda: True)
    assert bootstrap.main(["--test-programs"]) == 1
    assert capsys.readouterr().err.splitlines() == [
        "missing system packages: calculix-ccx",
        "install them with: apt-get update && apt-get install -y --no-install-recommends calculix-ccx",
    ]
    present.add("ccx")
    assert bootstrap.main(["--test-programs"]) == 0


CI = Path(__file__).parents[2] / ".ci" / "run"


@pytest.mark.skipif(not CI.is_file(), reason="no .ci/run beside these tests")
def test_continuous_integration_brings_them_before_the_tests() -> None:
    lines = [line for line in CI.read_text().splitlines() if not line.startswith("#")]
    bringing = next(k for k, line in enumerate(lines) if "bootstrap.py --test-programs" in line)
    assert bringing < lines.index("exec make test")


def test_every_skipped_test_is_listed_with_its_reason(pytestconfig: pytest.Config) -> None:
    assert "s" in pytestconfig.getoption("reportchars")


def test_a_run_without_a_system_library_names_the_command() -> None:
    missing = OSError("libGLU.so.1: cannot open shared object file: No such file or directory")
    assert "libGLU.so.1" in str(StageError("mesh", missing))
    assert "; python -m pipeline.bootstrap installs" in str(StageError("mesh", missing))
    assert "bootstrap" not in str(StageError("mesh", OSError("disk full")))
