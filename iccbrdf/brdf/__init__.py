"""The science in float64 NumPy: the independent reference that the profiles are checked against.

geometry           directions, half vector, cosines
cook_torrance      the Cook-Torrance models of both papers and their terms
ward               Ward's isotropic model
models             the table of models: names and order of parameters, `evaluate` by name
primaries          the file of measured primaries that a profile is built from
slopes             the file of colours printed on slopes, and the adjustment of a flat colour by it
interpolation      from a colour's XYZ to its parameters: the papers' method and a continuous one
colour_difference  CIELAB and CIEDE2000
fit                from goniometric measurements to parameters, and how far to trust them
fit_problem        what a fit compares; fit_solvers, fit_uncertainty, fit_diagnostics: its parts

It imports neither the calculator nor the file format.
"""
