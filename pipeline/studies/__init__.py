"""Studies: results of a scene beside its curves, such as the optimum of a parameter.

A study is a folder: its section of the scene, checks, computation, result, figure and section of the page, see
`pipeline.studies.registry`.
"""
