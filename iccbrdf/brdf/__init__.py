"""The science in float64 NumPy: the independent reference that the profiles are checked against.

geometry        directions, half vector, cosines
cook_torrance   the Cook-Torrance models of both papers and their terms
ward            Ward's isotropic model
models          the table of models: names and order of parameters, `evaluate` by name
primaries       the file of measured primaries that a profile is built from

It imports neither the calculator nor the file format.
"""
