"""`propagate`: the distributions of the output of a table that follow from those of its inputs."""

import argparse
from pathlib import Path
from typing import Any

from slipstick.errors import InvalidValue
from slipstick.interface.files import require_html, write
from slipstick.interface.propagate import propagate
from slipstick.interface.tables import csv_text
from slipstick.numerics.quantities import NotAQuantity, in_unit
from slipstick.table import Table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("table", type=Path, metavar="TABLE.h5", help="the table, a grid or a surrogate")
    add_inputs_arguments(parser)
    parser.add_argument("--output-std", metavar="VALUE",
                        help='standard deviation of the output noise, such as "3 ms", or a number in the unit of the '
                             "output (default: 0.003 s for shifting times, 0 for the output of another machine)")
    parser.add_argument("--condition", type=int, nargs="+", action="extend", metavar="N", dest="conditions",
                        help="numbers, from 0, of conditions of the table (default: all)")
    parser.add_argument("--tolerance", metavar="VALUE",
                        help='largest error of the expansions, such as "0.5 ms" (default: that of order 8, or of a '
                             "lower one for more than five inputs)")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the result as .json, or as .csv with a row for "
                                                                 "each condition")
    parser.add_argument("--report", type=Path, metavar="FILE.html",
                        help="write the report, one HTML page with a figure")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="write the picture as .svg, .png, .html or .json")


def add_inputs_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the distributions of the inputs, and of what holds outside the table."""
    parser.add_argument("--mean", required=True, metavar="A,B", help="mean of the input of each axis of the table, in "
                                                                     "multiples of its nominal value")
    parser.add_argument("--std", required=True, metavar="A,B", help="standard deviation of each input, in multiples of "
                                                                    "its nominal value; 0 for a fixed input")
    parser.add_argument("--family", metavar="A,B", help="family of each input: normal, lognormal, gamma, beta over the "
                                                        "range of its axis, or uniform (default: normal)")
    parser.add_argument("--outside", choices=("clip", "nan", "error"), default="clip",
                        help="what holds outside the table: the value at its nearest edge, no value, or an error "
                             "(default: %(default)s)")


def run(arguments: argparse.Namespace) -> int:
    """Propagate, print the result, and write the requested files."""
    require_output(arguments.out)
    if arguments.report is not None:
        require_html(arguments.report)
    table = Table.open(arguments.table)
    unit = table.output.unit
    result = propagate(table, **read_inputs(arguments), conditions=arguments.conditions, name=arguments.table.stem,
                       output_std=read_quantity("--output-std", arguments.output_std, unit),
                       tolerance=read_quantity("--tolerance", arguments.tolerance, unit))
    print(result.text)
    written = [result.plot().save(arguments.picture)] if arguments.picture else []
    if arguments.report:
        written.append(result.report(arguments.report))
    written += write_output(result, arguments.out)
    if written:
        print(f"\nWrote {', '.join(map(str, written))}")
    return 0


def read_inputs(arguments: argparse.Namespace) -> dict[str, Any]:
    """The arguments of the functions for these options; raises `InvalidValue`."""
    families = None if arguments.family is None else [name.strip() for name in arguments.family.split(",")]
    return {"mean": read_numbers("--mean", arguments.mean), "std": read_numbers("--std", arguments.std),
            "families": families, "outside": arguments.outside}


def read_numbers(option: str, text: str) -> list[float]:
    """Numbers with commas between them; raises `InvalidValue`."""
    try:
        return [float(number) for number in text.split(",")]
    except ValueError as error:
        raise InvalidValue(f"{option} is '{text}', which is no list of numbers",
                           f"Give a number for each axis of the table, such as {option} 1,1") from error


def read_quantity(option: str, text: str | None, unit: str) -> float | None:
    """A number in `unit`, from a text that may name another unit of the same kind; raises `InvalidValue`."""
    if text is None:
        return None
    try:
        float(text)
        quantity = f"{text} {unit}"
    except ValueError:
        quantity = text
    try:
        return in_unit(quantity, unit)
    except NotAQuantity as error:
        raise InvalidValue(f"{option} is '{text}': {error}", f"Give a number in {unit}, or a number and its unit") \
            from error


def require_output(path: Path | None) -> None:
    """Raise `InvalidValue` for a result in another form: other files, such as recordings, must not be replaced."""
    if path is not None and (path.suffix not in (".json", ".csv") or path.is_dir()):
        raise InvalidValue(f"'{path}' is not the name of a result", "Give a path that ends in .json or .csv")


def write_output(result: Any, path: Path | None) -> list[Path]:
    """Write a result with columns as JSON or CSV, by the suffix of `path`, if there is one; the written files."""
    if path is None:
        return []
    return [result.save(path) if path.suffix == ".json" else write(path, csv_text(result.columns).encode())]
