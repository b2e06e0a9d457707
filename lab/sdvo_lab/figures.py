"""Makes the tables of the pages anew: lab/figures.yaml has the commands, the commit of each table, and the digest of what the odometry
said then (lab/run golden digest). Hours; a table is recorded as soon as it is written, and the next run goes on with the others.

    lab/run figures                         # all tables of another digest than this build's
    lab/run figures --only errors guises    # these, whatever their digest is
    lab/run figures --list                  # commits of all tables, and which are old

The digest does not see a change of places, of the renderer, of the experiments or of what a fault alone shows: name their tables with
--only after one. Tables without marks are copied by hand, and so are their entries."""
import os
import re
import shlex
import subprocess
import sys

import yaml

from . import drives, golden, marks, programs

LIST = programs.ROOT / "lab/figures.yaml"
OUTPUT = programs.ROOT / ".catkin_ws/long"
SOURCES = ("src", "include", "lab/sdvo_lab", "lab/render", "lab/experiments", "lab/tools")
NOT_MEASURED = ("docs/interface.md",)  # lists of test/check_interface


def read():
    return yaml.safe_load(LIST.read_text())


def write(entries):
    head = "".join(line for line in LIST.read_text().splitlines(True) if line.startswith("#"))
    LIST.write_text(head + "\n" + yaml.safe_dump(entries, sort_keys=False, allow_unicode=True, width=1000, default_flow_style=None))


def missing_data():
    return [variable for kind, variable in drives.DATA_SETS.items() if drives.data_set(kind) is None]


def is_old(entry, digest):
    return entry.get("digest") != digest


def page_errors(entries):
    """Where the list and the pages have other tables, or other commits."""
    pages = [programs.ROOT / "README.md", *sorted(programs.ROOT.glob("docs/*.md")), *sorted(programs.ROOT.glob("lab/docs/*.md"))]
    texts = {str(page.relative_to(programs.ROOT)): page.read_text() for page in pages}
    there = {(page, name) for page, text in texts.items() if page not in NOT_MEASURED for name in marks.names(text)}
    listed = [(entry["page"], mark, entry) for entry in entries.values() for mark in entry.get("marks", ())]
    yield from (f"{page}: lab/figures.yaml lacks the table {mark}" for page, mark in sorted(there - {found[:2] for found in listed}))
    for page, mark, entry in listed:
        if (page, mark) not in there:
            yield f"{page}: no marks for the table {mark} of lab/figures.yaml"
        elif marks.commit(texts[page], mark) != entry.get("commit"):
            yield f"{page}: the table {mark} has not the commit of lab/figures.yaml: lab/run figures --only NAME writes both"
    for name, entry in entries.items():
        if "heading" not in entry:
            continue
        section = re.search(rf"^#+ {re.escape(entry['heading'])}$(.*?)(?=^#|\Z)", texts[entry["page"]], re.MULTILINE | re.DOTALL)
        if not section:
            yield f"{entry['page']}: no heading {entry['heading']}, which {name} of lab/figures.yaml names"
        elif "commit" in entry and f"*Commit {entry['commit']}.*" not in section.group(1):
            yield f"{entry['page']}: below {entry['heading']} stands no *Commit {entry['commit']}.* of {name} in lab/figures.yaml"


def old_errors(entries, digest):
    """Tables of another odometry, without a reason."""
    return [f"{entry['page']}: {name} is of {entry.get('commit')}, and poses, states or covariances are others now: lab/run figures --only {name}, "
            "or `exempt: REASON` in lab/figures.yaml" for name, entry in entries.items() if is_old(entry, digest) and not entry.get("exempt")]


def git(*arguments):
    return subprocess.run(["git", "-C", str(programs.ROOT), *arguments], check=True, stdout=subprocess.PIPE, universal_newlines=True).stdout.strip()


def make(entry):
    """Runs the commands of a table; whether all succeeded."""
    for command in entry["run"]:
        command = command.format(output=OUTPUT)
        print(f"    lab/run {command}", flush=True)
        if subprocess.run([str(programs.ROOT / "lab/run"), *shlex.split(command)]).returncode != 0:
            return False
    return True


def record(name, commit, digest):
    """The commit below a table that was just written, and in the list, which may have been edited meanwhile."""
    entries = read()
    entry = entries[name]
    entry.update(commit=commit, digest=digest)
    entry.pop("exempt", None)
    page = programs.ROOT / entry["page"]
    for mark in entry["marks"]:
        page.write_text(marks.with_commit(page.read_text(), mark, commit))
    write(entries)


def rows(entries, digest):
    yield ["table", "page", "commit", "state"]
    for name, entry in entries.items():
        state = "unknown" if digest is None else "old" if is_old(entry, digest) else "present"
        yield [name, entry["page"], entry.get("commit", "–"), state + (", exempt: " + entry["exempt"] if entry.get("exempt") else "")]


def options(parser):
    parser.add_argument("--only", nargs="+", metavar="NAME", help="tables of lab/figures.yaml [default: the old ones]")
    parser.add_argument("--list", action="store_true", help="prints the list and runs nothing")


def main(arguments):
    entries = read()
    marks.check_names(arguments.only or [], entries)
    if arguments.list:
        marks.show(rows(entries, None if missing_data() else golden.digest()))
        return 0
    if missing_data():
        sys.exit(f"error: the digest of the odometry needs {', '.join(missing_data())}")
    if git("status", "--porcelain", "--", *SOURCES):
        sys.exit("error: commit the sources first: tables carry the commit that made them")
    if "TOOLS" not in os.environ:
        subprocess.run([str(programs.ROOT / "scripts/build"), "all"], check=True)
    commit, digest, failed = git("rev-parse", "--short=8", "HEAD"), golden.digest(), []
    OUTPUT.mkdir(parents=True, exist_ok=True)
    for name, entry in entries.items():
        if name not in arguments.only if arguments.only else not is_old(entry, digest):
            continue
        print(f"{name}, {entry['page']}", flush=True)
        if "marks" not in entry:
            print("    by hand: " + "; ".join(entry["run"]))
        elif make(entry):
            record(name, commit, digest)
        else:
            failed.append(name)
    return f"error: failed: {', '.join(failed)}" if failed else 0
