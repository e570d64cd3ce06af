"""Files of data-acquisition systems in public repositories, read by the readers of `worker import`.

The files are not part of this project. Clone the repositories below into one folder and give it:

    python -m evidence.robustness.foreign_files CLONES

A row counts the channels of numbers, and those of them that were read; the channels refused in these files hold texts.
"""

import io
import re
import subprocess
import sys
from pathlib import Path

from evidence.robustness.table import Row, replace_rows
from slipstick.acquisition import open_source
from slipstick.errors import BadRecording

FILES = (
    ("danielhrisca/asammdf", "8491873b5fe8128c2f752c3b7d1df6ec696e541f",
     "test/asammdf/gui/resources/ASAP2_Demo_V171.mf4"),
    ("ratal/mdfr", "c8a554f48edd70bcd14068e5531ce832324c889c", "test_files/test_basic.mf4"),
    ("CSS-Electronics/api-examples", "f7932bacb2969dec591508d15f89e8a898ca99c6",
     "examples/data-processing/LOG/2F6913DB/00000004/00000001.MF4"),
    ("CSS-Electronics/api-examples", "f7932bacb2969dec591508d15f89e8a898ca99c6",
     "examples/data-processing/LOG/FCBF0606/00003482/00000001-60B621D9.MF4"),
    ("CSS-Electronics/api-examples", "f7932bacb2969dec591508d15f89e8a898ca99c6",
     "examples/other/s3-upload-log-files/LOG/7512BE4D/00000427/00000001.MF4"),
)
"""Repository, commit and path of each file."""


def read_file(repository: str, commit: str, path: str, content: bytes) -> Row:
    """Read all channels of one file, and say which program wrote it."""
    source = open_source(path, io.BytesIO(content))
    channels, samples, refused = source.listed(), 0, 0
    for channel in channels:
        try:
            samples += len(source.channel(channel.name).values)
        except BadRecording:
            refused += 1
    vendor = re.search(rb"<tool_vendor>([^<]*)</tool_vendor>", content)
    tool = re.search(rb"<tool_id>([^<]*)</tool_id>", content)
    writer = " ".join(name[1].decode("utf-8", "replace") for name in (vendor, tool) if name).replace("&amp;", "&")
    state = "unfinished" if content.startswith(b"UnFinMF") else "finished"
    return Row(f"{repository}@{commit[:10]}:{path}", len(channels), len(channels) - refused, "channels",
               f"{samples} samples; {source.remarks[0]}, {state}, by {writer.strip()}")


def main(clones: Path) -> None:
    """Read the files, and replace the rows of the table."""
    rows = []
    for repository, commit, path in FILES:
        content = subprocess.run(["git", "-C", clones / repository.split("/")[1], "show", f"{commit}:{path}"],
                                 check=True, capture_output=True).stdout
        rows.append(read_file(repository, commit, path, content))
    replace_rows("foreign files", rows, "python -m evidence.robustness.foreign_files CLONES")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
