"""MVIS profiles that compute the models as the papers print them, to be compared with the stable ones."""

from __future__ import annotations

from iccbrdf.build.models import MODELS
from iccbrdf.build.pair import PROGRAM_TAG, Pair
from iccbrdf.build.source import calculator_source, source_tags
from iccbrdf.calc import Compiled, compile_template
from iccbrdf.icc import Calculator, MultiProcess, Profile
from iccbrdf.resources import folder


def literal_mvis(pair: Pair, model: str) -> tuple[Profile, Compiled]:
    """The MVIS of a pair with all effects, its program replaced by the literal one, which goes with its MID.

    model: key of `MODELS`.
    """
    path = folder("calc_templates") / MODELS[model].template.replace(".calc", "_literal.calc")
    # The papers' formulas are in one geometry, as printed.
    constants = {name: value for name, value in pair.compiled.constants.items() if name != "geometry"}
    compiled = compile_template(
        path.read_text(encoding="utf-8"),
        filename=path.name,
        constants=constants,
        variables=pair.compiled.variables,
    )
    program = Calculator(inputs=len(compiled.inputs), outputs=3, program=compiled.program)
    source = source_tags({}, calculator_source(compiled, PROGRAM_TAG))
    return pair.mvis.replace(tags={PROGRAM_TAG: MultiProcess.of(program), **source}), compiled
