"""Verbs of the command line called in this process, by Typer's runner."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import typer
from typer.testing import CliRunner as WholeRunner
from typer.testing import Result

from catenary.cases.cli.app import narrowed


class CliRunner(WholeRunner):
    """Typer's runner, which makes the command of the verb that is called and no others."""

    def invoke(self, app: typer.Typer, args: Sequence[str] = (), **how: Any) -> Result:  # type: ignore[override]
        """What a command line ends with."""
        return super().invoke(narrowed(app, args), args, **how)
