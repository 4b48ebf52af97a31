"""What goes wrong, each with the one line that the command prints."""

from __future__ import annotations


class Error(Exception):
    """Anything that the command fails with: a full disk, a log without a scan that can be used."""


class UsageError(Error, ValueError):
    """An option has no such value, options contradict each other, or a file is not there."""


class InputError(Error):
    """A file or an array cannot be read as what it was given for."""


class Cancelled(Error):
    """The event that was given as ``cancel`` was set. Nothing unfinished is left behind."""
