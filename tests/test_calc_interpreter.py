"""The stack machine: branches on tiles, memory, run-time variables, and tiles against single pixels."""

import numpy as np
import pytest
from calc_programs import INPUTS, OUTPUTS, random_program

from iccbrdf.calc.interpreter import run
from iccbrdf.calc.program import parse

EDGES = np.array([0.0, -0.0, 0.5, 0.49, 1.0, -1.5, 2.0, 1e30, np.inf, -np.inf, np.nan, 3e-7])


def execute(text, *channels, n_out=1, **options):
    return run(parse(text), channels, n_out, **options)


def tile(values, size):
    return np.broadcast_to(values, size)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("seed", range(60))
def test_a_tile_is_its_pixels_one_by_one(seed, dtype):
    """Merging branches with masks gives what each pixel gets that runs alone."""
    program = random_program(seed, 40)
    draw = np.random.default_rng(seed)
    pixels = draw.choice(np.concatenate([EDGES, draw.normal(size=6)]), (INPUTS, 24)).astype(dtype)
    env = {"litX": 0.75}
    tiles = run(program, list(pixels), OUTPUTS, env=env, dtype=dtype)
    for index, pixel in enumerate(pixels.T):
        alone = run(program, list(pixel), OUTPUTS, env=env, dtype=dtype)
        together = [tile(value, 24)[index] for value in tiles]
        np.testing.assert_array_equal(together, alone)


def test_branch_per_pixel():
    (out,) = execute("in(0) if { in(1) 2 mul } else { in(1) neg } out(0)", [0, 1, 0.5, np.nan], [1, 2, 3, 4])
    np.testing.assert_array_equal(out, [-1, 4, 6, -4])
    assert out.dtype == np.float32


def test_a_side_that_no_pixel_takes_does_not_run():
    # the other side would turn the uniform result into a tile
    (out,) = execute("in(0) if { 7 } else { in(0) } out(0)", [1.0, 0.5])
    assert np.ndim(out) == 0
    (out,) = execute("1 if { in(0) } else { 7 } out(0)", [3.0, 4.0])
    np.testing.assert_array_equal(out, [3, 4])


def test_untouched_state_stays_uniform_over_a_branch():
    outs = execute("5 6 tput(0) in(0) if { 1 out(1) } out(0) tget(0) out(2)", [0.0, 1.0], n_out=3)
    assert [np.ndim(out) for out in outs] == [0, 1, 0]
    assert (outs[0], outs[2]) == (5, 6)
    np.testing.assert_array_equal(outs[1], [0, 1])


def test_temporaries_written_on_one_side_are_zero_on_the_other():
    (out,) = execute("in(0) if { 5 tput(9) } tget(9) out(0)", [1, 0])
    np.testing.assert_array_equal(out, [5, 0])
    (out,) = execute("in(0) sel case { 5 tput(9) } dflt { 6 tput(8) } tget(9) out(0)", [0, 3, 0])
    np.testing.assert_array_equal(out, [5, 0, 5])


def test_temporaries_start_at_zero_in_every_run():
    program = parse("tget(3) out(0) 4 tput(3)")
    assert run(program, [], 1) == run(program, [], 1) == [0]


def test_sides_that_leave_different_depths_are_aligned_at_the_top():
    text = "1 2 in(0) if { 5 } else { 6 7 8 } out(0)"
    (out,) = execute(text, [1, 0])
    np.testing.assert_array_equal(out, [5, 8])
    below, top = execute("1 2 in(0) if { 5 } out(0,2)", [1, 0], n_out=2)
    np.testing.assert_array_equal([below, top], [[2, 1], [5, 2]])


def test_stack_count_remembers_what_a_merge_cut_off():
    (out,) = execute("1 2 in(0) if { 5 } else { 6 7 8 } scnt out(0)", [1, 0])
    np.testing.assert_array_equal(out, [3, 5])


def test_selection_per_pixel():
    text = "7 in(0) sel case { 1 add } case { 2 add } case { 3 add } out(0)"
    (out,) = execute(text, [0, 1, 2, 3, -1, np.nan, 0.5, -0.4, np.inf])
    np.testing.assert_array_equal(out, [8, 9, 10, 7, 7, 7, 9, 8, 7])


def test_nested_branches():
    text = """in(0) 0 gt if { in(1) 0 gt if { 1 } else { 2 } }
              else { in(1) sel case { 3 } case { in(0) if { 9 } else { 4 } } dflt { 5 } } out(0)"""
    (out,) = execute(text, [1, 1, 0, 0, -1], [1, 0, 0, 1, 7])
    np.testing.assert_array_equal(out, [1, 2, 3, 4, 5])


def test_outputs_are_preset_to_zero_and_later_writes_win():
    outs = execute("1 2 out(0,2) 3 out(1)", n_out=3)
    assert outs == [1, 3, 0]


def test_inputs_are_not_clipped_or_changed():
    x = np.array([-3.0, 7.0], np.float32)
    (out,) = execute("in(0) 1 tput(0) tget(0) add out(0)", x)
    np.testing.assert_array_equal(out, [-2, 8])
    np.testing.assert_array_equal(x, [-3, 7])


def test_variables_have_blanks_at_their_end():
    env = {"a": 2.5, "ab  ": 3.0}
    outs = execute("env(a) out(0,2) env(ab) out(2,2) env(b) out(4,2)", n_out=6, env=env)
    assert outs == [2.5, 1, 3, 1, 0, 0]


def test_variables_cannot_redefine_constants():
    outs = execute("env(true) out(0,2) env(ndef) out(2,2)", n_out=4, env={"true": 9, "ndef": 9})
    assert outs == [1, 1, 0, 0]


def test_variable_with_a_default():
    text = "env(litX) if { } else { pop 5 } out(0)"
    assert execute(text) == [5]
    assert execute(text, env={"litX": -2.5}) == [-2.5]


def test_leftover_entries_are_ignored():
    assert execute("1 2 3 out(0)") == [3]


@pytest.mark.parametrize("dtype", [np.float32, np.float64, "float64", np.dtype(np.float32)])
def test_dtype_of_every_result(dtype):
    outs = execute("in(0) out(0) 0.1 out(1) env(true) pop out(2)", [1, 2], n_out=4, dtype=dtype)
    assert {out.dtype for out in outs} == {np.dtype(dtype)}


def test_float64_keeps_the_float32_constants_of_the_program():
    assert execute("0.1 out(0)", dtype=np.float64) == [float(np.float32(0.1))]


def test_a_tile_of_no_pixels():
    text = "in(0) if { in(0) } else { in(0) neg } sel case { 1 } case { 2 } dflt { in(0) } out(0)"
    (out,) = execute(text, [])
    assert out.shape == (0,)


def test_invalid_operations_do_not_warn():
    with np.errstate(all="raise"):
        execute("in(0) 0 div in(0) sqrt in(0) 1e30 mul 1e30 mul NaN trnc out(0,4)", [0, -1, 1], n_out=4)
