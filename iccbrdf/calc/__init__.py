"""The calculator language of ICC.2: operators, programs, verifier, interpreter, compiler.

Knows no files and no BRDF.
"""

from typing import TYPE_CHECKING

from iccbrdf.calc.interpreter import run
from iccbrdf.calc.operators import OPERATORS
from iccbrdf.calc.program import Op, Program, decode_ops, encode_ops, listing, parse
from iccbrdf.calc.verify import Checked, verify, verify_element
from iccbrdf.lazy import lazy_names

if TYPE_CHECKING:
    from iccbrdf.calc.compiler import Compiled, compile_chain, compile_template

# Profiles are read and run far more often than templates are compiled, for which there is a grammar to load.
__getattr__ = lazy_names(
    __name__, dict.fromkeys(("Compiled", "compile_chain", "compile_template"), "iccbrdf.calc.compiler")
)

__all__ = [
    "OPERATORS",
    "Checked",
    "Compiled",
    "Op",
    "Program",
    "compile_chain",
    "compile_template",
    "decode_ops",
    "encode_ops",
    "listing",
    "parse",
    "run",
    "verify",
    "verify_element",
]
