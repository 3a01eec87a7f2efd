"""``python -m wfbook equations``: print the map."""

import argparse
import json
from typing import Any

from wfbook.arguments import FAILED, OK, CommandError
from wfbook.equations.atlas import atlas
from wfbook.equations.text import page, records, table


def add_to(commands: Any) -> None:
    """Add the command's parser to the subparsers of the program's."""
    parser = commands.add_parser(
        "equations", help="which function, chapter and test each numbered equation has", allow_abbrev=False
    )
    parser.set_defaults(command=run)
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="print JSON instead of a table")
    form.add_argument("--markdown", action="store_true", help="print the page of the book")


def run(arguments: argparse.Namespace) -> int:
    """Draw the map and print it.

    Returns:
        0 if nothing is missing in it and nothing leads nowhere, else 1.

    Raises:
        CommandError: there is no checkout to draw it from.
    """
    try:
        drawn = atlas()
    except FileNotFoundError as error:
        raise CommandError(str(error), FAILED) from None
    if arguments.json:
        print(json.dumps({"equations": records(drawn), "wrong": drawn.wrong}, indent=1, ensure_ascii=False))
    else:
        print(page(drawn) if arguments.markdown else table(drawn))
    return FAILED if drawn.wrong else OK
