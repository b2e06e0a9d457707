"""Tables in Markdown: printed row by row as they are measured, and put between the marks of a page. The last line before the end mark may
have the commit whose programs measured the table."""
import re
import sys

from .programs import ROOT

ACCURACY = PERFORMANCE = SELF_CHECK = ROOT / "docs/precision.md"
FAULTS = ROOT / "lab/docs/faults.md"
RENDERED = ROOT / "lab/docs/rendered_drives.md"
PLACES = ROOT / "lab/docs/places.md"
EXPERIMENTS = ROOT / "lab/docs/experiments.md"


def line(cells):
    return "| " + " | ".join(map(str, cells)) + " |"


def lines(rows):
    """Of a table whose first row is its head."""
    head, *body = rows
    return [line(head), line(["---"] * len(head)), *map(line, body)]


def pattern(name):
    """Of all between <!-- name --> and the next <!-- end -->: the lines, and the line of their commit if there is one."""
    return re.compile(rf"(?<=<!-- {re.escape(name)} -->)(.*?)(?:\n\n\*Commit (\w+)\.\*)?(?=\n<!-- end -->)", re.DOTALL)


def names(text):
    return [name for name in re.findall(r"^<!-- ([a-z ]+) -->$", text, re.MULTILINE) if name != "end"]


def between(text, name, block):
    """The text with other lines between <!-- name --> and the next <!-- end -->. The commit of other lines goes."""
    new = "".join("\n" + row for row in block)
    text, count = pattern(name).subn(lambda match: match.group() if match.group(1) == new else new, text, count=1)
    if count == 0:
        print(f"not written: the page has no mark <!-- {name} -->", file=sys.stderr)
    return text


def commit(text, name):
    """Of a table; None where it has none."""
    found = pattern(name).search(text)
    return found and found.group(2)


def with_commit(text, name, hexadecimal):
    return pattern(name).sub(lambda match: f"{match.group(1)}\n\n*Commit {hexadecimal}.*", text, count=1)


def put(page, name, block):
    page.write_text(between(page.read_text(), name, block))


def show(rows, page=None, name=""):
    """Prints the rows of a table, each as soon as it comes, and puts them into a page if there is one. Returns all lines."""
    shown = []
    for row in rows:
        new = [line(row)] if shown else lines([row])
        print("\n".join(new), flush=True)
        shown += new
    if page:
        put(page, name, shown)
    return shown


def add_write(parser, page):
    parser.add_argument("--write", action="store_const", const=page, help=f"puts the tables between the marks of {page.relative_to(ROOT)}")


def check_names(names, known):
    unknown = [name for name in names if name not in known]
    if unknown:
        sys.exit(f"error: no such names: {', '.join(unknown)}; there are {', '.join(known)}")
