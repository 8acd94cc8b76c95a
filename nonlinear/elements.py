"""The choice of the contact element; the compiled ones are imported when they are needed."""

from nonlinear.contact import ContactElement, ContactParameters
from nonlinear.options import SolverOptions
from nonlinear.static_contact import StaticContact


def contact_element(contact: ContactParameters, n_harmonics: int, options: SolverOptions) -> ContactElement:
    """The contact element that the options ask for, for `n_harmonics` harmonics (0: statics)."""
    if n_harmonics == 0:
        return StaticContact(contact)
    if options.integration == "sampled":
        from nonlinear.sampled import SampledContact

        return SampledContact(contact, n_harmonics, max(options.samples, 4 * n_harmonics + 4))
    if contact.law == "coupled":
        from nonlinear.cone import ConeContact

        return ConeContact(contact, n_harmonics)
    from nonlinear.exact import ExactContact

    return ExactContact(contact, n_harmonics)
