"""Settings for the tests of the reduced model."""

import pytest


@pytest.fixture(autouse=True, scope="session")
def _one_blas_thread():
    """The reference computations too are many small ones, which BLAS threads only slow down."""
    from rom.linear_algebra.threads import one_blas_thread

    with one_blas_thread():
        yield
