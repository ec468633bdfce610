"""Pieces of work on several threads."""

import threading

import pytest

from iccbrdf.cmm.execution import LEAST_PIECE, TILE, parts
from iccbrdf.cmm.threads import spread


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_each_piece_is_done_once(threads):
    assert sorted(spread(lambda n: n * n, range(40), threads)) == [n * n for n in range(40)]


def test_other_threads_do_their_part():
    together = threading.Barrier(3, timeout=30)
    spread(lambda _: together.wait(), range(3), 3)


def test_nothing_is_begun_after_an_error():
    begun = []

    def work(piece):
        begun.append(piece)
        if piece == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        spread(work, range(10), 1)
    assert begun == [0, 1, 2, 3]


def test_an_error_of_another_thread_comes_out():
    here = threading.get_ident()
    both = threading.Barrier(2, timeout=30)

    def work(_):
        both.wait()
        if threading.get_ident() != here:
            raise ValueError("there")

    with pytest.raises(ValueError, match="there"):
        spread(work, range(2), 2)


@pytest.mark.parametrize("count", [0, 1, TILE + 1, 2 * LEAST_PIECE + 5, 100 * LEAST_PIECE])
def test_parts_cover_all_pixels(count):
    pieces = parts(count, 4)
    assert [i for piece in pieces for i in (piece.start, piece.stop)][1:-1:2] == [p.start for p in pieces[1:]]
    assert (pieces[0].start, pieces[-1].stop) == (0, count) if count else pieces == []
    assert all((piece.stop - piece.start) % TILE == 0 for piece in pieces[:-1])
