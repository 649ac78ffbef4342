"""Tally: how many designs this process has evaluated, whoever asked."""

from __future__ import annotations


class Tally:
    """Counts the designs that design problems evaluate; a benchmark sees by it who goes past it.

    Attributes:
        designs: how many, since the process began.
    """

    __slots__ = ("designs",)

    def __init__(self) -> None:
        self.designs = 0


TALLY = Tally()
