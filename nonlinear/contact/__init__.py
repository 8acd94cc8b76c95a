"""Contact elements: periodic relative displacement in, contact forces and their Jacobian out.

The law on each node, with u tangential and d_n normal relative displacement (Gulisano et al. 2011, eqs. 8 and 9):

    N = max(N0 + kn (v0 + d_n), 0)          normal law (`parameters`)
    T = kt (u - w),  |T| <= mu N            elastic Coulomb slider at w: a Jenkins element or, in the plane, a cone

Where to look: `event_driven` (two Jenkins elements, exact), `cone_event_driven` (friction cone, exact), `aft` (both,
sampled), `return_map` (the sampled slider), `element_choice` (which one, and statics).
"""
