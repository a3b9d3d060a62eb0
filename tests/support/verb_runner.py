"""Verbs of the command line called in this process, by Typer's runner."""

from __future__ import annotations

import sys
from typing import Any
from unittest import mock

from typer.testing import CliRunner, Result

from catenary.cases.cli.app import narrowed
from catenary.cases.cli.main import all_verbs

APP = all_verbs()


def invoke(*words: str, **how: Any) -> Result:
    """What a command line ends with; ``how`` is as of Typer's runner.

    The command of the verb that is called is made, and no others. The hook for exceptions that a
    verb installs goes with it.
    """
    with mock.patch.object(sys, "excepthook", sys.excepthook):
        return CliRunner().invoke(narrowed(APP, words), words, **how)
