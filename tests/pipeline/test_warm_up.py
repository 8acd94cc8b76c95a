"""Kernels compiled before a run: all that curves call, and each by one process at a time."""

import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import ground_model

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.numba_cache import CompileLock
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_integrator import RingIntegrator
from nonlinear.time_integration.ring_motion import RingLimits, integrate_ring
from pipeline.stages.warm_up import INTEGRATIONS, LAWS, small_disk, small_model, warm_up
from rom import InfluenceCoefficients, modal_model


def signatures() -> dict[str, int]:
    """Number of argument types that every kernel is compiled for by now, in this process."""
    modules = [module for name, module in sys.modules.items() if name.startswith("nonlinear.")]
    kernels: list[Any] = [each for module in modules for each in vars(module).values()]
    return {each.__name__: len(each.signatures) for each in kernels if hasattr(each, "nopython_signatures")}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("integration", INTEGRATIONS)
def test_nothing_is_left_to_compile(law: Any, integration: Any) -> None:
    """Against ground and with another number of harmonics; a curve with all that a run adds, and rings in time."""
    warm_up(law, integration)
    before = signatures()
    assert sum(before.values()) > 2
    modal = modal_model(ground_model(), damping_ratio=0.02)
    contact = ContactParameters.shared(
        3, normal_stiffness=2.4, tangential_stiffness=1.2, friction=0.4, preload=1.0, law=law
    )
    options = SolverOptions((0.1, 0.11), harmonics=2, integration=integration, samples=64, max_points=3)
    curve = forced_response(modal, contact, Excitation(1, 0.5), options)
    assert np.all(np.isfinite(curve.amplitude_m))
    limits = RingLimits(most_periods=2, window=1, settling=1)
    integrate_ring(Ring(modal, contact, Excitation(1, 0.5)), 0.7, None, limits=limits)
    if law == "two_sliders":
        contact = ContactParameters.shared(2, normal_stiffness=2.4, tangential_stiffness=1.2, friction=0.4)
        flow = (InfluenceCoefficients(1, np.array([-1, 0]), np.array([0.02, -0.05j])),)
        for model, influence in ((small_disk(), ()), (small_disk(), flow), (small_model(), flow)):
            sectors = modal_model(model, damping_ratio=0.05, influence=influence)
            ring = RingIntegrator.of(Ring(sectors, contact, Excitation(1, 0.5)), 0.7)
            ring.march(ring.at_rest(), 1)
    after = signatures()
    assert {name: number for name, number in after.items() if number != before.get(name)} == {}


def test_one_compiles_while_the_others_wait(tmp_path: Path) -> None:
    """Threads stand for processes: each has a lock of its own."""
    lock, inside, order = CompileLock(), threading.Event(), []

    def compile_first() -> None:
        with lock.compilation():
            assert lock.take(tmp_path / "kernel.lock")
            inside.set()
            with lock.compilation():  # of a kernel that the first one calls
                assert not lock.take(tmp_path / "callee.lock")
            time.sleep(0.1)
            order.append("first")

    thread = threading.Thread(target=compile_first)
    thread.start()
    inside.wait()
    with lock.compilation():
        assert lock.take(tmp_path / "kernel.lock")
        order.append("second")
    thread.join()
    assert order == ["first", "second"]
    with lock.compilation():  # the first one has given it back
        assert lock.take(tmp_path / "kernel.lock")
