"""Study `uncertainty`: distribution of the worst motion for uncertain parameters.

`samples` (quasi-random values), `quantiles` (with their confidence), `sobol_indices` and `polynomial_chaos`
(sensitivities), `first_order` (the linear answer from derivatives), `result` (what is published), `study` (the
curves, and all of it put together).
"""
