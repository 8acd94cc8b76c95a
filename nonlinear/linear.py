"""Linear limits of the response: contacts open everywhere, or stuck everywhere."""

from collections.abc import Sequence

import rom
from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.options import Excitation


def linear_response(
    modal: rom.ModalModel,
    excitation: Excitation,
    frequency_hz: Sequence[float] | Array,
    *,
    normal: Array | float = 0.0,
    tangential: Array | float = 0.0,
    output: str = "tip",
) -> ComplexArray:
    """Complex amplitude of the output with linear contact springs, (F,), metres: free (no springs) or fully stuck.

    `modal`, `excitation`: as in `forced_response`; `frequency_hz`: (F,) Hz. `normal`, `tangential`: contact stiffness
    of the nodes, N/m, numbers or (n_c,).
    """
    return rom.linear_response(
        modal,
        frequency_hz,
        phase=modal.phase(excitation.engine_order),
        force=excitation.force,
        normal=normal,
        tangential=tangential,
        output=output,
    )
