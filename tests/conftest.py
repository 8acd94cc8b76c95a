"""Compiled modules are kept whatever the environment says: hundreds of processes that tests start load them.

With DISTURBED=n (`make test-generic`) every result of the time integration has a relative disturbance of 1e-13, drawn
with seed n: no test may rest on what round-off seeds.
"""

import os
import sys
from dataclasses import replace
from functools import wraps

os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


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
