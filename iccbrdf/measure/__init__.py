"""Measurements: files of goniometers and spectrophotometers, spectra to XYZ, and a synthetic goniometer.

measurements   what a file holds, and the report of it
declarations   what a file's numbers are: units, quantity, scale, names of columns
tables         CSV, TSV, CGATS and Cornell text -> rows and columns
columns        which column is what
reader         any of the files -> Measurements, by its declarations
writer         Measurements -> our own CSV, whose header declares everything
colorimetry    spectra and CIELAB to XYZ

Nothing below is measured; it stands in for goniometric measurements of CMYK prints, which are not public:

fogra39          colours of paper, solids and test patches
smooth_spectra   XYZ -> spectra
reflection       GGX, exact Fresnel term, rough diffuse base: not the models that are fitted
synthetic_print  halftones of FOGRA39 on flat and slope
goniometer       geometries, aperture, noise
simulation       the files of `iccbrdf simulate`
"""

from iccbrdf.measure.colorimetry import under
from iccbrdf.measure.declarations import parse_declarations, read_declarations
from iccbrdf.measure.measurements import Measurements, report, report_text
from iccbrdf.measure.reader import read_measurements
from iccbrdf.measure.writer import write_measurements

__all__ = [
    "Measurements",
    "parse_declarations",
    "read_declarations",
    "read_measurements",
    "report",
    "report_text",
    "under",
    "write_measurements",
]
