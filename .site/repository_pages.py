"""Pages of the site that stand outside of docs/: README, CONTRIBUTING, changes, licence, cases.

Links between pages are written for the repository, as GitHub shows it, and turned here into links
of the site. A link to a file that the site does not have becomes its text. Pages also say here why
the tests do not run a block.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

HERE = Path(__file__).parent
ROOT = HERE.parent
ASSETS = ("style.css", "iframe-worker.js")
CHANGES = "development/changes.md"
OUTSIDE = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "development/contributing.md",
    "CHANGELOG.md": CHANGES,
    "LICENSE": "development/licence.md",
    **{
        path.relative_to(ROOT).as_posix(): f"cases/{path.parent.name}.md"
        for path in sorted(ROOT.glob("cases/*/README.md"))
    },
}
_INSIDE = {page: name for name, page in OUTSIDE.items()}
_LINK = re.compile(
    r"(?P<label>!?\[(?:[^\[\]]|\[[^\]]*\])*\])\((?P<target>[^)#\s]+)(?P<anchor>#[^)]*)?\)"
)
_NOT_RUN = re.compile(r"^<!-- test: (?P<kind>not run|study)(?::? (?P<reason>.*?))? -->$", re.M)


def on_files(files: Files, config: Any) -> Files:
    """The files of the site with those from outside; called by MkDocs."""
    for name, page in OUTSIDE.items():
        if name == "LICENSE":
            text = f"# Licence\n\n```text\n{(ROOT / name).read_text(encoding='utf-8')}```\n"
            files.append(File.generated(config, page, content=text))
        else:
            files.append(File.generated(config, page, abs_src_path=str(ROOT / name)))
    for name in ASSETS:
        files.append(File.generated(config, name, abs_src_path=str(HERE / name)))
    return files


def on_page_markdown(text: str, page: Any, files: Files, **_: Any) -> str:
    """The text of a page with links of the site; called by MkDocs."""
    here = page.file.src_uri
    name = _INSIDE.get(here, f"docs/{here}")

    def linked(match: re.Match[str]) -> str:
        target = match["target"]
        if "://" in target or target.startswith("mailto:"):
            return match[0]
        wanted = posixpath.normpath(posixpath.join(posixpath.dirname(name), target))
        if not (ROOT / wanted).exists():
            # Of what was once; elsewhere MkDocs says that it is not there, unless it is made here.
            return match["label"].strip("[]") if here == CHANGES else match[0]
        page_of = OUTSIDE.get(wanted, wanted.removeprefix("docs/"))
        if page_of == wanted and not wanted.startswith("docs/"):
            return match["label"].strip("[]")
        there = posixpath.relpath(page_of, posixpath.dirname(here) or ".")
        return f"{match['label']}({there}{match['anchor'] or ''})"

    return _NOT_RUN.sub(_remark, _LINK.sub(linked, text))


def _remark(match: re.Match[str]) -> str:
    if match["kind"] == "study":
        return "*Run by `make test-studies`:*"
    return f"*Not run by the tests: {match['reason']}.*"
