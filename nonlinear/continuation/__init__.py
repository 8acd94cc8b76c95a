"""Pseudo-arc-length continuation of the harmonic balance in the frequency.

A step predicts the next point along the tangent and corrects it by Newton's method in the plane normal to the tangent
(`predictor_corrector`, `corrector`), is accepted or refused (`acceptance`), and proposes the length of the next one
(`step_control`). `arclength_continuation` puts these parts together.

References
----------
H. B. Keller, "Numerical solution of bifurcation and nonlinear eigenvalue problems", in P. H. Rabinowitz (ed.),
Applications of Bifurcation Theory, Academic Press, 1977, pp. 359-384.

E. L. Allgower, K. Georg, Introduction to Numerical Continuation Methods, SIAM, 2003.

T. F. C. Chan, H. B. Keller, "Arc-length continuation and multigrid techniques for nonlinear elliptic eigenvalue
problems", SIAM J. Sci. Stat. Comput. 3(2), 1982, pp. 173-194.
"""
