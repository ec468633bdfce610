"""The calculator language of ICC.2: operators, programs, verifier, interpreter, compiler.

Knows no files and no BRDF.
"""

from iccbrdf.calc.compiler import Compiled, compile_chain, compile_template
from iccbrdf.calc.interpreter import run
from iccbrdf.calc.operators import OPERATORS
from iccbrdf.calc.program import Op, Program, decode_ops, encode_ops, listing, parse
from iccbrdf.calc.verify import Checked, verify, verify_element

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
