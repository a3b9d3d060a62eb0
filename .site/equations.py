"""Equations of the site: LaTeX between dollar signs becomes MathML when the site is built.

Browsers draw MathML themselves, so that no page loads a script; the site brings a font for it,
since not every system has one. GitHub shows the same sources.
"""

from __future__ import annotations

import html
import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

_EQUATION = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<latex>.*?)\\[)\]]</(?P=tag)>', re.S
)
# Names of functions stand apart from their neighbours, which the converter leaves out.
_FUNCTION = r"<mi>(?:sin|cos|tan|tanh|cosh|coth|log)</mi>"
_SPACE = '<mspace width="0.167em" />'
# Remains of a command, or of an alignment, that the converter does not know.
_LEFT_OVER = re.compile(r"\\[A-Za-z]+|&")


def mathml(latex: str, display: bool) -> str:
    """An equation as MathML.

    Parameters
    ----------
    latex : str
        The equation without its dollar signs.
    display : bool
        Whether it stands on a line of its own.

    Raises
    ------
    ValueError
        If a part of it is not understood.
    """
    try:
        made = convert(latex, display="block" if display else "inline")
    except Exception as error:  # the converter raises many kinds
        raise ValueError(f"not understood: {latex}") from error
    if left := _LEFT_OVER.search(html.unescape(re.sub(r"<[^>]*>", "", made))):
        raise ValueError(f"{left[0]} is not understood: {latex}")
    if latex.replace(r"\{", "").count("{") != latex.replace(r"\}", "").count("}"):
        raise ValueError(f"braces are not understood: {latex}")
    made = re.sub(rf"(?<=</m[in]>)({_FUNCTION})", rf"{_SPACE}\1", made)
    made = re.sub(rf"({_FUNCTION})(?=<m(?:[in]|sub|frac)>)", rf"\1{_SPACE}", made)
    return made.replace("<mo>&#x0007C;</mo>", '<mo lspace="0" rspace="0">&#x0007C;</mo>')


def on_files(files: Files, config: Any) -> Files:
    """The files of the site with a font of mathematics; called by MkDocs."""
    package = find_spec("ziamath")  # not imported: only its font is wanted
    assert package is not None and package.origin is not None
    font = Path(package.origin).parent / "fonts/STIXTwoMath-Regular.ttf"
    files.append(File.generated(config, font.name, abs_src_path=str(font)))
    return files


def on_page_content(page_html: str, page: Any, **_: Any) -> str:
    """A page with its equations as MathML; called by MkDocs."""

    def made(match: re.Match[str]) -> str:
        try:
            return mathml(html.unescape(match["latex"]), match["tag"] == "div")
        except ValueError as error:
            raise SystemExit(f"{page.file.src_uri}: {error}") from None

    return _EQUATION.sub(made, page_html)
