"""The formulas of docs/developers/stability_algebra.md against dense matrices, and the names that the page gives."""

import importlib
import re
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.contact_feedback import _memory_forces
from nonlinear.stability.floquet import FloquetAnalysis
from rom import modal_model

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "developers" / "stability_algebra.md").read_text()
OMEGA, HARMONICS = 1.3, 3


def table(title):
    """Rows of cells of the table below a title of the page."""
    lines = PAGE.split(f"\n## {title}\n")[1].split("\n## ")[0].splitlines()
    return [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in lines if line.startswith("| ")][1:]


def names_of(cell):
    return re.findall(r"`([A-Z]\w+)\.(\w+)`", cell)


def modules():
    for path in sorted((ROOT / "nonlinear" / "stability").glob("[a-z]*.py")):
        yield importlib.import_module(f"nonlinear.stability.{path.stem}")
    yield importlib.import_module("nonlinear.contact.parameters")
    yield importlib.import_module("rom.cyclic.modal_model")


@pytest.mark.parametrize(("cls", "attribute"), [pair for row in table("Symbols") for pair in names_of(row[1])])
def test_names_of_the_symbols(cls, attribute):
    owner = next(getattr(module, cls) for module in modules() if hasattr(module, cls))
    assert attribute in getattr(owner, "__dataclass_fields__", {}) or hasattr(owner, attribute)


PLACES = [(row[0].strip("`"), name) for row in table("Where it stands") for name in re.findall(r"`([\w.]+)`", row[1])]


@pytest.mark.parametrize(("file", "name"), PLACES)
def test_places_of_the_formulas(file, name):
    item = importlib.import_module(f"nonlinear.stability.{file.removesuffix('.py')}")
    for part in name.split("."):
        assert hasattr(item, part)
        item = getattr(item, part)


class DenseLoop:
    """All matrices of the page as full ones, at a motion with slip and lift-off."""

    def __init__(self, law, kappa):
        modal = modal_model(lumped_blade(3), damping_ratio=0.02)
        contact = ContactParameters.shared(
            2, normal_stiffness=6.0, tangential_stiffness=4.0, friction=0.5, interference=0.1, law=law
        )
        options = SolverOptions((0.1, 0.8), harmonics=HARMONICS)
        balance = build_harmonic_balance(modal, contact, Excitation(1, 1.0), options)
        displacement = 0.3 * np.random.default_rng(2).normal(size=(2 * HARMONICS + 1, 2, 3))
        self.modal, self.kappa = modal, kappa
        self.jacobian = balance.element.evaluate(displacement).jacobian
        analysis = FloquetAnalysis.of(balance.receptance, contact, kappa=kappa)
        self.problem, self.memory = analysis.problem, analysis.sampler.memory(displacement)

    @cached_property
    def k(self):
        """K, rows and columns (S, n_c, 3)."""
        size, to_real = 2 * HARMONICS + 1, self.problem._to_real
        result = np.zeros((size, 2, 3, size, 2, 3), dtype=complex)
        for node in range(2):
            values = self.jacobian[node].astype(complex)
            if to_real is not None:
                values = np.linalg.inv(to_real) @ values @ to_real
            result[:, node, :, :, node, :] = values.transpose(2, 0, 3, 1)
        return result.reshape(6 * size, 6 * size)

    @cached_property
    def model(self):
        """A, B, C, G_0, G_1."""
        found = self.problem.contact_free.condensed(OMEGA, np.ones(6, dtype=bool))
        unit = np.eye(len(self.k))
        flexibility = found.flexibility @ unit, found.flexibility_derivative @ unit
        return found.state_matrix, found.input_matrix, found.output_matrix, *flexibility

    def s(self, change=0.0):
        """S with a change of K."""
        k = self.k + change
        return k @ np.linalg.inv(np.eye(len(k)) - self.model[3] @ k)

    def condensed(self, sigma):
        """The receptance of the state space."""
        a, b, c, g_0, g_1 = self.model
        return c @ np.linalg.solve(sigma * np.eye(len(a)) - a, b) + g_0 + sigma * g_1

    def receptance(self, sigma):
        """The modal sum at lambda + i h omega, in the harmonics 0, 1, -1, ..."""
        order = [0, *(sign * h for h in range(1, HARMONICS + 1) for sign in (1, -1))]
        result = np.zeros((2 * HARMONICS + 1, 6, 2 * HARMONICS + 1, 6), dtype=complex)
        for row, h in enumerate(order):
            shift = np.exp(1j * (h * self.problem.phase + self.kappa))
            relative = self.modal.right - self.modal.left * shift
            s = OMEGA * (sigma + 1j * h)
            weights = s**2 + self.modal.damping * s + self.modal.angular_frequency**2
            result[row, :, row] = (relative / weights) @ relative.conj().T
        return result.reshape(len(self.k), len(self.k))


KAPPA = 2.0 * np.pi / 3.0  # no conjugate pairs: the rows are the harmonics 0, 1, -1, ...


def test_order_of_the_condensation():
    loop = DenseLoop("cone", KAPPA)
    errors = [np.abs(loop.condensed(sigma) - loop.receptance(sigma)).max() for sigma in (0.0, 0.1j, 0.2j)]
    assert errors[0] < 1e-12 * np.abs(loop.receptance(0.0)).max()
    assert errors[2] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_determinant_of_hill():
    """I - G(lambda) K is singular at the exponents, all poles being retained and no memory."""
    loop = DenseLoop("cone", KAPPA)
    problem = replace(loop.problem, retention_radius=np.inf).eigenproblem(loop.jacobian, OMEGA)
    values = problem.eigenvalues()
    for sigma in values[np.abs(values.imag) < 0.5]:
        singular = np.linalg.svd(np.eye(len(loop.k)) - loop.receptance(sigma) @ loop.k, compute_uv=False)
        assert singular[-1] < 1e-8 * singular[0]


@pytest.mark.parametrize("kappa", [0.0, KAPPA])
@pytest.mark.parametrize("law", ["two_sliders", "cone"])
class TestFeedback:
    def test_of_the_contact(self, law, kappa):
        loop = DenseLoop(law, kappa)
        a, b, c, _, g_1 = loop.model
        found = loop.problem.eigenproblem(loop.jacobian, OMEGA, loop.memory)
        assert found.state_matrix == pytest.approx(a + b @ loop.s() @ c, abs=1e-10)
        assert found.flexibility_matrix == pytest.approx(b @ loop.s() @ g_1 @ loop.s() @ c, abs=1e-10)

    def test_of_the_slider_memory(self, law, kappa):
        loop = DenseLoop(law, kappa)
        _, b, c, _, g_1 = loop.model
        feedback = loop.problem.eigenproblem(loop.jacobian, OMEGA, loop.memory).memory

        def change(sigma):
            """K(sigma) - K."""
            if law == "cone":
                return feedback.rows.contact(loop.memory.jacobian(sigma)[0]) @ np.eye(len(loop.k))
            rows, force = feedback.rows, _memory_forces(loop.memory, feedback.rows, sigma)[0]
            alone = np.eye(len(force))[:, :, None] * force
            return np.stack([rows.forces(loop.memory, one) for one in alone], axis=1) @ rows.positions(loop.memory)

        def state(sigma):
            return b @ (loop.s(change(sigma)) - loop.s()) @ c

        sigma, step = 0.1 + 0.3j, 1e-5
        terms, s = feedback.terms(sigma), loop.s(change(sigma))
        assert np.abs(change(sigma)).max() > 0.1
        assert terms.state == pytest.approx(state(sigma), abs=1e-10)
        assert terms.derivative == pytest.approx((state(sigma + step) - state(sigma - step)) / (2 * step), abs=1e-7)
        assert terms.flexibility == pytest.approx(b @ (s @ g_1 @ s - loop.s() @ g_1 @ loop.s()) @ c, abs=1e-10)
        assert feedback.terms(0.0).state == pytest.approx(0.0, abs=1e-12)
