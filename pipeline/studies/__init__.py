"""Studies: results of a scene beside its curves, such as the optimum of a parameter.

A study has a section of its own in the scene, a module here, a figure (`pipeline/figures/figure_stage.py`) and a
section of the report (`pipeline/report/studies.py`). It is imported only where its section is there.
"""
