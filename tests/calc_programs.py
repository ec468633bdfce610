"""Random sound programs, for tests that compare one way of reading or running them with another."""

import random

from iccbrdf.calc.operators import OPERATORS, Kind, Operand
from iccbrdf.calc.program import Op, Program, signature

INPUTS, OUTPUTS = 4, 5
_CONSTANTS = [0x00000000, 0x80000000, 0x3F800000, 0xBF000000, 0x3E99999A, 0x40490FDB, 0x7F800000, 0x7FC00000]
_EXCLUDED = {"else", "case", "dflt"} | {n for n, row in OPERATORS.items() if row.operand is Operand.ELEMENT}
_DRAWN = sorted(set(OPERATORS) - _EXCLUDED)


def random_program(seed: int, length: int = 30) -> Program:
    """About `length` operations, some in blocks; the last ones pop what is left to the outputs."""
    draw = random.Random(seed)
    ops, depth = _ops(draw, length, 0, 3)
    count = min(depth, OUTPUTS)
    tail = [Op("out", count - 1)] if count else [Op("in", 0), Op("out", 0)]
    return tuple(ops + tail)


def _ops(draw: random.Random, length: int, depth: int, blocks: int) -> tuple[list[Op], int]:
    """Operations that start at a depth, and the least depth that they end at; `blocks` may be nested."""
    ops: list[Op] = []
    while len(ops) < length:
        name = draw.choice(_DRAWN)
        row = OPERATORS[name]
        if row.kind is Kind.CONTROL:
            if blocks and depth:
                added, depth = _choice(draw, name, depth - 1, blocks - 1)
                ops += added
            continue
        op = Op(name, _operand(draw, name, row.operand))
        pops, pushes = row.pops(op.s, op.t), row.pushes(op.s, op.t)
        if pops <= depth and depth + pushes - pops <= 40:
            ops.append(op)
            depth += pushes - pops
    return ops, depth


def _choice(draw: random.Random, name: str, depth: int, blocks: int) -> tuple[list[Op], int]:
    count = 1 if name == "if" else draw.randint(1, 3)
    words = [name] if name == "if" else ["case"] * count
    if draw.random() < 0.6:
        words.append("else" if name == "if" else "dflt")
    bodies, ends = [], [] if words[-1] in ("else", "dflt") else [depth]
    for _ in words:
        body, end = _ops(draw, draw.randint(0, 6), depth, blocks)
        bodies.append(body)
        ends.append(end)
    heads = [Op(word, len(body)) for word, body in zip(words, bodies, strict=True)]
    if name == "sel":
        heads.insert(0, Op("sel"))
    return heads + [op for body in bodies for op in body], min(ends)


def _operand(draw: random.Random, name: str, operand: Operand) -> int:
    small = draw.choice([0, 0, 0, 1, 1, 2])
    if operand is Operand.FLOAT:
        return draw.choice(_CONSTANTS)
    if operand is Operand.SIGNATURE:
        return signature(draw.choice(["litX", "true", "ndef", "a"]))
    if operand is Operand.RANGE:
        limit = {"in": INPUTS, "out": OUTPUTS}.get(name, 12)
        first = draw.randrange(limit - 2)
        return first << 16 | small
    if operand in (Operand.COUNT, Operand.COUNT_FROM_TWO):
        return small << 16
    if operand is Operand.PAIR:
        return small << 16 | draw.choice([0, 0, 1, 2])
    return 0
