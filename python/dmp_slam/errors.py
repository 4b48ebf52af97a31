"""Errors, each with the one-line message that the command prints."""

from __future__ import annotations


class Error(Exception):
    """Any failure of a command: a full disk, a log without a usable scan."""


class UsageError(Error, ValueError):
    """An option has an invalid value, options contradict each other, or a file does not exist."""


class InputError(Error):
    """A file or an array cannot be read in the expected format."""


class Cancelled(Error):
    """The event given as ``cancel`` was set. Nothing unfinished is left behind."""
