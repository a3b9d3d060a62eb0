"""Scene keys of lengths along the line, which several tables take."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

Span = Annotated[float, Field(ge=5, le=500)]
