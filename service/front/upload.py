"""The page on which files are added: recordings, files of a logger with their mapping, tables and benches."""

from collections.abc import Sequence
from urllib.parse import urlencode

from slipstick.report.markup import paragraph, section

from .forms import NAME_PATTERN, NAME_RULE, WITHOUT_SCRIPT, Field, Form

_NAME = Field("name", "Name", "under which pages and programs find it", place="query", required=True,
              pattern=NAME_PATTERN, rule=NAME_RULE)


def upload_page(benches: Sequence[str], machines: Sequence[str], machine_tables: Sequence[str],
                machine: str | None = None) -> str:
    """Return the content of the page; `machines` are declared, and `machine_tables` are the tables of others.

    Files of a logger are those of the `machine` unless another one is chosen.
    """
    bench = Field("bench", "Bench", "whose current profiles a CSV file numbers; an HDF5 file has its own", "choice",
                  choices=[("", "none"), *((name, name) for name in benches)], place="query",
                  value=benches[-1] if benches else "")
    other = [Field("table", "Table of another machine", "whose measurements a CSV file has, instead of a bench",
                   "choice", choices=[("", "none"), *((name, name) for name in machine_tables)], place="query")]
    recordings = Form("upload-recordings", "/v1/recordings", "Upload the recordings", [
        _file("File", "CSV with a row for each engagement, or HDF5 with signals or with runs of a declared machine",
              ".csv,.h5,.hdf5"), _NAME, bench], other if machine_tables else (), body="file",
        hint="Files of a logger, with other columns or separators, are added below.")
    table = Form("upload-table", "/v1/tables", "Upload the table", [
        _file("File", "HDF5, as slipstick build writes it or as your program computed it", ".h5,.hdf5"), _NAME],
        body="file")
    bench_file = Form("upload-bench", "/v1/benches", "Upload the bench", [
        _file("File", "TOML, with profiles and conditions inline; slipstick bench new writes a template", ".toml"),
        _NAME], body="file")
    return "\n".join([
        "<h1>Add files</h1>", WITHOUT_SCRIPT,
        section("Recordings", recordings.html()),
        section("Files of a logger", _logger(benches, machines, machine)),
        section("Table", table.html()),
        section("Bench", bench_file.html())]).replace(
            "<section>", '<section class="upload">')


def _logger(benches: Sequence[str], machines: Sequence[str], machine: str | None) -> str:
    """The steps of an import: choose files, map their channels, see what would be imported, import."""
    subjects = [*((urlencode({"bench": name}), f"bench {name}") for name in benches),
                *((urlencode({"machine": name}), f"machine {name}") for name in machines)]
    if not subjects:
        return paragraph("An import needs a bench, which is added below, or a worker with the file of a machine: "
                         "slipstick work --machine FILE.py", "note")
    chosen = urlencode({"machine": machine}) if machine in machines else \
        subjects[len(benches) - 1][0] if benches else ""
    choose = Form("read-files", "/v1/recordings/proposal", "Read the channels", [
        Field("files", "Files", "MDF, MATLAB, CSV or Parquet, with the same channels in each", "file", required=True,
              several=True, accept=".mf4,.mdf,.mat,.parquet,.pq,.csv,.txt,.asc,.tsv,.dat,.lvm"),
        Field("subject", "Bench or machine", "on which they were recorded; machines are those of workers that were "
              "started with `--machine`", "choice", value=chosen, choices=subjects), _NAME], body="other")
    mapping = "\n".join([
        '<form class="act" id="mapping" method="post" novalidate hidden>',
        '<h3 tabindex="-1">The mapping</h3>',
        paragraph("Proposed from the names and units of the channels of the first file. Check each line, and "
                  "write a unit where the file states none, or a wrong one.", "about"),
        '<p class="open" hidden></p>', '<div id="mapping-rows"></div>',
        '<details class="experts"><summary>The mapping as a file</summary><div class="field">'
        '<label for="mapping-text">channels.toml</label><textarea id="mapping-text" rows="16" spellcheck="false" '
        'aria-describedby="mapping-about"></textarea><span class="about" id="mapping-about">what the fields above say; '
        "what you change here is used, until a field above changes. docs/your_files.md lists all keys"
        "</span></div></details>",
        '<p class="send"><button disabled>Show what would be imported</button><span class="busy" role="status"></span>'
        '</p><p class="wrong" role="alert" hidden></p></form>'])
    preview = ('<form class="act" id="preview" method="post" hidden><h3 tabindex="-1">What would be imported</h3>'
               '<div class="found"></div><p class="send"><button disabled>Import</button><span class="busy" '
               'role="status"></span></p><p class="wrong" role="alert" hidden></p></form>')
    return "\n".join([choose.html(), mapping, preview])


def _file(label: str, about: str, accept: str) -> Field:
    return Field("file", label, about, "file", accept=accept, required=True)
