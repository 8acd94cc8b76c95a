"""The choice of the contact element; the compiled ones are imported when they are needed."""

from nonlinear.contact import ContactElement, ContactError, ContactParameters
from nonlinear.options import Integration, SolverOptions
from nonlinear.static_contact import StaticContact


def integration_of(contact: ContactParameters, options: SolverOptions) -> Integration:
    """The integration that is used: as asked for, else exact for the uncoupled and sampled for the coupled law.

    Raises
    ------
    ContactError : exact integration asked for with the coupled law, whose slip has no closed form.
    """
    if options.integration is None:
        return "exact" if contact.law == "uncoupled" else "sampled"
    if options.integration == "exact" and contact.law == "coupled":
        raise ContactError(
            'integration: "exact" with law "coupled", allowed: "sampled" (its slip has no closed form)'
        )
    return options.integration


def contact_element(contact: ContactParameters, n_harmonics: int, options: SolverOptions) -> ContactElement:
    """The contact element that the options ask for, for `n_harmonics` harmonics (0: statics)."""
    integration = integration_of(contact, options)
    if n_harmonics == 0:
        return StaticContact(contact)
    if integration == "exact":
        from nonlinear.exact import ExactContact

        return ExactContact(contact, n_harmonics)
    from nonlinear.sampled import SampledContact

    return SampledContact(contact, n_harmonics, max(options.samples, 4 * n_harmonics + 4))
