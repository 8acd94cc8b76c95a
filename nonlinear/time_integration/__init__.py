"""Time integration of a ring of blades: what a motion becomes when the ring is left alone with it.

ring                 the ring: modes, contact, excitation, number of blades; its state
modal_propagation    modal coordinates over one step, exact for a force that varies linearly
residual_flexibility the retained modes, the others as a flexibility, and the step
ring_system          arrays of the compiled kernels
clamped_blades       blades that only their contacts join: modal coordinates of each
joined_sectors       sectors joined at a disk: coordinates of their waves
ring_structure       one of the two
contact_step         contact forces at the end of a step (compiled)
ring_period          periods of the ring, step by step (compiled)
disk_system          arrays of the compiled kernels with a disk, wave by wave
disk_period          periods of a ring of sectors joined at a disk (compiled)
ring_integrator      states, disturbances and periods of one ring at one frequency
wave_start           the periodic motion that a ring starts from, with more harmonics
energy               energy balance over a period
growth               growth rate from the states at the ends of the periods
recurrence           periodic, settled: judged from the states at the ends of the periods
ring_motion          the question asked of a ring: does it stay, where does it go, how high
"""
