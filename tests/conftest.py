"""Compiled modules are kept whatever the environment says: hundreds of processes that tests start load them.

Tests that share what their module makes run on one worker, so that it is made once.

With DISTURBED=n (`make test-generic`) every result of the time integration has a relative disturbance of 1e-13, drawn
with seed n: no test may rest on what round-off seeds.
"""

import os
import sys
from dataclasses import replace
from functools import wraps

import pytest

os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Group the tests that have a fixture of their module, for `--dist loadgroup`."""
    for item in items:
        known = item._fixtureinfo.name2fixturedefs.values() if hasattr(item, "_fixtureinfo") else ()
        shared = any(each.scope == "module" and each.baseid.endswith(".py") for found in known for each in found)
        if shared and item.get_closest_marker("xdist_group") is None:
            item.add_marker(pytest.mark.xdist_group(item.path.stem))


def _disturb_time_integration(seed: int) -> None:
    import numpy as np

    from nonlinear.time_integration.ring_integrator import RingIntegrator

    rng, march = np.random.default_rng(seed), RingIntegrator.march

    def disturbed(values):
        return values * (1.0 + 1e-13 * rng.standard_normal(values.shape))

    @wraps(march)
    def disturbed_march(self, state, periods):
        record = march(self, state, periods)
        final = replace(
            record.final, coordinates=disturbed(record.final.coordinates), rates=disturbed(record.final.rates)
        )
        return replace(record, final=final, output_m=disturbed(record.output_m), ends=disturbed(record.ends))

    RingIntegrator.march = disturbed_march


if os.environ.get("DISTURBED"):
    _disturb_time_integration(int(os.environ["DISTURBED"]))
