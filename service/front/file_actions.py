"""What can be done with a file from its page: jobs, downloads, another name, deletion."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Literal, get_args

from slipstick.report.markup import paragraph, section

from ..front.elements import Link, link_line, plural
from .forms import NAME_PATTERN, NAME_RULE, WITHOUT_SCRIPT, Field, Form, folded

Folder = Literal["tables", "recordings", "benches"]
FOLDERS: tuple[Folder, ...] = get_args(Folder)
_SINGULAR: Mapping[Folder, str] = {"tables": "table", "recordings": "recordings", "benches": "bench"}


def file_actions(folder: Folder, name: str, jobs: Mapping[str, Form], results: int, links: Sequence[Link] = ()) -> str:
    """Return the section of actions of a file, of which there are so many `results`, with further `links`."""
    address = f"/v1/{folder}/{name}"
    orders = [folded(title, form.html()) for title, form in jobs.items()]
    downloads = link_line([Link("Download the file", f"{address}/file"), Link("Jobs with it", f"/find?text={name}"),
                           *links])
    return section("What to do", WITHOUT_SCRIPT, *orders, _rename(folder, name, address),
                   _delete(folder, name, address, results), downloads)


def _rename(folder: Folder, name: str, address: str) -> str:
    form = Form("rename", address, "Rename", [
        Field("name", "New name", "results keep the former one", value=name, required=True, pattern=NAME_PATTERN,
              rule=NAME_RULE)], method="PATCH")
    return folded(f"Rename the {_SINGULAR[folder]}", form.html())


def _delete(folder: Folder, name: str, address: str, results: int) -> str:
    kept = [Field("force", f"Delete it although {plural(results, 'job')} with it {'is' if results == 1 else 'are'} "
                  "done", "reports stay; nothing can be computed from it again", "flag",
                  place="query")] if results else []
    form = Form("delete", address, f"Delete {name}", kept, method="DELETE", body="none", then="/", is_dangerous=True)
    return folded(f"Delete the {_SINGULAR[folder]}", paragraph(
        f"The file “{name}” is removed from the service for everybody, and cannot be restored. Download it before, if "
        "no copy of it is elsewhere."), form.html())


def invalid_page(folder: Folder, name: str, problem: str, results: int) -> str:
    """Return the content of the page of a file that cannot be read, with what can be done with it."""
    return "\n".join([paragraph(_SINGULAR[folder].capitalize(), "over"), f"<h1>{escape(name)}</h1>",
                      f'<p><span class="mark invalid">invalid</span></p>{paragraph(problem, "lead")}',
                      file_actions(folder, name, {}, results)])
