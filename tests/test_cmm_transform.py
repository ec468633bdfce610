"""Applying a linked chain: shapes, numbers, run-time variables, threads, and what must not pass."""

import os
import pickle
import random
import struct
import warnings

import numpy as np
import pytest
from cmm_examples import TEXTS, matrix, mid, mvis, pixels, program, reference

import iccbrdf
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.build.pair import build_pair
from iccbrdf.calc.program import Op
from iccbrdf.cmm.execution import MAX_VALUES, TILE
from iccbrdf.errors import IccBrdfError, InputError, LimitError, ProfileError, UnsupportedError, VariableError
from iccbrdf.icc import Calculator, Header, Matrix, MultiProcess, NumberArray, Profile, UnknownElement
from iccbrdf.resources import folder

# The reference tools overstate the size of a calculator's function.
pytestmark = pytest.mark.filterwarnings("ignore::iccbrdf.ProfileWarning")


@pytest.fixture(scope="module")
def pair():
    built = build_pair(read_primaries(folder("profiles") / "fogra39_gloss" / "primaries.json"))
    return [built.mid, built.mvis]


def device(count, seed=1):
    """Binding MID: parameters, then normals that lean towards the viewer."""
    values = pixels(10, count, seed=seed, low=0.1)
    values[:, 7:9] = 0.35 + 0.3 * values[:, 7:9]
    values[:, 9] = 0.9
    return values


# Arrays --------------------------------------------------------------------------------------------------


def test_agrees_with_the_reference_implementation(pair, tmp_path):
    values = device(500)
    found = iccbrdf.link(pair)(values)
    np.testing.assert_allclose(found, reference(tmp_path, pair, values, pcs="XYZ "), rtol=2e-6, atol=1e-7)
    assert (found > 0).all()


@pytest.mark.parametrize("shape", [(), (1,), (6,), (2, 3), (1, 2, 1, 3)])
def test_shapes(shape):
    values = pixels(3, 6).reshape(-1)[: 3 * int(np.prod(shape))].reshape(*shape, 3)
    found = iccbrdf.link([mid("abc"), mvis("cab")])(values)
    assert found.shape == (*shape, 3)
    assert np.array_equal(found, values[..., [2, 0, 1]])


@pytest.mark.parametrize("shape", [(0,), (0, 5), (5, 0)])
@pytest.mark.parametrize("threads", [1, 2])
def test_empty_arrays(pair, shape, threads):
    found = iccbrdf.link(pair, threads=threads)(np.empty((*shape, 10)))
    assert (found.shape, found.dtype) == ((*shape, 3), np.float32)


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint64", "float16", "float64", ">f4"])
def test_numbers_of_any_type_are_taken_as_they_are(dtype):
    found = iccbrdf.link([mid("ab", matrix([[2, 0], [0, 1]], [0, -1]))])(np.array([[3, 200]], dtype))
    assert found.dtype == np.float32
    assert found.tolist() == [[6, 199]]


def test_views_are_read_and_left_alone():
    values = pixels(6, 8)
    before = values.copy()
    found = iccbrdf.link([mid("abc"), mvis("abc")])(values[::-2, ::2])
    assert np.array_equal(found, before[::-2, ::2])
    found[:] = 9
    assert np.array_equal(values, before)


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.zeros((5, 2)), r"shape \(5, 2\), expected \(\.\.\., 3\): a, b, c"),
        (np.zeros(4), r"shape \(4,\), expected \(\.\.\., 3\)"),
        (0.5, r"shape \(\)"),
        (np.zeros((0, 2)), r"shape \(0, 2\)"),
        (np.zeros((5, 3), complex), "complex128, expected real numbers"),
        (np.zeros((5, 3), bool), "bool, expected real numbers"),
        ([["a", "b", "c"]], "expected real numbers"),
        ([None, None, None], "object, expected real numbers"),
        ([[1, 2, 3], [1, 2]], "cannot be read"),
    ],
)
def test_arrays_that_do_not_fit(array, message):
    with pytest.raises(InputError, match=message):
        iccbrdf.link([mid("abc")])(array)


def test_double_precision(pair):
    values = device(50).astype(float)
    single, double = iccbrdf.link(pair)(values), iccbrdf.link(pair, dtype=np.float64)(values)
    assert double.dtype == np.float64
    np.testing.assert_allclose(single, double, rtol=2e-5)
    assert not np.array_equal(single, double.astype(np.float32))
    third = iccbrdf.link([mid("a", program("in(0) 3 div out(0)", 1, 1))], dtype="float64")
    assert third([1]).tolist() == [1 / 3]


def test_values_beyond_float32_and_no_numbers_pass_without_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = iccbrdf.link([mid("abc", MultiProcess(3, 3, ()))])([1e300, -np.inf, np.nan])
    assert found.tolist()[:2] == [np.inf, -np.inf]
    assert np.isnan(found[2])


def test_uniform_results_fill_every_pixel():
    found = iccbrdf.link([mid("a"), mvis("abc", defaults=NumberArray("fl32", [0, 2, 3]))])(np.ones((4, 1)))
    assert found.tolist() == [[1, 2, 3]] * 4


# Tiles, threads, processes -------------------------------------------------------------------------------


def test_tiles_and_threads_make_no_difference(pair):
    values = device(2 * TILE + 7)
    whole = iccbrdf.link(pair)(values)
    assert np.array_equal(iccbrdf.link(pair, threads=3)(values), whole)
    for i in (0, TILE - 1, TILE, 2 * TILE, 2 * TILE + 6):
        assert np.array_equal(iccbrdf.link(pair)(values[i]), whole[i])


def test_a_program_of_many_registers_runs_in_small_tiles():
    """The deepest stack that there may be, whose 65535 sums would take 4 GB on a full tile."""
    half = 32767
    deep = mid("a", program(f"in(0) copy(1,{2 * half - 1}) add({half}) sum({half}) out(0)", 1, 1))
    transform = iccbrdf.link([deep], backend="interpreter")
    assert max(step.registers for step in transform.steps) == 2 * half
    assert transform.execution.tile == MAX_VALUES // (2 * half)
    count = transform.execution.tile + 3
    assert np.array_equal(transform(np.ones((count, 1))), np.full((count, 1), 2 * half, np.float32))


def test_pickling(pair):
    transform = iccbrdf.link(pair, env={"litX": 0.3}, threads=2, dtype="float64")
    again = pickle.loads(pickle.dumps(transform))
    assert np.array_equal(again(device(20)), transform(device(20)))
    assert np.array_equal(
        again.with_env({"litX": 0.1})(device(20)), transform.with_env({"litX": 0.1})(device(20))
    )
    assert (again.channels_in, again.channels_out) == (transform.channels_in, transform.channels_out)
    assert (again.env, again.threads, again.backend) == ({"litX": 0.3}, 2, transform.backend)


# Run-time variables --------------------------------------------------------------------------------------


def test_variables_reach_every_profile_that_reads_them():
    here = mid("ab", program("env(x) if { } else { pop 5 } out(0) env(y) pop out(1)", 2, 2))
    there = mvis("ab", M2B0=program("in(0,2) env(z) pop out(0,3)", 2, 3))
    transform = iccbrdf.link([here, there])
    assert sorted(transform.variables) == ["x", "y", "z"]
    assert transform([0, 0]).tolist() == [5, 0, 0]
    assert iccbrdf.link([here, there], env={"z": 3, "x": -1})([0, 0]).tolist() == [-1, 0, 3]


def variable(text="env(litX) pop out(0)"):
    return mid("a", program(text, 1, 1))


def test_variables_of_an_existing_transform():
    first = iccbrdf.link([variable("env(a) pop env(b) pop sub out(0)")], env={"a": 8})
    second = first.with_env({"b": 3})
    third = second.with_env({"a": 1})
    assert [t([0]).tolist() for t in (first, second, third)] == [[8], [5], [-2]]
    assert first.env == {"a": 8}


def test_zeros_of_either_sign_are_different_variables():
    one = iccbrdf.link([variable("1 env(a) pop div out(0)")], env={"a": 0.0})
    other = one.with_env({"a": -0.0})
    assert [t([0]).tolist() for t in (one, other, one)] == [[np.inf], [-np.inf], [np.inf]]


@pytest.mark.parametrize("change", [lambda env: iccbrdf.link([variable()], env=env),
                                    lambda env: iccbrdf.link([variable()]).with_env(env)])  # fmt: skip
@pytest.mark.parametrize(
    ("env", "message"),
    [
        ({"litx": 1}, "'litx' is read by none of the profiles: did you mean 'litX'"),
        ({"vueZ": 1}, "'vueZ' is read by none of the profiles: valid are litX"),
        ({"true": 1}, "'true' is read by none"),
        ({"ndef": 1}, "'ndef' is read by none"),
        ({7: 1}, "7 is read by none"),
        ({"litX": np.nan}, "'litX': found nan, expected a finite number"),
        ({"litX": -np.inf}, "found -inf"),
        ({"litX": 1e39}, r"found 1e\+39, expected a finite number \(float32\)"),
        ({"litX": 10**400}, "expected a finite number"),
        ({"litX": "much"}, "found 'much'"),
        ({"litX": None}, "found None"),
        ({"litX": 1j}, "found 1j"),
        ([("litX", 1)], "expected a mapping from names to numbers"),
    ],
)
def test_variables_that_do_not_fit(change, env, message):
    with pytest.raises(VariableError, match=message) as error:
        change(env)
    assert error.value.exit_code == 2


def test_reserved_variables_are_not_listed():
    reserved = iccbrdf.link([variable("env(true) pop env(ndef) pop add out(0)")])
    assert reserved.variables == ()
    assert reserved([0]).tolist() == [1]
    with pytest.raises(VariableError, match="'true' is read by none of the profiles: there are none"):
        reserved.with_env({"true": 0})


# What must not pass --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("in(0) add out(0)", r"mid\.icc: tag A2M0: element 0 \(calc\).*stack underflow"),
        ("in(1) out(0)", "input channels"),
        ("in(0) mtx(0) out(0)", "sub-element 0"),
    ],
)
def test_a_broken_program_is_refused_before_any_pixel(text, message):
    with pytest.raises(ProfileError, match=message):
        iccbrdf.link([variable(text)])


def test_a_broken_block_is_refused():
    ops = (Op("in", 0), Op("if", 9), Op("in", 0), Op("out", 0))
    with pytest.raises(ProfileError, match="op 1"):
        iccbrdf.link([mid("a", MultiProcess.of(Calculator(1, 1, ops)))])


UNKNOWN = UnknownElement("matg", bytes(4), 1, 1, bytes(8))


def test_unknown_elements_are_refused_wherever_they_are():
    with pytest.raises(UnsupportedError, match=r"element 1 \(matg\) cannot run: did you mean 'matf'"):
        iccbrdf.link([mid("a", MultiProcess(1, 1, (Matrix.of([[1]]), UNKNOWN)))])
    inner = Calculator(
        1, 1, program("in(0) elem(0) out(0)", 1, 1, (UNKNOWN,)).elements[0].program, (UNKNOWN,)
    )
    outer = program("in(0) calc(0) out(0)", 1, 1, (inner,))
    place = r"element 0 \(calc\), sub-element 0 \(calc\), sub-element 0 \(matg\) cannot run"
    with pytest.raises(UnsupportedError, match=place):
        iccbrdf.link([mid("a", outer)])


@pytest.mark.parametrize(
    "process",
    [
        MultiProcess(1, 1, (Matrix(1, np.zeros((0, 1)), []), Matrix(0, None, [1]))),
        program("in(0) mtx(0) out(0)", 1, 1, (Matrix(0, None, [1]),)),
        program("calc(0) in(0) out(0)", 1, 1, (Calculator(0, 1, (Op("pi"), Op("out", 0))),)),
    ],
)
def test_elements_without_channels_are_refused(process):
    with pytest.raises(ProfileError, match="expected at least one"):
        iccbrdf.link([mid("a", process)])


def test_spaces_without_channels_are_refused():
    with pytest.raises(UnsupportedError, match="device space 'nc0000'"):
        iccbrdf.link([mid("", MultiProcess(0, 0, ()))])
    tags = {**TEXTS, "M2B0": MultiProcess.of(Matrix(0, None, [1, 2, 3]))}
    nothing = Profile(Header(device_class="mvis", pcs="XYZ ", mcs="mc0000"), tags)
    with pytest.raises(ProfileError, match=r"multiplex space 'mc0000', .* at least one channel"):
        iccbrdf.link([nothing])


def test_calculators_that_would_run_for_ever_are_refused():
    inner = Calculator(1, 1, program("in(0) out(0)", 1, 1).elements[0].program)
    for _ in range(12):
        text = "in(0) " + "calc(0) " * 8 + "out(0)"
        inner = program(text, 1, 1, (inner,)).elements[0]
    with pytest.raises(LimitError, match="operations"):
        iccbrdf.link([mid("a", MultiProcess.of(inner))])


def test_only_errors_of_our_own_leave_link_and_call(pair, tmp_path):
    """Random damage to files: each links and runs, or is refused."""
    draw = random.Random(int(os.environ.get("ICCBRDF_FUZZ_SEED", "1")))
    files = [profile.to_bytes() for profile in (*pair, mvis("abc", defaults=NumberArray("ui08", [1, 2, 3])))]
    chains = [(0, 1), (0,), (1,), (0, 2), (2,)]
    outcomes = {"ran": 0, "refused": 0}
    for _ in range(int(os.environ.get("ICCBRDF_FUZZ_COUNT", "250"))):
        damaged = [damage(draw, data) for data in files]
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", iccbrdf.ProfileWarning)
                chain = [Profile.from_bytes(damaged[i]) for i in draw.choice(chains)]
                transform = iccbrdf.link(chain, intent=draw.choice(["relative", "absolute"]))
                transform(pixels(len(transform.channels_in), 3, low=-2, high=2))
            outcomes["ran"] += 1
        except IccBrdfError:
            outcomes["refused"] += 1
    assert min(outcomes.values()) > 20


def damage(draw, data):
    """A few numbers replaced, most of them where structure is: the header, the tag table, heads of tags."""
    data = bytearray(data)
    tags = [struct.unpack(">I", data[132 + 12 * i + 4 :][:4])[0] for i in range(data[131])]
    for _ in range(draw.choice([0, 1, 1, 2])):
        start = draw.choice([0, 128, *tags, draw.randrange(len(data) - 64)])
        at = min(start + draw.randrange(64), len(data) - 4)
        size = draw.choice([1, 2, 4])
        value = draw.choice([0, 1, 2, 255, 2**15, draw.getrandbits(32)])
        data[at : at + size] = (value % 256**size).to_bytes(size, "big")
    return bytes(data)


def test_compiled_code_is_kept_under_another_light_and_left_out_of_pickles(pair):
    transform = iccbrdf.link(pair)
    execution = transform.execution
    assert transform.with_env({"litX": 0.2}).execution is execution
    again = pickle.loads(pickle.dumps(transform))
    assert "execution" not in again.__dict__
    assert again == transform
