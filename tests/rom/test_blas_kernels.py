"""Kernels of an OpenBLAS that is loaded late: by what the processor says it has."""

import os
from pathlib import Path

import pytest

import rom.linear_algebra.blas_kernels
from rom.linear_algebra.blas_kernels import best_kernels

VARIABLE = "OPENBLAS_CORETYPE"
AVX512 = "avx2 fma avx512f avx512cd avx512bw avx512dq avx512vl"


@pytest.fixture
def processor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Call with its features, by the names of Linux."""
    monkeypatch.delenv(VARIABLE, raising=False)

    def of(features: str) -> None:
        file = tmp_path / "cpuinfo"
        file.write_text(f"processor\t: 0\nmodel name\t: any\nflags\t\t: fpu {features} sse\nbugs\t: none\n")
        monkeypatch.setattr(rom.linear_algebra.blas_kernels, "_PROCESSOR", file)

    return of


@pytest.mark.parametrize(
    ("features", "expected"),
    [(AVX512, "SKYLAKEX"), ("avx2 fma", "HASWELL"), ("avx2 fma avx512f", "HASWELL"), ("avx2", None), ("", None)],
)
def test_the_best_kernels_and_only_inside(processor, features: str, expected: str | None):
    processor(features)
    with best_kernels():
        assert os.environ.get(VARIABLE) == expected
    assert VARIABLE not in os.environ


def test_what_the_user_says_goes_before(processor, monkeypatch: pytest.MonkeyPatch):
    processor(AVX512)
    monkeypatch.setenv(VARIABLE, "Zen")
    with best_kernels():
        assert os.environ[VARIABLE] == "Zen"
    assert os.environ[VARIABLE] == "Zen"


def test_gone_after_an_error_too(processor):
    processor(AVX512)
    with pytest.raises(ImportError), best_kernels():
        raise ImportError
    assert VARIABLE not in os.environ


def test_a_system_that_does_not_tell(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(rom.linear_algebra.blas_kernels, "_PROCESSOR", tmp_path / "missing")
    with best_kernels():
        assert VARIABLE not in os.environ
