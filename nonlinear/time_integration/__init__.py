"""Time integration of a ring of blades: what a motion becomes when the ring is left alone with it.

ring             the ring: modes, contact, excitation, blades; its state; the retained modes and the step
contact_step     contact forces at the end of a step, and the arrays of the kernels (compiled)
ring_period      periods of the ring, step by step (compiled)
ring_structure   blades that only their contacts join, or sectors joined at a disk
wave_poles       poles with Coriolis forces, each by itself
turning_blades, turning_sectors  the same structures with Coriolis forces: poles in place of modes
ring_integrator  states, disturbances and periods of one ring at one frequency
ring_motion      the question asked of a ring: does it stay, where does it go, how high
"""
