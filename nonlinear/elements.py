"""The choice of the contact element; the compiled ones are imported when they are needed."""

from nonlinear.contact import ContactElement, ContactParameters
from nonlinear.options import SolverOptions


def contact_element(contact: ContactParameters, n_harmonics: int, options: SolverOptions) -> ContactElement:
    """The contact element that the options ask for, for `n_harmonics` harmonics (0: statics)."""
    from nonlinear.sampled import SampledContact

    if n_harmonics == 0:
        return SampledContact(contact, 0, 1)
    return SampledContact(contact, n_harmonics, max(options.samples, 4 * n_harmonics + 4))
