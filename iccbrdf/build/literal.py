"""MVIS profiles that compute the models as the papers print them, to be compared with the stable ones."""

from __future__ import annotations

from iccbrdf.build.models import MODELS
from iccbrdf.build.pair import Pair
from iccbrdf.calc import Compiled, compile_template
from iccbrdf.icc import Calculator, MultiProcess, Profile
from iccbrdf.resources import folder


def literal_mvis(pair: Pair, model: str) -> tuple[Profile, Compiled]:
    """The MVIS of a pair with all effects, its program replaced by the literal one, which goes with its MID.

    model: key of `MODELS`.
    """
    path = folder("calc_templates") / MODELS[model].template.replace(".calc", "_literal.calc")
    compiled = compile_template(
        path.read_text(encoding="utf-8"),
        filename=path.name,
        constants=pair.compiled.constants,
        variables=pair.compiled.variables,
    )
    program = Calculator(inputs=len(compiled.inputs), outputs=3, program=compiled.program)
    return pair.mvis.replace(tags={"M2B0": MultiProcess.of(program)}), compiled
