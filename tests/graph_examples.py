"""Lifted graphs for tests, and the plainest way to run their schedules."""

import numpy as np

from iccbrdf.calc import elements
from iccbrdf.calc.exact_passes import EXACT_PASSES
from iccbrdf.calc.graph import Graph, is_truth, meaning
from iccbrdf.calc.interpreter import run
from iccbrdf.calc.lift import lift_element
from iccbrdf.calc.meanings import solve
from iccbrdf.calc.passes import optimise
from iccbrdf.calc.schedule import Branch, schedule, uniform_values
from iccbrdf.icc import Calculator

SPECIALS = np.array(
    [0.0, -0.0, 1.0, -1.0, 0.5, 0.49999997, 2.0, -2.5, 3.7, 1e-5, 1e-7, 1e-39, -1e-45, 1e30, -1e30, 3.4e38,
     np.inf, -np.inf, np.nan, 0.2, 0.9, 100.0, -0.7, 4.0]
)  # fmt: skip


def lifted(element, dtype=np.float32, *, finite_inputs=False, passes=EXACT_PASSES):
    """The optimised graph of an element, with an input for each of its channels."""
    graph = Graph(dtype=dtype)
    channels = [graph.input(i) for i in range(element.inputs)]
    graph.outputs = tuple(lift_element(graph, element, channels, finite_inputs=finite_inputs))
    return optimise(graph, passes)[0]


def scheduled(element, dtype=np.float32, **options):
    return schedule(lifted(element, dtype, **options), element.inputs)


def calculator(program, inputs, outputs, elements=()):
    return Calculator(inputs=inputs, outputs=outputs, program=tuple(program), elements=tuple(elements))


def interpreted(element, pixels, env=None):
    """What the interpreter makes of pixels (n, inputs), as (n, outputs)."""
    pixels = np.asarray(pixels)
    results = run(element.program, list(pixels.T), element.outputs, elements=element.elements, env=env or {},
                  dtype=pixels.dtype)  # fmt: skip
    return np.stack([np.broadcast_to(result, len(pixels)) for result in results], axis=1)


def walk(plan, pixels, env=None):
    """A schedule, node by node with the operator table: no buffers, no skipping, both sides of branches."""
    dtype = plan.graph.dtype
    pixels = np.asarray(pixels, dtype)
    values = dict(zip(plan.arguments, uniform_values(plan, env or {}), strict=True))

    def value(node):
        if node.op == "const":
            return dtype(node.detail[0])
        return values[node]

    def number(node):
        found = value(node)
        return found.astype(dtype) if is_truth(node) else found

    def compute(block):
        for item in block:
            if isinstance(item, Branch):
                assert item.selects
                assert all(select.arguments[0] is item.condition for select in item.selects)
                compute(item.yes)
                compute(item.no)
                for select in item.selects:
                    values[select] = node_value(select)
            else:
                values[item] = node_value(item)

    def node_value(node):
        arguments = node.arguments
        if node.op == "input":
            return pixels[:, node.detail]
        if node.op == "select":
            return np.where(value(arguments[0]), number(arguments[1]), number(arguments[2]))
        if node.op == "pick":
            return value(arguments[0])[node.detail]
        if node.op == "curve":
            return elements.apply_curve(node.detail, number(arguments[0]), {})
        if node.op in ("clut", "tint"):
            return elements.apply(node.detail, [number(argument) for argument in arguments], dtype=dtype)
        if node.op == "solve":
            return solve([number(argument) for argument in arguments], *(n - 1 for n in node.detail))
        result = meaning(node.op)(*map(number, arguments))
        return result >= 0.5 if is_truth(node) else result

    with np.errstate(all="ignore"):
        compute(plan.body)
        outputs = [np.broadcast_to(number(output), len(pixels)) for output in plan.graph.outputs]
    return np.stack(outputs, axis=1)


def same_bits(one, other):
    """Equal numbers, zeros of equal sign, and NaN where the other has NaN."""
    one, other = np.asarray(one), np.asarray(other)
    nan = np.isnan(one) & np.isnan(other)
    return bool(np.all(nan | ((one == other) & (np.signbit(one) == np.signbit(other)))))


def hard_pixels(count, channels, dtype=np.float32, seed=0):
    """Pixels of ordinary and special values mixed."""
    rng = np.random.default_rng(seed)
    pixels = rng.uniform(-2, 2, (count, channels))
    special = rng.random(pixels.shape) < 0.3
    pixels[special] = rng.choice(SPECIALS, int(special.sum()))
    return pixels.astype(dtype)
