"""Is a profile sound?  Findings by rule, each with its place, its severity and the clause behind it.

A further source of findings is a function from a `Subject` to findings: its rules go into the table of
`rules`, the function into `report.CHECKS`, or into the `checks` of a call where it is asked for alone.
"""

from iccbrdf.validate.findings import Finding, Place
from iccbrdf.validate.numeric import channels_and_variables, check_numeric, only_mid
from iccbrdf.validate.report import CHECKS, Check, Report, validate, validate_pair
from iccbrdf.validate.rules import RULES, SEVERITIES, Rule
from iccbrdf.validate.subject import Subject

__all__ = [
    "CHECKS",
    "RULES",
    "SEVERITIES",
    "Check",
    "Finding",
    "Place",
    "Report",
    "Rule",
    "Subject",
    "channels_and_variables",
    "check_numeric",
    "only_mid",
    "validate",
    "validate_pair",
]
