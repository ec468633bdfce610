"""The functions that the language has by calc/library.calc, against sums of forty decimal digits."""

from __future__ import annotations

from decimal import Decimal, localcontext
from functools import cache

import numpy as np
import pytest
from hard_examples import variables

from iccbrdf.calc import compile_template, run
from iccbrdf.calc.program import Op
from iccbrdf.errors import InputError

TEMPLATE = """
model geometry
input normal[3] = n.x n.y n.z
runtime light = (litX: 0, litY: 0, litZ: 1)
runtime view = (vueX: 0, vueY: 0, vueZ: 1)
let both = cosines_and_half_vector(normal, light, view, {exact})
let cosines_alone = cosines(normal, light, view, {exact})
let h = half_vector(light, view, {exact})
output cos_i cos_v h.x h.y h.z = both
output i v = cosines_alone
output x y z = h
"""
ERROR = 2e-13
"""What is lost besides a few units of the last digit, of vectors that are scaled to length 1."""


@cache
def compiled(exact: int):
    return compile_template(TEMPLATE.format(exact=exact), filename="geometry.calc")


def geometry(exact, normals, light, view, dtype=np.float32):
    """cos theta_i, cos theta_v, h, the cosines alone, h alone: (n, 10) of normals (n, 3)."""
    program, env = compiled(exact).program, variables(light, view)
    found = run(program, list(normals.T.astype(dtype)), 10, dtype=dtype, env=env)
    return np.stack([np.broadcast_to(column, len(normals)) for column in found], axis=-1)


def decimals(vector):
    """A vector scaled to length 1, in forty digits."""
    exact = [Decimal(float(x)) for x in vector]
    length = sum(x * x for x in exact).sqrt()
    return [x / length for x in exact]


def expected(normals, light, view):
    """As `geometry`, from forty digits rounded to float64."""
    with localcontext() as context:
        context.prec = 40
        i, v = decimals(light), decimals(view)
        h = [a + b for a, b in zip(i, v, strict=True)]
        rows = []
        for normal in normals:
            n = decimals(normal)
            cosines = [sum(a * b for a, b in zip(n, other, strict=True)) for other in (i, v)]
            rows.append([float(x) for x in (*cosines, *h, *cosines, *h)])
    return np.array(rows)


def grazing_pairs(count, rng, least):
    """Lights, viewers and normals, float32: opposite sides of a surface, both grazing it; lengths vary."""
    for _ in range(count):
        axis, across = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
        low, other, aside = 10 ** rng.uniform(np.log10(least), -1.3, 3)
        light = across + low * axis
        view = other * axis - across + aside * np.cross(axis, across)
        normals = axis + np.cross(axis, across) * rng.normal(size=(4, 1)) * 10 ** rng.uniform(-4, -1, (4, 1))
        scales = 10 ** rng.uniform(-3, 3, 3)
        yield tuple(np.float32(x * scale) for x, scale in zip((light, view, normals), scales, strict=True))


def test_cosines_and_half_vector_keep_their_digits():
    rng = np.random.default_rng(1)
    plain_error = exact_error = 0.0
    for light, view, normals in grazing_pairs(400, rng, 1e-7):
        wanted = expected(normals, light, view)
        found = geometry(1, normals, light, view)
        # The half vector's digits are those of its length, as its directions are what counts.
        size = np.abs(wanted)
        size[:, 2:5] = size[:, 7:] = np.linalg.norm(wanted[:, 7:], axis=1)[:, None]
        used = np.all(wanted[:, :2] < 1 / 16 - 1e-6, axis=1)
        error = (np.abs(found - wanted) - ERROR) / size
        exact_error = max(exact_error, error[used].max())
        plain = np.abs(geometry(0, normals, light, view) - wanted) / size
        plain_error = max(plain_error, plain[used].max())
    assert exact_error < 1e-6
    assert plain_error > 0.1


def test_no_length_is_too_awkward():
    """Powers of 2 and their neighbours, where a length rounded to one digit may go either way."""
    lengths = [2.0**k for k in (-30, -3, 0, 1, 20)]
    lengths += [length * (1 + k * 2.0**-24) for length in lengths for k in (-3, -2, -1, 2, 4)]
    lengths += [1.25 * 2.0**-k for k in (1, 2)] + [1.6, np.nextafter(np.float32(1.6), np.float32(2))]
    rng = np.random.default_rng(2)
    (light, view, normals), *_ = grazing_pairs(1, rng, 1e-6)
    light, view = (x.astype(np.float64) / np.linalg.norm(x.astype(np.float64)) for x in (light, view))
    for length in lengths:
        for k in range(40):
            turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            one, other = (np.float32(turn @ x * length) for x in (light, view))
            found = geometry(1, normals @ np.float32(turn.T), one, other)[0, 7:]
            wanted = expected(normals[:1], one, other)[0, 7:]
            assert np.abs(found - wanted).max() <= ERROR + 1e-6 * np.linalg.norm(wanted), (length, k)


def test_plain_and_exact_are_one_where_nothing_is_grazed():
    rng = np.random.default_rng(3)
    light, view = np.float32([0.3, 0.1, 0.9]), np.float32([-0.5, 0.2, 0.8])
    normals = rng.normal(size=(500, 3)) * [0.3, 0.3, 0] + [0, 0, 1]
    np.testing.assert_array_equal(
        geometry(0, normals, light, view), geometry(1, normals, light, view), strict=True
    )


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_change_from_one_to_the_other_is_none(dtype):
    light, view = np.float32([0, 0, 1]), np.float32([0.2, 0.1, 0.9])
    cosine = 1 / 16 + np.linspace(-1e-4, 1e-4, 2001)
    normals = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, cosine], axis=1)
    found = geometry(1, normals, light, view, dtype)[:, :2].astype(np.float64)
    steps = np.diff(found, axis=0)
    usual = np.diff(expected(normals.astype(dtype), light, view)[:, :2], axis=0)
    assert np.abs(steps - usual).max() < 4 * np.finfo(dtype).eps


def test_float64_is_as_good_as_it_was():
    rng = np.random.default_rng(4)
    for light, view, normals in grazing_pairs(50, rng, 1e-5):
        wanted = expected(normals, light, view)
        error = np.abs(geometry(1, normals, light, view, np.float64) - wanted)
        assert error.max() < 1e-15


def test_vectors_of_no_length_give_0():
    nothing, up = np.zeros(3, np.float32), np.float32([0, 0, 1])
    assert np.all(geometry(1, np.zeros((1, 3)), up, up)[0, [0, 1, 5, 6]] == 0)
    found = geometry(1, up[None], nothing, up)
    assert np.isfinite(found).all()
    assert found[0, 0] == found[0, 5] == 0


def test_the_plain_program_holds_nothing_of_the_exact_one():
    exact, plain = (compiled(exact) for exact in (1, 0))
    assert plain.executed < exact.executed / 4
    digits = Op("data", int(np.float32(3072).view(np.uint32)))
    assert digits in exact.program
    assert digits not in plain.program


def test_what_is_not_meant_for_templates_is_not_proposed():
    with pytest.raises(InputError, match=r"'half_vektor'.*did you mean 'half_vector'"):
        compile_template("model t\noutput X = half_vektor(1)", filename="t.calc")
    with pytest.raises(InputError, match=r"valid are|did you mean") as error:
        compile_template("model t\noutput X = scaled(1)", filename="t.calc")
    assert "_scaled" not in str(error.value)
