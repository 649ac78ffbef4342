"""Mistakes in a command's arguments, in our words: typer's own are those of its libraries."""

from __future__ import annotations

from typing import Any

from pkm_gym.core.names import unknown

# What a value must be, by the kind of pydantic's error.
KINDS = {
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "int_type": "a whole number",
    "float_parsing": "a number",
    "bool_parsing": "true or false",
    "greater_than_equal": "at least {ge}",
    "less_than_equal": "at most {le}",
    "finite_number": "a finite number",
}


def usage(error: Any) -> str:
    """Return the sentence of a usage error, and where help is."""
    command = getattr(error, "cmd", None)
    context = getattr(error, "ctx", None)
    help_ = f"; see {context.command_path} --help" if context else ""
    return f"{_words(error, command)}{help_}"


def _words(error: Any, command: Any) -> str:
    kind = type(error).__name__
    if kind == "NoSuchOption":
        known = [flag for p in getattr(command, "params", ()) for flag in p.opts if flag[:1] == "-"]
        return unknown("option", error.option_name, [*known, "--help"])
    if kind == "BadOptionUsage":
        takes = "does not take a value" not in error.message
        return f"{error.option_name} {'needs a value after it' if takes else 'takes no value'}"
    if kind == "MissingParameter":
        return f"{_name(error.param)} is missing"
    if kind == "BadParameter":
        return _bad(error)
    said = str(error.format_message()).rstrip(".")
    if "unexpected extra argument" in said:
        return f"too many words: {said[said.rindex('(') + 1 : -1]}"
    return said


def _bad(error: Any) -> str:
    """Return what a value is and what it must be."""
    name, cause = _name(error.param), error.__cause__
    if not hasattr(cause, "errors"):
        return f"{name} can't have that value"
    first = cause.errors()[0]
    must = KINDS.get(first["type"], "another value").format(**first.get("ctx", {}))
    return f"{name} is {first['input']!r}: it must be {must}"


def _name(parameter: Any) -> str:
    """Return an option's flag, or an argument's name as help shows it."""
    flags = [flag for flag in parameter.opts if flag.startswith("--")]
    return str(flags[0] if flags else parameter.metavar or parameter.human_readable_name)
