"""The page on which files are added: recordings, files of a logger with their mapping, tables and benches."""

from collections.abc import Sequence

from slipstick.bench.conditions import CONDITION_UNITS, INPUT_UNITS
from slipstick.pictures.theme import in_words
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.report.markup import paragraph, section

from .forms import NAME_PATTERN, NAME_RULE, WITHOUT_SCRIPT, Field, Form

SCRIPTS = ('<script src="/static/front/act.js" type="module"></script>'
           '<script src="/static/front/mapping.js" type="module"></script>')
_NAME = Field("name", "Name", "under which pages and programs find it", place="query", required=True,
              pattern=NAME_PATTERN, rule=NAME_RULE)


def upload_page(benches: Sequence[str], machine_tables: Sequence[str]) -> str:
    """Return the content of the page; `machine_tables` are the tables of other machines."""
    bench = Field("bench", "Bench", "whose current profiles a CSV file numbers; an HDF5 file has its own", "choice",
                  choices=[("", "none"), *((name, name) for name in benches)], place="query",
                  value=benches[-1] if benches else "")
    other = [Field("table", "Table of another machine", "whose measurements a CSV file has, instead of a bench",
                   "choice", choices=[("", "none"), *((name, name) for name in machine_tables)], place="query")]
    recordings = Form("upload-recordings", "/v1/recordings", "Upload the recordings", [
        _file("File", "CSV with a row for each engagement, or HDF5 with signals or with runs of a declared machine",
              ".csv,.h5,.hdf5"), _NAME, bench], other if machine_tables else (), body="file")
    table = Form("upload-table", "/v1/tables", "Upload the table", [
        _file("File", "HDF5, as slipstick build writes it or as your program computed it", ".h5,.hdf5"), _NAME],
        body="file")
    bench_file = Form("upload-bench", "/v1/benches", "Upload the bench", [
        _file("File", "TOML, with profiles and conditions inline; slipstick bench new writes a template", ".toml"),
        _NAME], body="file")
    return "\n".join([
        "<h1>Add files</h1>", WITHOUT_SCRIPT,
        section("Recordings", recordings.html()),
        section("Files of a logger", _logger(benches)),
        section("Table", table.html()),
        section("Bench", bench_file.html())]).replace(
            "<section>", '<section class="upload">')


def _logger(benches: Sequence[str]) -> str:
    """The steps of an import: choose files, map their channels, see what would be cut, import."""
    if not benches:
        return paragraph("An import needs a bench: add one below.", "note")
    choose = Form("read-files", "/v1/recordings/proposal", "Read the channels", [
        Field("files", "Files", "MDF, MATLAB, CSV or Parquet, with the same channels in each; those of a declared "
              "machine are imported by slipstick import --machine, where its file is", "file", required=True,
              several=True, accept=".mf4,.mdf,.mat,.parquet,.pq,.csv,.txt,.asc,.tsv,.dat,.lvm"),
        Field("bench", "Bench", "on which they were recorded", "choice", value=benches[-1],
              choices=[(name, name) for name in benches]), _NAME], body="other")
    signals = "\n".join(_channel(f"signals.{name}", in_words(name), unit) for name, unit in SIGNAL_UNITS.items())
    time = _channel("time", "time", "s")
    command = "".join([
        _channel("shift_command", "shift command", "", has_unit=False),
        _entry("shift_command.above", "rises above", "in the unit of the file"),
        _entry("shift_command.time", "or at the time", "from the first sample of a file, such as 100 ms")])
    conditions = "\n".join(_condition(name, unit) for name, unit in {**CONDITION_UNITS, **INPUT_UNITS}.items())
    mapping = "\n".join([
        '<form class="act" id="mapping" method="post" novalidate hidden>',
        '<h3 tabindex="-1">Which channel is what</h3>',
        paragraph("Proposed from the names and units of the channels of the first file. Check each line, and "
                  "write a unit where the file states none, or a wrong one.", "about"),
        '<p class="open" hidden></p>',
        f'<div class="map" id="map-signals">{time}{signals}{_channel("further.oil_temperature", "oil temperature", "")}'
        "</div>", "<h3>Begin of an engagement</h3>", f'<div class="map">{command}</div>',
        "<h3>Conditions</h3>", paragraph("A number with its unit, or a channel, of which the mean is taken.", "about"),
        f'<div class="map">{conditions}</div>',
        '<details class="experts"><summary>The mapping as a file</summary><div class="field">'
        '<label for="mapping-text">channels.toml</label><textarea id="mapping-text" rows="16" spellcheck="false" '
        'aria-describedby="mapping-about"></textarea><span class="about" id="mapping-about">what the fields above say; '
        "what you change here is used, until a field above changes. docs/your_files.md lists all keys: limits, "
        "patterns of file names, a sheet of conditions</span></div></details>",
        '<p class="send"><button disabled>Show what would be imported</button><span class="busy" role="status"></span>'
        '</p><p class="wrong" role="alert" hidden></p></form>'])
    preview = ('<form class="act" id="preview" method="post" hidden><h3 tabindex="-1">What would be imported</h3>'
               '<div class="found"></div><p class="send"><button disabled>Import</button><span class="busy" '
               'role="status"></span></p><p class="wrong" role="alert" hidden></p></form>')
    return "\n".join([choose.html(), mapping, preview])


def _file(label: str, about: str, accept: str) -> Field:
    return Field("file", label, about, "file", accept=accept, required=True)


def _channel(key: str, label: str, unit: str, has_unit: bool = True) -> str:
    """A row that chooses a channel, its unit where the file states none or a wrong one, and its sign."""
    id = f"map-{key.replace('.', '-')}"
    given = (f'<input type="text" class="unit" name="{key}.unit" aria-label="unit of {label}" autocomplete="off" '
             f'spellcheck="false" placeholder="{unit or "unit"}" size="8">') if has_unit else ""
    sign = (f'<label class="sign"><input type="checkbox" name="{key}.sign" aria-label="opposite sign of {label}"> ×−1'
            "</label>") if key.startswith("signals.") else ""
    return (f'<div class="row" data-key="{key}" data-needs="{unit or "unit"}"><label for="{id}">{label}</label>'
            f'<select id="{id}" name="{key}" aria-describedby="{id}-why"><option value="">not recorded</option>'
            f"</select>{given}{sign}"
            f'<span class="about" id="{id}-why"></span><span class="wrong" id="{id}-wrong" hidden></span></div>')


def _entry(key: str, label: str, about: str) -> str:
    id = f"map-{key.replace('.', '-')}"
    return (f'<div class="row"><label for="{id}">{label}</label><input type="text" id="{id}" name="{key}" '
            f'inputmode="decimal" autocomplete="off" aria-describedby="{id}-why"><span class="about" id="{id}-why">'
            f'{about}</span><span class="wrong" id="{id}-wrong" hidden></span></div>')


def _condition(name: str, unit: str) -> str:
    """A row that states a condition as a number with its unit, or chooses a channel."""
    key, id, label = f"conditions.{name}", f"map-conditions-{name}", in_words(name)
    about = "only of a bench without a torque converter" if name in INPUT_UNITS else ""
    example = "0" if unit == "1" else f"1 {unit}"
    return (f'<div class="row condition" data-key="{key}"><label for="{id}">{label}</label>'
            f'<input type="text" id="{id}" name="{key}.value" autocomplete="off" spellcheck="false" '
            f'placeholder="{example}" aria-describedby="{id}-why"><select name="{key}" aria-label="channel of {label}">'
            '<option value="">or a channel</option></select>'
            f'<span class="about" id="{id}-why">{about}</span><span class="wrong" id="{id}-wrong" hidden></span></div>')
