"""Stability of a periodic solution: Hill's method on the condensed problem, with the memory of the sliders.

All formulas stand on one page, docs/developers/stability_algebra.md, in the notation of the code.

    floquet               Floquet exponents in one strip, and what crosses the imaginary axis
    ring_stability        the least stable exponent over all nodal diameters of the ring

    eigenproblem          T(sigma) z = 0 in any basis: the strip, inverse iteration, successive linear problems
    hessenberg_qr         eigenvalues of many small matrices

    point_contact         the contact of a point: its Jacobian and the slider memory
    slider_memory         hereditary terms of the linearised hysteresis, of both contact laws
    contact_kernels       compiled loops of both

    hill                  all modes: the eigenvalue problem of the perturbations, in the contact dofs
    modal_condensation    the contact-free modal model: poles kept as states, the others as a residual flexibility
    contact_feedback      the contact Jacobian, and the slider memory, closed around that model

    reduced_problem       few modes: the lowest ones and residual modes, in modal coordinates
    modal_contact         the contact in these coordinates, for all phase shifts at once and for one
    reduced_refinement    one exponent in few modes, corrected for the others

    perturbation_pencils  few contact motions that all waves share, and the eigenvalue problems in these, many at once
    ring_structure        the structure in these motions, with a disk and without
    closed_refinement     one exponent with all modes, nothing linearised
    exact_refinement      the same for few contact dofs and blades alone: no pole is condensed

    ring_scan             approximate exponents of all nodal diameters, in few modes or in shared motions

References
----------
Hill's method in the harmonic balance:

* M. Krack, J. Gross, Harmonic Balance for Nonlinear Vibration Problems, Springer, 2019.
* G. von Groll, D. J. Ewins, The harmonic balance method with arc-length continuation in rotor/stator contact
  problems, Journal of Sound and Vibration 241(2), 2001.
* A. Lazarus, O. Thomas, A harmonic-based method for computing the stability of periodic solutions of dynamical
  systems, Comptes Rendus Mecanique 338(9), 2010.

Floquet theory and bifurcations of periodic motions:

* A. H. Nayfeh, B. Balachandran, Applied Nonlinear Dynamics, Wiley, 1995.
"""
