"""The choice of the contact element; the compiled ones are imported when they are needed."""

from nonlinear.contact.parameters import ContactElement, ContactParameters
from nonlinear.contact.quasistatic import StaticContact
from nonlinear.options import SolverOptions


def contact_element(contact: ContactParameters, n_harmonics: int, options: SolverOptions) -> ContactElement:
    """The contact element that the options ask for, for `n_harmonics` harmonics (0: statics)."""
    if n_harmonics == 0:
        return StaticContact(contact)
    if options.integration == "sampled":
        from nonlinear.contact.aft import SampledContact

        return SampledContact(contact, n_harmonics, max(options.samples, 4 * n_harmonics + 4))
    if contact.law == "coupled":
        from nonlinear.contact.cone_event_driven import ConeContact

        return ConeContact(contact, n_harmonics)
    from nonlinear.contact.event_driven import ExactContact

    return ExactContact(contact, n_harmonics)
