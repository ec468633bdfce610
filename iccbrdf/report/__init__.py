"""Evaluation of fits, interpolation and slope adjustment as the papers do it; what accuracy costs in time.

print_data   the measurements that an evaluation needs, read and checked
appearance   one set of patches, measured and computed, and the differences between them
evaluation   the experiments of the 2020 and of the 2023 paper
papers       the papers' own figures
tables       the experiments as tables, the papers' figures beside ours
orderings    which of two methods is better, here and in the papers
plots        the experiments as pictures
cost_ways    the ways to one proof
cost_scene   the pixels that they are compared on, and what is exact for them
cost_runs    ways made ready to run
cost         their times and errors, and which of them to take
cost_tables, cost_plots   these as tables and as pictures

References
----------
-   [Habib2020] T. Habib, P. Green, P. Nussbaum: BRDF rendering by interpolation of optimised model
    parameters. Color and Imaging Conference 28, 2020.
-   [Habib2023] T. Habib, P. Green, P. Nussbaum: An appearance reproduction framework for printed 3D
    surfaces. Journal of Imaging Science and Technology, 2023.
"""

from iccbrdf.report.evaluation import Evaluation, evaluate_print
from iccbrdf.report.orderings import Ordering, orderings
from iccbrdf.report.print_data import PrintData, read_print
from iccbrdf.report.tables import Table, histograms, tables

__all__ = [
    "Evaluation",
    "Ordering",
    "PrintData",
    "Table",
    "evaluate_print",
    "histograms",
    "orderings",
    "read_print",
    "tables",
]
