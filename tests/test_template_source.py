"""The template language: what is accepted, and what the messages say about what is not."""

import re

import numpy as np
import pytest

from iccbrdf.calc.compiler import compile_chain, compile_template
from iccbrdf.calc.interpreter import run
from iccbrdf.calc.source import Effect, Input, Output, When, parse
from iccbrdf.errors import InputError, LimitError

HEAD = "model test\n"


def compiled(body, **settings):
    return compile_template(HEAD + body, filename="t.calc", **settings)


def value(expression, *channels, declarations="", env=None, width=1):
    """The value in float64 of an expression of the input channels a, b, c..."""
    inputs = "".join(f"input {name}\n" for name, _ in zip("abcdef", channels, strict=False))
    names = " ".join(f"out{k}" for k in range(width))
    result = compiled(f"{inputs}{declarations}\noutput {names} = {expression}\n")
    outputs = run(result.program, [np.float64(c) for c in channels], width, env=env or {}, dtype=np.float64)
    return float(outputs[0]) if width == 1 else [float(v) for v in outputs]


def message(body, **settings):
    with pytest.raises(InputError) as error:
        compiled(body, **settings)
    return str(error.value)


def test_declarations_become_statements_with_places():
    template = parse(
        "# A model\n#\n# of [X].\n\nmodel a\neffect shine = off\n"
        "when shine {\n    input k[3] = k.X k.Y k.Z default 1\n} else { input k }\noutput X = 2 # done\n",
        "a.calc",
    )
    assert template.documentation == "A model\n\nof [X]."
    effect, when, output = template.statements[1:]
    assert isinstance(effect, Effect)
    assert not effect.on
    assert isinstance(when, When)
    (declared,) = when.then
    assert isinstance(declared, Input)
    assert (declared.channels, declared.width) == (("k.X", "k.Y", "k.Z"), 3)
    assert when.otherwise[0].channels == ("k",)
    assert isinstance(output, Output)
    assert (output.place.line, output.place.column) == (10, 1)
    assert len(list(template.all_statements())) == 6


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("2 + 3 * 4", 14),
        ("2 - 3 - 4", -5),
        ("24 / 4 / 2", 3),
        ("-2^2", -4),
        ("2^3^2", 512),
        ("2^-1", 0.5),
        ("(1 + 2) * 3", 9),
        ("1 < 2 and not 3 < 2 or 1 == 2", 1),
        ("not (1 <= 1)", 0),
        ("1 != 1", 0),
        ("if 1 >= 2 { 5 } else if 2 > 1 { 6 } else { 7 }", 6),
        ("1 + if 0 { 1 } else {\n let x = 2\n let y = x * 3\n y\n}", 7),
        ("sum((1,\n 2, # a comment\n\n 3))", 6),
        ("1.5e1 + 2E-1", 15.2),
        ("(4, 5, 6).y * (4, 5, 6)[2]", 30),
        ("dot((1, 2, 3), (4, 5, 6))", 32),
        ("norm((2, 3, 6))", 7),
        ("product((2, 3, 4))", 24),
        ("min((5, 2, 3)) + max((5, 2, 3))", 7),
        ("min(2, 3) - max(2, 3)", -1),
        ("clamp(5, 0, 1) + clamp(-5, 0, 1) + clamp(0.5, 0, 1)", 1.5),
        ("log(exp(2)) + log10(100)", 4),
        ("atan2(1, -1) / pi", 0.75),
        ("mod(-5.5, 2)", -1.5),
        ("cbrt(-8) + sqrt(16) + abs(-1) + sign(-7)", 2),
        ("floor(1.7) + ceil(1.2) + trunc(-1.7) + round(2.5)", 5),
        ("sin(1)^2 + cos(1)^2 + tan(0)", 1),
    ],
)
def test_expressions(expression, expected):
    assert value(expression) == pytest.approx(expected, rel=1e-6)
    # The same with every number out of the compiler's sight.
    number = re.compile(r"(?<![\w.\[])\d[\d.]*(?:[eE][+-]?\d+)?")
    numbers = list(dict.fromkeys(number.findall(expression)))
    hidden = number.sub(lambda found: f"k[{numbers.index(found[0])}]", expression)
    names = " ".join(f"k{i}" for i in range(len(numbers) + 1))
    result = compiled(f"input k[{len(numbers) + 1}] = {names}\noutput X = {hidden}\n")
    channels = [np.float64(n) for n in [*numbers, 0]]
    (output,) = run(result.program, channels, 1, dtype=np.float64)
    assert float(output) == pytest.approx(expected, rel=1e-12)


def test_vectors_and_scalars_go_together():
    assert value("(a, b, 1) * 2 - a", 3, 4, width=3) == [3, 5, -1]
    assert value("1 / (a, b)", 2, 4, width=2) == [0.5, 0.25]
    assert value("cross((1, 2, a), (b, 5, 6))", 3, 4, width=3) == np.cross([1, 2, 3], [4, 5, 6]).tolist()
    assert value("rotl((a, 2, 3), 2)", 1, width=3) == [3, 1, 2]
    assert value("min((a, 5, 0), 2)", 1, width=3) == [1, 2, 0]
    assert value("((a, 2), 3, (4, 5))", 1, width=5) == [1, 2, 3, 4, 5]
    assert value("if a > 0 { (1, 2) } else { 0 }", -1, width=2) == [0, 0]
    assert value("0", width=3) == [0, 0, 0]


def test_normalize_makes_unit_vectors_and_leaves_zero():
    assert value("normalize((a, 0, b))", 3, 4, width=3) == pytest.approx([0.6, 0, 0.8], rel=1e-15)
    assert value("normalize((a, 0, 0))", 0, width=3) == [0, 0, 0]


def test_functions_see_what_was_defined_before_them():
    declarations = "let k = 10\ndef twice(x) = 2 * x\ndef f(a, y) {\n    let z = twice(y)\n    a * z + k\n}"
    assert value("f(3, a) + a", 5, declarations=declarations) == 45


def test_run_time_variables_have_defaults_one_by_one():
    declarations = "runtime light = (litX: -1, litY: 0, litZ: 2.5)\nruntime litI = pi"
    expression = "(light, litI)"
    assert value(expression, declarations=declarations, width=4) == pytest.approx([-1, 0, 2.5, np.pi])
    env = {"litX": 0.0, "litY": 7.0, "litI": -1.0}
    assert value(expression, declarations=declarations, width=4, env=env) == [0, 7, 2.5, -1]
    result = compiled(f"{declarations}\noutput X = litI + light.x\n")
    assert result.variables == {"litX": -1, "litY": 0, "litZ": 2.5, "litI": np.pi}
    result = compiled(f"{declarations}\noutput X = litI + light.x\n", variables={"litI": 2, "litX": 0.5})
    assert result.variables == {"litX": 0.5, "litY": 0, "litZ": 2.5, "litI": 2}
    assert float(run(result.program, [], 1)[0]) == 2.5


def test_constants_choices_and_effects_are_set_from_outside():
    body = (
        "effect shine = on\neffect blur = off\nconstant n = 1.5\nconstant white = (0.9, 1, 0.8)\n"
        "choice angle = first | second\n"
        "input k[3] = k.X k.Y k.Z default white * 2\n"
        "when shine { let a = n } else { let a = -n }\n"
        "when angle is second { let b = 10 } else { let b = 20 }\noutput X = a + b\n"
    )

    def result(**settings):
        program = compiled(body, **settings).program
        return float(run(program, [0, 0, 0], 1)[0])

    assert result() == 21.5
    assert result(constants={"n": 2}) == 22
    assert result(constants={"angle": "second"}, effects={"shine": False}) == 8.5
    plain = compiled(body)
    assert plain.inputs == ("k.X", "k.Y", "k.Z")
    assert plain.defaults == (1.8, 2, 1.6)
    assert plain.effects == {"shine": True, "blur": False}
    assert plain.constants == {"n": (1.5,), "white": (0.9, 1, 0.8), "angle": "first"}
    assert compiled(body, constants={"white": np.array([1, 2, 3])}).defaults == (2, 4, 6)


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("lett a = 1", "t.calc:2:1: found 'lett', expected one of 'choice'"),
        ("lett a = 1", "did you mean 'let'?"),
        ("output X = 1 +", "t.calc:2:15: found the end of the line, expected one of"),
        ("output X = (1", "t.calc:2:13: found the end of the template, expected one of ')' ','"),
        ("output X = 1 ? 2", "t.calc:2:14: found '?', which no part of the language begins with"),
        ("effect a = onn", "t.calc:2:12: found 'onn', expected one of 'off' 'on'; did you mean 'on'?"),
        ("output X = if 1 { 2 }", "t.calc:2:22: found the end of the line, expected 'else'"),
        ("let = 3", "t.calc:2:5: found '=', expected a name"),
        ("let a = 1 2", "t.calc:2:11: found '2', expected one of"),
        ("input kd[3] = kd.X kd.Y", "t.calc:2:1: input kd has 3 component(s) but 2 channel(s)"),
        ("input kd[1.5] = a", "t.calc:2:10: found '1.5', expected a whole number"),
        ("let kd = 1\noutput X = kb", "t.calc:3:12: nothing is named 'kb'; did you mean 'kd'?"),
        ("output X = squirt(2)", "t.calc:2:12: no function is named 'squirt'; did you mean 'sqrt'?"),
        ("output X = dot(2)", "t.calc:2:12: dot has 1 argument(s), expected 2"),
        ("output X = min(1, 2, 3)", "min has 3 argument(s), expected 1 or 2"),
        ("output X = (1, 2) + (1, 2, 3)", "t.calc:2:19: '+' of vectors of 2 and 3 components"),
        ("output X Y = (1, 2, 3)", "t.calc:2:1: found 3 components, expected 2"),
        ("output X = (1, 2).z", "found component z of a value of 2 component(s)"),
        ("output X = (1, 2).R", "t.calc:2:12: no component is named 'R'; valid are x, y, z, X, Y, Z"),
        ("output X = cross((1, 2), (1, 2))", "cross of 2 and 2 components, expected 3 and 3"),
        ("input a\noutput X = rotl((1, a), a)", "rotl by something else than a number from 1 to 1"),
        ("output X = if (1, 2) { 1 } else { 2 }", "the condition has 2 components, expected 1"),
        ("let a = 1\nlet a = 2", "t.calc:3:1: 'a' has a value already"),
        ("input a\ninput b = a", "t.calc:3:1: channel 'a' is read by an input already"),
        ("output X = 1\noutput X = 2", "t.calc:3:1: channel 'X' is written by an output already"),
        ("input a\ninput b default a", "the default of b depends on what only a run knows"),
        ("input b[3] = b.X b.Y b.Z default (1, 2)", "has 2 components, expected 1 or 3"),
        ("runtime light = 1", "'light' cannot be a run-time variable; expected at most 4 characters"),
        ("runtime true = 1", "'true' cannot be a run-time variable"),
        ("runtime litX = 1e39", "litX is 1e+39; expected 1 finite number (float32)"),
        ("input a default 1e39", "the default of a is (1e+39,); expected finite numbers (float32)"),
        ("runtime a = 1\nruntime b = (a: 1, c: 2)", "run-time variable 'a' is declared already"),
        ("runtime a = (1, 2)", "the default of a has 2 components, expected 1"),
        ("when shin { let a = 1 }", "t.calc:2:1: no effect 'shin' is declared"),
        ("choice a = b | c\nwhen a is d { let e = 1 }", "a is never 'd'; valid are b, c"),
        ("def f(x) = f(x)\noutput X = f(1)", "t.calc:2:12: f calls itself"),
        ("def min(x) = x", "t.calc:2:1: a function 'min' is there already"),
        ("let a = 1", "t.calc: no output"),
    ],
)
def test_errors_say_where_what_and_what_was_expected(body, expected):
    assert expected in message(body)


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"constants": {"refractive": 1}}, "no constant 'refractive' is declared; did you mean 'refraction"),
        ({"constants": {"refraction": (1, 2)}}, "t.calc:3:1: refraction is (1, 2); expected 1 finite numb"),
        ({"constants": {"refraction": float("nan")}}, "refraction is nan; expected 1 finite number(s)"),
        ({"constants": {"refraction": "2"}}, "refraction is '2'; expected 1 finite number(s)"),
        ({"constants": {"angle": "alhpa"}}, "t.calc:4:1: angle is 'alhpa'; did you mean 'alpha'?"),
        ({"effects": {"specula": True}}, "no effect 'specula' is declared; did you mean 'specular'?"),
        ({"variables": {"litx": 1}}, "no run-time variable 'litx' is declared; did you mean 'litX'?"),
        ({"variables": {"litX": float("inf")}}, "t.calc:5:1: litX is inf; expected 1 finite number"),
        ({"variables": {"litX": 1e39}}, "litX is 1e+39; expected 1 finite number (float32)"),
    ],
)
def test_unknown_settings_name_the_nearest(settings, expected):
    body = "effect specular = on\nconstant refraction = 1.5\nchoice angle = theta_i | alpha\n"
    body += "runtime litX = 1\noutput X = 1"
    assert expected in message(body, **settings)


def test_settings_of_a_side_that_is_not_chosen_are_known():
    body = "effect a = off\nwhen a { constant n = 1 }\noutput X = 1"
    assert compiled(body, constants={"n": 2}).constants == {}


def test_a_template_needs_a_name():
    with pytest.raises(InputError, match="no name; expected `model NAME`"):
        compile_template("output X = 1\n", filename="t.calc")


def test_deep_nesting_is_refused_and_long_chains_are_not():
    assert "nested too deeply" in message("output X = " + "-" * 5000 + "1")
    chain = "input a\n" + "".join(f"let x{k} = sin({f'x{k - 1}' if k else 'a'}) + 1\n" for k in range(1200))
    assert compiled(chain + "output X = x1199").executed == 3602


TABLES = "constant nodes[n, 3]\nconstant gloss[n, k]\nconstant angles[s]\n"
GIVEN = {
    "nodes": [[1, 2, 3], [4, 5, 6], [7, 8, 9], [10, 11, 12]],
    "gloss": np.array([[1, 2], [3, 4], [5, 6], [7, 8]]),
    "angles": (0, 15, 30),
}


def numbers(expression, width=1, **tables):
    """The value in float64 of an expression of the tables."""
    names = " ".join(f"out{k}" for k in range(width))
    body = f"{TABLES}output {names} = {expression}\n"
    program = compiled(body, constants={**GIVEN, **tables}).program
    return [float(v) for v in run(program, [], width, dtype=np.float64)]


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("(n, s, k)", [4, 3, 2]),
        ("nodes.Y", [2, 5, 8, 11]),
        ("nodes[n - 1]", [10, 11, 12]),
        ("nodes[1].z + nodes.X[2]", [13]),
        ("angles", [0, 15, 30]),
        ("angles[1:s] - angles[0:s - 1]", [15, 15]),
        ("gloss[0]", [1, 2]),
        ("(1, 0, 2, 0) @ nodes", [15, 18, 21]),
        ("2 * (1, 0, 2, 0) @ gloss / 2", [11, 14]),
        ("total i = 1 to n { i * i }", [30]),
        ("1 + total i = 0 to 1 {\n let a = angles[i:i + 2]\n a / 15\n}", [2, 4]),
        ("total i = 2 to 2 { angles }", [0, 15, 30]),
    ],
)
def test_tables_have_columns_rows_and_sums_of_rows(expression, expected):
    assert numbers(expression, len(expected)) == expected


DOUBLED = "let a0 = (x, 1)\n" + "".join(f"let a{k + 1} = (a{k}, a{k})\n" for k in range(40))
NESTED = "let a0 = x\n" + "".join(
    f"let a{k + 1} = if x > {k} {{ a{k} * 3 }} else {{ x }}\n" for k in range(70)
)


@pytest.mark.parametrize(
    ("body", "found"),
    [
        ("output X = total k = 1 to 999999999 { x * k }", "asks for more than 131072 values up to here"),
        (DOUBLED + "output X = sum(a40)", "asks for more than 131072 values up to here"),
        (NESTED + "output X = a70", "conditions are nested more than 64 deep"),
        ("output X = total k = 1 to 9000 { sin(x * k) }", "values, expected 16384 at most"),
    ],
)
def test_templates_that_ask_for_too_much_are_refused(body, found):
    with pytest.raises(LimitError, match=found):
        compiled("input x\n" + body)


def test_chains_are_not_endless():
    with pytest.raises(LimitError, match="a chain of 17 templates, expected 16 at most"):
        compile_chain([("model a\noutput X = 1", "a.calc")] * 17)


def test_tables_are_as_long_as_what_is_given():
    assert numbers("angles[s - 1]", angles=range(17)) == [16]
    assert numbers("(n, nodes.Z[0])", 2, nodes=np.ones((1, 3)), gloss=[[1]]) == [1, 1]
    result = compiled(TABLES + "output X = nodes.X[0]", constants=GIVEN)
    assert result.constants["gloss"] == ((1, 2), (3, 4), (5, 6), (7, 8))
    assert result.constants["angles"] == (0, 15, 30)


def test_polar_and_lab_give_one_plane_after_the_other():
    assert value("polar((a, 1), b)", 0.0, -2.0, width=4) == pytest.approx([2, 5**0.5, 270, 296.565051177])
    assert value("lab((a, 1), (1, 1), (1, b))", 1.0, 1.0, width=6) == pytest.approx(
        [100, 100, 0, 0, 0, 0], abs=1e-12
    )


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("nodes", "t.calc:6:12: nodes is a table of rows; expected a column (nodes.X), a row (nodes[0])"),
        ("angles.x @ angles", "found '@' before something else than the name of a table of rows"),
        ("angles @ nodes", "t.calc:6:19: found 3 component(s) before '@', expected 4, one for each row"),
        ("gloss.Z[0]", "t.calc:6:12: found column Z of a table of 2 column(s)"),
        ("nodes[4].x", "t.calc:6:12: found row 4 of a table of 4 row(s)"),
        ("angles[0.5]", "t.calc:6:19: the index is 0.5, expected a whole number"),
        ("angles[angles]", "the index is 0, 15, 30, expected a whole number"),
        ("angles[a]", "the index depends on what only a run knows; expected constants"),
        ("angles[3]", "found component 3 of a value of 3 component(s)"),
        ("angles[2:2]", "t.calc:6:12: found components 2 up to 2 of a value of 3 component(s)"),
        ("angles[0:4]", "found components 0 up to 4 of a value of 3 component(s)"),
        ("total i = 2 to 1 { i }", "t.calc:6:12: a total from 2 to 1 has nothing to add up"),
        ("total s = 1 to 2 { s }", "t.calc:6:12: 's' has a value already"),
        ("total i = 2 to 3 { angles[0:i] }", "'total' of vectors of 2 and 3 components"),
    ],
)
def test_errors_of_tables_say_where_and_what(expression, expected):
    assert expected in message(f"{TABLES}input a\noutput X = {expression}\n", constants=GIVEN)


@pytest.mark.parametrize(
    ("tables", "expected"),
    [
        ({"nodes": None}, "t.calc:2:1: nodes is not given; expected finite numbers of shape (n, 3)"),
        ({"nodes": [1, 2, 3]}, "nodes is [1, 2, 3]; expected finite numbers of shape (n, 3)"),
        ({"nodes": [[1, 2], [3]]}, "expected finite numbers of shape (n, 3)"),
        ({"nodes": [[1, 2, np.inf]]}, "expected finite numbers of shape (n, 3)"),
        ({"nodes": np.ones((4, 2))}, "t.calc:2:1: nodes has 2 columns, expected 3"),
        ({"gloss": np.ones((5, 2))}, "t.calc:3:1: gloss has 5 rows, expected 4, as nodes has"),
        ({"angles": []}, "angles is []; expected finite numbers of shape (s)"),
        ({"angels": [1]}, "no constant 'angels' is declared; did you mean 'angles'?"),
    ],
)
def test_tables_that_do_not_fit_are_refused(tables, expected):
    given = {name: values for name, values in {**GIVEN, **tables}.items() if values is not None}
    assert expected in message(TABLES + "output X = 1\n", constants=given)


def chain(*bodies, **settings):
    templates = [(f"model m{k}\n{body}\n", f"{k}.calc") for k, body in enumerate(bodies)]
    return compile_chain(templates, **settings)


def test_a_chain_wires_channels_by_name():
    result = chain(
        "input X default 5\ninput w\noutput Y X = (X + 1, X * 10)",
        "input a[3] = w X b default 7\noutput c b = (sum(a), a.x)",
        "input b\ninput w\ninput c\noutput r s t = (b, w, c)",
    )
    # b is read by the second before it writes it, w passes by all, Y goes nowhere.
    assert result.inputs == ("X", "w", "b")
    assert result.defaults == (5, 0, 7)
    assert result.outputs == ("r", "s", "t")
    assert result.model == "m0 m1 m2"
    assert [float(v) for v in run(result.program, [2, 3, 4], 3)] == [3, 3, 27]
    assert "add" not in {op.name for op in chain("input X\noutput Y = X + 1", "output Z = 2").program}


def test_settings_go_to_all_templates_of_a_chain_that_know_them():
    first = (
        "constant white = 2\nchoice way = up | down\neffect on_first = on\nruntime lit = 1\noutput X = white"
    )
    second = "constant white = 3\nruntime lit = 4\ninput X\noutput Y Z = (X * white, lit)"
    result = chain(first, second, constants={"white": 5, "way": "down"}, variables={"lit": 6})
    assert [float(v) for v in run(result.program, [], 2)] == [25, 6]
    assert result.variables == {"lit": 6}
    assert result.constants == {"white": (5,), "way": "down"}
    assert [float(v) for v in run(chain(first, second).program, [], 2)] == [6, 4]
    with pytest.raises(InputError, match=r"0\.calc, 1\.calc: no constant 'whit' .* mean 'white'"):
        chain(first, second, constants={"whit": 1})
    with pytest.raises(InputError, match=r"1\.calc:2:12: nothing is named 'a'"):
        chain("let a = 1\noutput X = a", "output X = a")
    with pytest.raises(InputError, match="no template to compile"):
        compile_chain([])
