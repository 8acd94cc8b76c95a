"""Stability of a periodic solution: Hill's method on the condensed problem, with the memory of the sliders.

All formulas stand on one page, docs/developers/stability_algebra.md, in the notation of the code.

    hill                  the eigenvalue problem of the perturbations of the travelling wave
    modal_condensation    the contact-free modal model: poles kept as states, the others as a residual flexibility
    contact_feedback      the contact Jacobian closed around that model
    memory_feedback       the slider memory closed around both
    slider_memory         hereditary terms of the linearised hysteresis, two Jenkins sliders
    cone_slider_memory    the same for one slider under the friction cone
    block_matrices        block diagonal matrices of the above
    floquet               Floquet exponents in one strip, and what crosses the imaginary axis
    ring_stability        the least stable exponent over all nodal diameters of the ring
    pattern_scan          approximate exponents of all nodal diameters, in few modes
    reduced_modes         the lowest modes and residual modes
    reduced_problem       the eigenvalue problem in few modes
    face_contact          the contact in modal coordinates of both faces, for all phase shifts at once
    modal_contact         the contact Jacobian in modal coordinates, its memory as a matrix of low rank
    reduced_refinement    one exponent in few modes, corrected for the others
    reduced_wave          the exponents of the wave in few modes
    pattern_matrices      the slices of the strip, interpolated to all nodal diameters
    face_scan             approximate exponents of all nodal diameters, for stiff contacts
    sector_scan           the same for a ring with a disk
    shared_motions        few contact motions that all waves share, and their mean flexibility
    closed_contact        the contact closed around that flexibility
    perturbation_pencils  the eigenvalue problems that are left, many at once
    ring_structure        all of these for one structure
    closed_refinement     one exponent with all modes, nothing linearised
    axis_interpolation    a matrix along the imaginary axis, from its values and derivatives
    wave_flexibility      a sector with a disk in all waves, in the few motions that contacts see
    face_flexibility      a blade without a disk in them
    linear_poles          poles of the ring while no contact changes its state

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
