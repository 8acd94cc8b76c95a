"""The mistuned ring: N_b blades that differ a little, under a travelling wave, each with its own contact pairs.

Blade j has the natural frequencies (1 + delta_j) omega_m and the mode shapes of the tuned blade. Contact pair j lies
between the right face of blade j and the left face of blade j+1. All Fourier coefficients are in the time of their
own blade, q_j(t) = Re sum_h q_j^(h) exp(i h (omega t + j psi)): in the tuned travelling wave they are the same at all
j.

Where to look: `mistuning` (the deviations), `mistuned_structure` (what the contacts see of the structure; blades in
`ring_receptance`, a disk in `sector_ring`), `ring_balance` (the equations), `cyclic_blocks` (a factorisation),
`ring_response` (the curve of all blades and its maximum), `mistuned_curve` (stability, branches, worst motion),
`linear_sectors` (linear contacts).

References
----------
D. S. Whitehead, "Effect of mistuning on the vibration of turbo-machine blades induced by wakes", Journal of
Mechanical Engineering Science 8(1), 1966, pp. 15-21.

M. P. Castanier, C. Pierre, "Modeling and analysis of mistuned bladed disk vibration: status and emerging directions",
Journal of Propulsion and Power 22(2), 2006, pp. 384-396.
"""
