"""The choice of the contact element; the compiled ones are imported when they are needed."""

from nonlinear.contact.parameters import ContactElement, ContactParameters
from nonlinear.contact.quasistatic import QuasistaticContact
from nonlinear.options import SolverOptions, least_samples


def contact_element(contact: ContactParameters, n_harmonics: int, options: SolverOptions) -> ContactElement:
    """Build the contact element that the options ask for.

    Parameters
    ----------
    contact : ContactParameters
        Parameters of the nodes; `contact.law` tells two Jenkins elements per node from the friction cone.
    n_harmonics : int
        Number of harmonics H; 0: statics.
    options : SolverOptions
        `integration` "exact": event-driven; "sampled": AFT with at least `samples` samples.

    Returns
    -------
    ContactElement
        The element.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import contact_element
    >>> motion = np.zeros((3, 1, 3))
    >>> motion[1, 0, 0] = 0.1  # u1 = 0.1 cos(theta), m: kt u1 = 0.3 N is less than mu N0 = 1 N
    >>> forces = contact_element(contact, 1, options).evaluate(motion)
    >>> round(float(forces.force[1, 0, 0]), 6)  # N
    -0.3
    """
    if n_harmonics == 0:
        return QuasistaticContact(contact)
    if options.integration == "sampled":
        from nonlinear.contact.aft import AFTContact

        return AFTContact(contact, n_harmonics, max(options.samples, least_samples(n_harmonics)))
    if contact.law == "cone":
        from nonlinear.contact.cone_event_driven import EventDrivenCoulombCone

        return EventDrivenCoulombCone(contact, n_harmonics)
    from nonlinear.contact.event_driven import EventDrivenJenkins

    return EventDrivenJenkins(contact, n_harmonics)
