"""Options: what is fixed when a problem is made, each with its default, words and what is legal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from math import inf
from typing import Any, Self

from pkm_gym.core.names import check_known
from pkm_gym.core.reading import is_number


@dataclass(frozen=True)
class Option:
    """One option: its name, default and unit, what it is, and what it may be.

    ``low`` and ``high`` bound a number, or each number of several; ``choices`` are the legal words.
    One whose default is None is a number that needn't be given.
    """

    name: str
    default: Any
    unit: str
    doc: str
    low: float
    high: float
    choices: Callable[[], Iterable[str]] | None

    def checked(self, value: Any) -> Any:
        """Return a legal value as the default's type.

        Raises:
            ValueError: naming the option, its value and what is allowed.
        """
        if value is None and self.default is None:
            return None
        if self.choices is not None:
            check_known(self.name, [value], self.choices())
            return value
        if isinstance(self.default, tuple):
            numbers = tuple(value) if isinstance(value, list | tuple) else ()
            if len(numbers) != len(self.default) or not all(map(self._legal, numbers)):
                raise ValueError(f"{self.name} is {value!r}: it must be {self.allowed}")
            return numbers
        if not self._legal(value):
            raise ValueError(f"{self.name} is {value!r}: it must be {self.allowed}")
        return float(value) if isinstance(self.example, float) else value

    @property
    def example(self) -> Any:
        """A value of its type; of several, one of them."""
        if self.default is None:
            return 0.0
        return self.default[0] if isinstance(self.default, tuple) else self.default

    @property
    def allowed(self) -> str:
        """What it may be, in words."""
        if self.choices is not None:
            return " or ".join(self.choices())
        if isinstance(self.example, bool):
            return "true or false"
        kind = "a whole number" if isinstance(self.example, int) else "a number"
        if isinstance(self.default, tuple):
            kind = f"{len(self.default)} {kind.split(' ', 1)[1]}s, each"
        return f"{kind} from {self.low:g} to {self.high:g} {self.unit}".rstrip()

    def _legal(self, value: Any) -> bool:
        if isinstance(self.example, bool):
            return isinstance(value, bool)
        kinds = int if isinstance(self.example, int) else (int, float)
        return is_number(value) and isinstance(value, kinds) and self.low <= value <= self.high


def option(
    default: Any,
    doc: str,
    *,
    unit: str = "",
    low: float = -inf,
    high: float = inf,
    choices: Callable[[], Iterable[str]] | None = None,
) -> Any:
    """Declare a field of an Options; see ``Option``. ``choices`` is asked when it is needed."""
    metadata = {"unit": unit, "doc": doc, "low": low, "high": high, "choices": choices}
    return field(default=default, metadata=metadata)


@dataclass(frozen=True)
class Options:
    """What is fixed when a problem is made; a mechanism adds its presets and sampling."""

    def __post_init__(self) -> None:
        """Refuse an illegal value.

        Raises:
            ValueError: naming the option, its value and what is allowed.
        """
        for item in self.table():
            object.__setattr__(self, item.name, item.checked(getattr(self, item.name)))

    @classmethod
    def of(cls, options: Mapping[str, Any]) -> Self:
        """Return the options from keyword arguments.

        Raises:
            ValueError: for an unknown option (with its closest match) or an illegal value.
        """
        check_known("option", options, [item.name for item in fields(cls)])
        return cls(**options)

    @classmethod
    def table(cls) -> tuple[Option, ...]:
        """Return what is declared of each option."""
        return tuple(Option(item.name, item.default, **item.metadata) for item in fields(cls))

    def changed(self) -> dict[str, Any]:
        """Return the options that differ from their defaults, by name."""
        values = ((item, getattr(self, item.name)) for item in self.table())
        return {item.name: value for item, value in values if value != item.default}
