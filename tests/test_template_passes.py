"""The graph, its verifier and the passes."""

import math

import pytest

from iccbrdf.calc.graph import Graph, GraphError, Node, check
from iccbrdf.calc.lower import Settings, lower
from iccbrdf.calc.passes import optimise, rewrite
from iccbrdf.calc.source import parse


def optimised(build):
    """The single output of the graph that `build` makes, after all passes, and the reports by name."""
    graph = Graph()
    graph.outputs = (build(graph),)
    result, reports = optimise(graph)
    return result.outputs[0], {report.name: report for report in reports}


def test_equal_nodes_are_one_node():
    graph = Graph()
    a, b = graph.input(0), graph.input(1)
    assert graph.add("add", [a, b]) is graph.add("add", [graph.input(0), b])
    assert graph.add("add", [b, a]) is not graph.add("add", [a, b])
    assert graph.const(0.0) is not graph.const(-0.0)
    assert graph.shared == 2


@pytest.mark.parametrize(
    ("op", "build"),
    [
        ("add", lambda g: ([g.input(0), g.input(0, 2)], None, 0)),
        ("add", lambda g: ([g.input(0)], None, 0)),
        ("sum", lambda g: ([g.input(0)], None, 0)),
        ("pick", lambda g: ([g.input(0, 3)], 2, 2)),
        ("rotl", lambda g: ([g.input(0, 3)], 3, 0)),
        ("splat", lambda g: ([g.input(0, 3)], None, 3)),
        ("select", lambda g: ([g.input(0), g.input(0), g.input(0, 2)], None, 0)),
        ("select", lambda g: ([g.input(0)], None, 0)),
        ("pack", lambda g: ([g.input(0)], None, 0)),
        ("tput", lambda g: ([g.input(0)], None, 0)),
        ("nonsense", lambda g: ([g.input(0)], None, 0)),
    ],
)
def test_the_graph_refuses_what_does_not_fit(op, build):
    graph = Graph()
    arguments, detail, width = build(graph)
    with pytest.raises(GraphError, match=op):
        graph.add(op, arguments, detail, width)


def test_check_finds_what_a_wrong_pass_may_do():
    graph = Graph()
    a = graph.input(0)
    check(graph)
    graph.nodes.append(Node(1, "neg", (a,), None, 2))
    with pytest.raises(GraphError, match="wrong width"):
        check(graph)
    graph.nodes[1] = Node(1, "neg", (Node(0, "input", (), 0, 1),), None, 1)
    with pytest.raises(GraphError, match="does not come before"):
        check(graph)
    graph.nodes[1] = Node(1, "input", (), 0, 1)
    with pytest.raises(GraphError, match="there twice"):
        check(graph)
    graph.nodes[1] = Node(2, "neg", (a,), None, 1)
    with pytest.raises(GraphError, match="stands at 1"):
        check(graph)
    graph.nodes.pop()
    graph.outputs = (Node(0, "input", (), 0, 1),)
    with pytest.raises(GraphError, match="another graph"):
        check(graph)


def test_constants_are_folded_in_float64():
    output, reports = optimised(lambda g: g.add("div", [g.const(1), g.add("sqrt", [g.const(3)])]))
    assert output.op == "const"
    assert output.detail == (1 / math.sqrt(3),)
    assert reports["fold constants"].changes == (("constant", 2),)
    assert "fold constants: 4 -> 1 nodes (constant 2)" in str(reports["fold constants"])


@pytest.mark.parametrize(
    ("build", "expected"),
    [
        (lambda g: g.add("tLab", [g.const(1), g.const(1), g.const(1)]), (100, 0, 0)),
        (lambda g: g.add("sum", [g.const(1, 2, 4)]), (7,)),
        (lambda g: g.rotl(g.const(1, 2, 4), 1), (2, 4, 1)),
        (lambda g: g.pick(g.pack([g.const(1, 2), g.const(4, 5)]), 1, 2), (2, 4)),
        (lambda g: g.add("select", [g.const(0.4), g.const(1), g.const(2)]), (2,)),
        (lambda g: g.add("mul", [g.const(1, 2), g.splat(g.const(3), 2)]), (3, 6)),
        (lambda g: g.add("div", [g.const(1), g.const(0)]), (math.inf,)),
    ],
)
def test_every_kind_of_node_folds(build, expected):
    output, _ = optimised(build)
    assert output.op == "const"
    assert output.detail == pytest.approx(expected, abs=1e-12)


def test_a_known_condition_leaves_one_side():
    output, reports = optimised(lambda g: g.add("select", [g.const(1), g.input(0), g.env("litI", 1)]))
    assert (output.op, output.detail) == ("input", 0)
    assert reports["fold constants"].changes == (("known condition", 1),)
    output, _ = optimised(lambda g: g.add("select", [g.input(0), g.input(1), g.input(1)]))
    assert (output.op, output.detail) == ("input", 1)


def x(graph):
    return graph.input(0, 3)


def repeated(graph, number):
    return graph.splat(graph.const(number), 3)


@pytest.mark.parametrize(
    ("build", "expected"),
    [
        (lambda g: g.pick(x(g), 0, 3), "%0[3] = input(0)"),
        (lambda g: g.pick(x(g), 1, 2), "%0[2] = input(1)"),
        (lambda g: g.pick(g.pick(g.add("neg", [x(g)]), 1, 2), 1), "%2[1] = pick(%1, 2)"),
        (lambda g: g.pick(g.rotl(g.add("neg", [x(g)]), 2), 1), "%2[1] = pick(%1, 0)"),
        (lambda g: g.pick(g.splat(g.env("litI", 1), 4), 1, 2), "%1[2] = splat(%0)"),
        (lambda g: g.pick(g.pack([g.env("litI", 1), x(g)]), 0), "%0[1] = env(('litI', 1))"),
        (lambda g: g.pick(g.pack([g.env("litI", 1), x(g)]), 0, 2), "%2[2] = pack(%0, %1)"),
        (lambda g: g.pack([g.input(4), g.input(5), g.input(6, 2)]), "%0[4] = input(4)"),
        (lambda g: g.pack([g.pick(g.add("neg", [x(g)]), k) for k in range(3)]), "%1[3] = neg(%0)"),
        (lambda g: g.pack([g.pack([g.input(4), x(g)]), g.input(9)]), "%3[5] = pack(%0, %1, %2)"),
        (lambda g: g.splat(g.input(0), 1), "%0[1] = input(0)"),
        (lambda g: g.add("add", [x(g), repeated(g, 0)]), "%0[3] = input(0)"),
        (lambda g: g.add("add", [repeated(g, 0), x(g)]), "%0[3] = input(0)"),
        (lambda g: g.add("mul", [repeated(g, 1), x(g)]), "%0[3] = input(0)"),
        (lambda g: g.add("div", [x(g), repeated(g, 1)]), "%0[3] = input(0)"),
        (lambda g: g.add("pow", [x(g), repeated(g, 1)]), "%0[3] = input(0)"),
        (lambda g: g.add("div", [repeated(g, 1), x(g)]), "%3[3] = div(%1, %2)"),
        (lambda g: g.add("sub", [repeated(g, 0), x(g)]), "%3[3] = sub(%1, %2)"),
        (lambda g: g.add("mul", [repeated(g, 0), x(g)]), "%3[3] = mul(%1, %2)"),
        (lambda g: g.add("mul", [x(g), x(g)]), "%1[3] = sq(%0)"),
        (lambda g: g.add("pow", [x(g), repeated(g, 2)]), "%1[3] = sq(%0)"),
        (lambda g: g.add("neg", [g.add("neg", [x(g)])]), "%0[3] = input(0)"),
        (lambda g: g.add("sq", [g.add("neg", [x(g)])]), "%1[3] = sq(%0)"),
        (lambda g: g.add("sq", [g.add("abs", [x(g)])]), "%1[3] = sq(%0)"),
        (lambda g: g.add("abs", [g.add("neg", [x(g)])]), "%1[3] = abs(%0)"),
        (lambda g: g.add("add", [g.input(5, 3), g.add("neg", [x(g)])]), "%2[3] = sub(%0, %1)"),
        (lambda g: g.add("sub", [g.input(5, 3), g.add("neg", [x(g)])]), "%2[3] = add(%0, %1)"),
    ],
)
def test_simplifications(build, expected):
    output, _ = optimised(build)
    assert repr(output) == expected


def test_a_product_with_zero_stays_because_it_may_be_nan():
    output, _ = optimised(lambda g: g.add("mul", [g.const(0), g.add("div", [g.input(0), g.input(1)])]))
    assert output.op == "mul"


def test_dead_nodes_go_and_are_reported():
    def build(graph):
        graph.add("exp", [graph.input(1)])
        return graph.add("exp", [graph.input(0)])

    output, reports = optimised(build)
    assert output.index == 1
    assert reports["remove dead code"].changes == (("unused", 2),)


def test_a_rewriting_is_verified():
    graph = Graph()
    graph.outputs = (graph.add("neg", [graph.input(0)]),)
    foreign = Graph().input(0, 3)
    with pytest.raises(GraphError):
        rewrite(graph, [lambda new, node: foreign if node.op == "neg" else None])


def test_of_a_condition_that_the_build_knows_only_the_side_that_it_takes_is_made():
    output = "output X = if p == 2 and 1 < 2 { a } else { total k = 1 to 999 { a^k } }"
    template = parse(f"model t\nconstant p = 2\ninput a\n{output}", "t.calc")
    graph = lower([template], Settings()).graph
    assert graph.outputs[0].op == "input"
    assert len(graph.nodes) < 20
    assert len(lower([template], Settings(constants={"p": 1})).graph.nodes) > 900
