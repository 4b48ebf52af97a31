"""Keywords as the command's options of the same names."""

from __future__ import annotations

import os
from functools import lru_cache
from typing import Any, Callable, Collection, Mapping, NamedTuple, Sequence, TypeVar, Union

import numpy as np

from . import _core

StrPath = Union[str, "os.PathLike[str]"]

#: Options that are no keywords: functions have other means for them.
_OF_THE_COMMAND = {"quiet", "json", "verbose"}


class Option(NamedTuple):
    """An option of a command."""

    #: As the command takes it, without the dashes.
    name: str
    #: The name of its value; ``None`` for a switch.
    value: str | None
    #: Whether the value is optional.
    may_be_alone: bool
    #: Whether it may be given several times.
    repeats: bool
    #: Its help.
    help: str


@lru_cache(maxsize=None)
def options(words: tuple[str, ...]) -> Mapping[str, Option]:
    """The options of a command by their keywords."""
    described = (Option(*parts) for parts in _core.options(list(words)))
    named = {option.name.replace("-", "_"): option for option in described}
    return {keyword: option for keyword, option in named.items() if keyword not in _OF_THE_COMMAND}


_Function = TypeVar("_Function", bound=Callable[..., Any])


def documented(*words: str, without: Sequence[str] = ()) -> Callable[[_Function], _Function]:
    """Adds the options of a command to the docstring of a function; ``without`` are those that it does not take."""

    def with_options(function: _Function) -> _Function:
        if function.__doc__ is not None:
            # Runs are an argument, too.
            known = {"trajectory", *without, *function.__code__.co_varnames}
            lines_of_options = [_line(keyword, option) for keyword, option in options(words).items() if keyword not in known]
            # As far to the right as the text above.
            lines = function.__doc__.splitlines()[1:]
            margin = min((len(line) - len(line.lstrip()) for line in lines if line.strip()), default=4)
            function.__doc__ += "".join(f"\n{' ' * margin}{line}" for line in ["", "Keywords:", *lines_of_options])
        return function

    return with_options


def _line(keyword: str, option: Option) -> str:
    return f"    {keyword}={'True' if option.value is None else option.value}: {option.help}"


def arguments(
    words: tuple[str, ...], settings: Mapping[str, Any], *, without: Sequence[str] = ()
) -> list[str]:
    """Keywords and their values as arguments. ``without`` are options that have arguments of their own."""
    known = {keyword: option for keyword, option in options(words).items() if keyword not in without}
    found: list[str] = []
    for keyword, value in settings.items():
        option = known.get(keyword)
        if option is None:
            raise TypeError(unknown(words, keyword, known))
        if value is not None and value is not False and not _is_empty(value):
            found.extend(_given(keyword, option, value))
    return found


def _is_empty(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return value.size == 0
    return isinstance(value, (list, tuple, dict)) and not value


def unknown(words: tuple[str, ...], keyword: str, known: Collection[str]) -> str:
    """The message for an unknown keyword."""
    # Seldom needed, and slow to import.
    import difflib

    near = difflib.get_close_matches(keyword, known, n=3)
    hint = f"; near it: {', '.join(near)}" if near else ""
    return f"{'.'.join(words)}() has no keyword {keyword!r}{hint}"


def _given(keyword: str, option: Option, value: Any) -> list[str]:
    """An option with its values."""
    if option.value is not None and " " in option.value and isinstance(value, (tuple, list)):
        # Values of their own, side by side.
        return [f"--{option.name}", *(_text(keyword, one) for one in value)]
    return [f"--{option.name}{given}" for given in _values(keyword, option, value)]


def _values(keyword: str, option: Option, value: Any) -> list[str]:
    """What follows an option's name, for each time it is given."""
    if value is True:
        if option.value is None or option.may_be_alone:
            return [""]
        raise TypeError(f"{keyword} takes a value ({option.value}), not True")
    if option.value is None:
        raise TypeError(f"{keyword} is a switch: True or False, not {value!r}")
    if isinstance(value, Mapping):
        if "=" not in option.value:
            raise TypeError(f"{keyword} takes one value ({option.value}), not a dict")
        named = [(name, one) for name, of_name in value.items() for one in _each(option, of_name)]
        return [f"={name}={_text(keyword, one)}" for name, one in named]
    return ["=" + _text(keyword, one) for one in _each(option, value)]


def _each(option: Option, value: Any) -> list[Any]:
    """A list gives an option several times, unless it is one of numbers: these are one value."""
    several = isinstance(value, list) and option.repeats and not all(_is_number(one) for one in value)
    return list(value) if several else [value]


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def _text(keyword: str, value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return os.fsdecode(value)
    if _is_number(value):
        number = value.item() if isinstance(value, np.generic) else value
        # The parser knows no exponents.
        return np.format_float_positional(number, trim="-") if isinstance(number, float) else str(number)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)) and value:
        return ",".join(_text(keyword, one) for one in value)
    raise TypeError(f"{keyword}: cannot be given as {type(value).__name__}")
