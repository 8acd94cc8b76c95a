"""Truncation error (neglected harmonics), and the number of harmonics that a tolerance asks for.

References
----------
V. Jaumouillé, J.-J. Sinou, B. Petitjean, "An adaptive harmonic balance method for predicting the nonlinear dynamic
responses of mechanical systems - Application to bolted structures", J. Sound Vib. 329(19), 2010, pp. 4048-4067.

A. Grolet, F. Thouverez, "On a new harmonic selection technique for harmonic balance method", Mech. Syst. Signal
Process. 30, 2012, pp. 43-60.
"""
