"""Graphs for pixels with something in common: the numbers of the graph for all pixels, with less work."""

import numpy as np
import pytest
from graph_examples import walk

from iccbrdf.calc.decide import Decider, fold
from iccbrdf.calc.graph import Graph, check
from iccbrdf.calc.schedule import schedule
from iccbrdf.calc.specialise import (
    Question,
    decoded,
    decodings,
    hold,
    questions,
    variable_of,
    work,
    work_of_all,
)

ONE = (0.0, 1.0)


def graph_of(make, channels, dtype=np.float32):
    """`make` gets a function for operators, one for numbers and the input nodes, and returns the outputs."""
    graph = Graph(dtype=dtype)
    graph.outputs = tuple(make(graph.apply, graph.number, [graph.input(i) for i in range(channels)]))
    return graph


def decisions(graph, boxes, env=None, yes=()):
    low, high = zip(*boxes, strict=True)
    return Decider(graph, yes).decide(low, high, env or {})


def specialised(graph, boxes, env=None, yes=()):
    """The graph of `hold` and `fold`, and whether it gives the numbers of `graph` for pixels in the boxes."""
    held, _ = hold(graph, yes)
    found = decisions(held, boxes, env, yes)
    assert found is not None
    folded, _ = fold(held, found)
    check(folded)
    rng = np.random.default_rng(0)
    pixels = np.column_stack([rng.uniform(low, high, 500) for low, high in boxes]).astype(graph.dtype)
    constants = {variable_of(i): float(pixels[0, i]) for i in range(len(boxes))}
    wanted = walk(schedule(graph, len(boxes)), pixels, env)
    given = walk(schedule(folded, len(boxes)), pixels, {**(env or {}), **constants})
    np.testing.assert_array_equal(given, wanted)
    return folded


def ops(graph):
    return [node.op for node in graph.live() if node.op not in ("input", "const")]


# Questions ---------------------------------------------------------------------------------------------


def shaded(op, number, channels):
    """Colours times a cosine, and gloss that takes a while: k n.x + s exp(n.x / m)."""
    k, s, m, x, y = channels
    cosine = op("div", x, op("sqrt", op("add", op("mul", x, x), op("mul", y, y))))
    lobe = op("mul", op("exp", op("div", cosine, m)), op("sin", y))
    return [op("add", op("mul", k, cosine), op("mul", s, lobe))]


def test_questions_are_those_that_spare_most():
    graph = graph_of(shaded, 5)
    names = ("k", "s", "m", "n.x", "n.y")
    found = questions(graph, names)
    assert {str(question) for question in found} >= {"n constant", "s 0"}
    assert len(found) <= 3
    assert work(graph, ()) == work_of_all(graph)
    assert work(graph, found) < work(graph, found[:1]) < work(graph, ())


def test_channels_that_nothing_reads_are_not_asked_for():
    graph = graph_of(lambda op, number, c: [op("exp", op("sin", c[1]))], 3)
    assert {i for question in questions(graph, ("a.1", "a.2", "b.1")) for i in question.channels} == {1}


def test_where_nothing_can_be_spared_nothing_is_asked():
    graph = graph_of(lambda op, number, c: [number(1.0)], 2)
    assert questions(graph, ("a", "b")) == ()


def test_decoding_is_followed_to_its_end():
    graph = graph_of(
        lambda op, number, c: [
            op("exp", op("add", op("mul", c[0], number(2)), number(-1))),
            op("mul", c[1], op("div", number(3), c[1])),
        ],
        2,
    )
    chains = decodings(graph)
    assert [len(chains[i]) for i in (0, 1)] == [3, 1]
    np.testing.assert_array_equal(decoded(chains[0], np.float32([0, 0.5, 1])), [-1, 0, 1])


# What is decided ---------------------------------------------------------------------------------------


def test_constant_channels_become_arguments():
    yes = [Question("n", (3, 4), False)]
    boxes = [ONE, ONE, (0.1, 1), (0.25, 0.25), (0.5, 0.5)]
    folded = specialised(graph_of(shaded, 5), boxes, yes=yes)
    plan = schedule(folded, 5)
    assert len(plan.arguments) == 2
    assert not {"sqrt", "sin"} & {node.op for node in plan.body if hasattr(node, "op")}


def test_a_factor_of_0_takes_the_other_along():
    yes = [Question("s", (1,), True)]
    boxes = [ONE, (0, 0), (0.1, 1), (0.1, 0.5), (0.1, 0.5)]
    assert "exp" not in ops(specialised(graph_of(shaded, 5), boxes, yes=yes))


def test_what_may_be_infinite_is_not_lost():
    yes = [Question("s", (1,), True)]
    boxes = [ONE, (0, 0), (0.0, 1), (0.1, 0.5), (0.1, 0.5)]
    graph, _ = hold(graph_of(shaded, 5), yes)
    found = decisions(graph, boxes, yes=yes)
    assert found is None or "exp" in ops(fold(graph, found)[0])


def test_a_decoded_0_is_one():
    graph = graph_of(
        lambda op, number, c: [op("mul", op("exp", c[0]), op("add", op("mul", c[1], number(2)), number(-1)))],
        2,
    )
    assert ops(specialised(graph, [ONE, (0.5, 0.5)], yes=[Question("b", (1,), True)])) == []


@pytest.mark.parametrize(
    ("op", "left", "right", "kept"),
    [
        ("vmin", (0, 1), (2, 3), 0),
        ("vmin", (2, 3), (0, 1), 1),
        ("vmax", (0, 1), (2, 3), 1),
        ("vmax", (2, 3), (0, 1), 0),
    ],
)
def test_the_lesser_and_the_greater(op, left, right, kept):
    folded = specialised(graph_of(lambda make, number, c: [make(op, *c)], 2), [left, right])
    assert [output.detail for output in folded.outputs] == [kept]


def test_ranges_that_meet_decide_nothing():
    graph = graph_of(lambda op, number, c: [op("vmin", *c)], 2)
    assert decisions(graph, [(0, 1), (1, 2)]) == {}


@pytest.mark.parametrize(
    ("limit", "kept"), [(-1.0, ["exp"]), (2.0, ["sin"]), (0.5, ["exp", "gt", "select", "sin"])]
)
def test_conditions(limit, kept):
    graph = graph_of(
        lambda op, number, c: [op("select", op("gt", c[0], number(limit)), op("exp", c[0]), op("sin", c[0]))],
        1,
    )
    assert sorted(ops(specialised(graph, [ONE]))) == kept


def test_conditions_on_run_time_variables_hold_for_these_variables():
    graph = Graph(dtype=np.float32)
    pixel = graph.input(0)
    above = graph.apply("gt", pixel, graph.add("variable", detail="litZ"))
    graph.outputs = (graph.apply("select", above, graph.apply("exp", pixel), pixel),)
    assert ops(specialised(graph, [ONE], {"litZ": -1.0})) == ["exp"]
    assert ops(specialised(graph, [ONE], {"litZ": 2.0})) == []
    # Undefined ones are 0, which a pixel may be, too.
    assert "select" in ops(specialised(graph, [ONE]))


def test_what_variables_make_0_is_not_taken_out():
    """It would hold for one light alone, and a kernel is for many."""
    graph = Graph(dtype=np.float32)
    variable = graph.add("variable", detail="litX")
    graph.outputs = (graph.apply("mul", variable, graph.apply("exp", graph.input(0))),)
    assert decisions(graph, [ONE], {"litX": 0.0}) == {}


def test_the_sign_of_a_zero_that_something_is_divided_by_counts():
    graph = graph_of(lambda op, number, c: [op("div", op("exp", c[0]), c[1])], 2)
    for zero in (True, False):
        yes = [Question("b", (1,), zero)]
        held, _ = hold(graph, yes)
        assert decisions(held, [ONE, (0, 0)], yes=yes) is None
    yes = [Question("b", (1,), False)]
    assert decisions(hold(graph, yes)[0], [ONE, (0.5, 0.5)], yes=yes) == {}


def random_graph(rng, channels, nodes):
    """Operators on what is there already, conditions among them."""
    graph = Graph(dtype=np.float32)
    numbers = [graph.input(i) for i in range(channels)]
    numbers += [graph.number(value) for value in (0.0, 1.0, -1.0, 0.5)]
    numbers.append(graph.add("variable", detail="litX"))
    for _ in range(nodes):
        a, b, c, d = rng.choice(len(numbers), 4)
        one, two, three, four = (numbers[i] for i in (a, b, c, d))
        kind = rng.random()
        if kind < 0.6:
            op = str(rng.choice(["add", "sub", "mul", "div", "vmin", "vmax"]))
            numbers.append(graph.apply(op, one, two))
        elif kind < 0.8:
            numbers.append(graph.apply(str(rng.choice(["neg", "abs", "sqrt", "exp", "cos", "flor"])), one))
        else:
            test = graph.apply(str(rng.choice(["lt", "le", "gt", "ge"])), one, two)
            numbers.append(graph.apply("select", test, three, four))
    graph.outputs = tuple(numbers[-4:])
    return graph


def test_random_graphs_give_the_same_numbers():
    decided = 0
    for seed in range(150):
        rng = np.random.default_rng(seed)
        graph = random_graph(rng, 4, 40)
        yes = [Question("a", (0,), False), Question("b", (1,), True)][: rng.integers(0, 3)]
        boxes = [sorted(rng.choice([-2.0, -0.5, 0.0, 0.25, 1.0, 3.0], 2)) for _ in range(4)]
        for question in yes:
            for i in question.channels:
                boxes[i] = (0.0, 0.0) if question.zero else (boxes[i][0], boxes[i][0])
        held, _ = hold(graph, yes)
        env = {"litX": float(rng.normal())}
        found = decisions(held, boxes, env, yes)
        if found:
            decided += 1
            chain = decodings(graph).get(1, ())
            if Question("b", (1,), True) in yes and len(chain) > 1:
                continue  # what decodes to 0 is another number
            specialised(graph, boxes, env, yes)
    assert decided > 50
