"""The tables of lab/docs/experiments.md from the CSV files of `lab/run experiments all`. Intervals are 95 % percentile intervals by
bootstrap over drives. Tables whose files are missing are left out.

    lab/run tables                                  # those of lab/docs/experiments, printed
    lab/run tables out --write                      # puts them between the marks of the page, and their CSV files into lab/docs/experiments
    lab/run tables --check                          # exits 1 where the page has others
    lab/run tables out --headlines-of lab/docs/experiments  # exits 1 where a headline lies outside of the interval in out"""
import math
import pathlib
import shutil
import sys

from . import bootstrap, marks, programs, results
from .results import select

OTHER_REAL = ("19", "MH_01_half", "MH_01_moving")
STREETS = ("d00", "d01", "d02", "d03", "d05", "d08", "d09", "d10")
SMALL = ("s1", "s2", "s3", "s4")
ALL = results.KITTI + OTHER_REAL + STREETS + SMALL
GROUPS = {"KITTI 01, 04, 06": results.KITTI, "Karlsruhe 19, MH_01 (2)": OTHER_REAL, "rendered streets (8)": STREETS,
          "rendered small rigs (4)": SMALL, "all drives": ALL}
SETUPS = ("paper", "product")
STEPS = ("1", "2", "3", "4", "5")
COMMITTED = programs.ROOT / "lab/docs/experiments"


def percent(values):
    """A mean with its interval, as a cell."""
    if len(values) < 2:
        return "%+.1f %%" % values[0] if values else "–"
    return "%+.1f %% [%.1f, %.1f]" % (bootstrap.mean(values), *bootstrap.interval(values))


def of_drives(rows, drives, column):
    """A column's finite values, one of each drive that is there."""
    return [value for value in rows[rows.sequence.isin(drives)][column] if math.isfinite(value)]


def cells(rows_by_setup, columns, groups=(results.KITTI, ALL)):
    """Of the set-ups, groups of drives and columns, in this order."""
    return [percent(of_drives(rows, drives, column)) for rows in rows_by_setup for drives in groups for column in columns]


def read(folder, name):
    return [results.read(folder / setup / name) for setup in SETUPS]


def freak(folder):
    return [select(rows, descriptor="freak", features=2320, tolerance_px=3.0, layout="left") for rows in read(folder, "matching.csv")]


def sift(folder):
    return [select(rows, descriptor="sift", features=2320, layout="left") for rows in read(folder, "sift/matching.csv")]


def inliers(folder, step="1-5"):
    return [select(rows, step=step, system="stereo") for rows in read(folder, "robustness.csv")]


CLAIMS = {"A, SN-FREAK": ("+26.3 %", freak, "improvement_percent"), "A, SN-SIFT": ("+7.35 %", sift, "improvement_percent"),
          "B, stereo FREAK": ("+19 % (text), +12.8 % (figure)", inliers, "gain_percent")}


def path_errors(folder):
    return [select(rows, step="1", model="refined") for rows in read(folder, "accuracy_summary.csv")]


def from_standard_to_stereo(rows, drives):
    """The mean error of both systems, as a cell."""
    return " → ".join(f"{bootstrap.mean(of_drives(select(rows, system=system), drives, 'mean_path_percent')):.2f}"
                      for system in ("standard", "stereo")) + " %"


def headlines(folder):
    """Values by name, one of each drive."""
    return {(claim, setup, name): of_drives(rows, GROUPS[name], column) for claim, (_, of, column) in CLAIMS.items()
            for setup, rows in zip(SETUPS, of(folder)) for name in ("KITTI 01, 04, 06", "all drives")}


def headline_table(folder):
    found = headlines(folder)
    columns = list(dict.fromkeys((setup, name) for _, setup, name in found))
    yield ["claim", "paper", *(f"{setup} set-up, {name}" for setup, name in columns)]
    for claim, (paper, _, _) in CLAIMS.items():
        yield [claim, paper, *(percent(found[(claim, *column)]) for column in columns)]
    errors = dict(zip(SETUPS, path_errors(folder)))
    yield ["C, stereo FREAK", "4.78 → 3.50 %", *(from_standard_to_stereo(errors[setup], GROUPS[name]) for setup, name in columns)]


def group_table(folder):
    yield ["drives", "number", "paper set-up, on 7 px", "on the better of 7 and 14 px", "product set-up, on 7 px", "on the better of 7 and 14 px"]
    rows = freak(folder)
    for name, drives in GROUPS.items():
        yield [name, len(of_drives(rows[0], drives, "improvement_percent")),
               *cells(rows, ("improvement_percent", "improvement_on_best_percent"), [drives])]


def ablation_table(folder):
    yield ["set-up", "change", "by depth", "7 px", "improvement", "on the better of 7 and 14 px"]
    names = [path.name for path in (folder / "ablation").iterdir()]
    for setup in ("product", "paper"):
        for name in sorted((n for n in names if n.startswith(setup)), key=lambda n: (n != setup + " as it is", n)):
            rows = select(results.read(folder / "ablation" / name / "matching.csv"), tolerance_px=3.0)
            means = (bootstrap.mean(of_drives(rows, results.KITTI, column)) for column in ("scale_normalised", "standard"))
            yield [setup, name[len(setup) + 1:], *(f"{mean:.1f}" for mean in means),
                   *cells([rows], ("improvement_percent", "improvement_on_best_percent"), [results.KITTI])]


def robustness_table(folder):
    yield ["step", "paper", "paper set-up, KITTI", "all drives", "product set-up, KITTI", "all drives"]
    paper = [results.gain(*of_step) for of_step in zip(*results.PUBLISHED_INLIERS.values())]
    for step, text in zip((*STEPS, "1-5"), (*(f"+{value:.1f} %" for value in paper), "+12.8 % (text: +19 %)")):
        yield [step.replace("-", "…"), text, *cells(inliers(folder, step), ["gain_percent"])]


def accuracy_table(folder):
    yield ["set-up", "step", "refined: standard", "stereo", "gain", "aligned by depth: standard", "stereo", "gain"]
    for setup, rows in zip(SETUPS, read(folder, "accuracy_summary.csv")):
        for step in STEPS:
            row = [setup, step]
            for model in ("refined", "aligned_by_depth"):
                standard, stereo = (select(rows, step=step, model=model, system=system) for system in ("standard", "stereo"))
                row += [f"{bootstrap.mean(of_drives(some, ALL, 'pair_percent')):.2f} %" for some in (standard, stereo)]
                row += cells([stereo], ["gain_percent"], [ALL])
            yield row


def scale_table(folder):
    yield ["drives", "method", "scale 1", "1.5", "2", "3", "4", "features a view", "CPU time a view"]
    found = results.read(folder / "scale_change/scale_change.csv")
    for kind, rows in (("real: KITTI 04, 06", found[found.sequence.isin(results.KITTI)]), ("rendered", found[~found.sequence.isin(results.KITTI)])):
        for method, of_method in rows.groupby("method", sort=False):
            sums = of_method.groupby("scale", sort=False)[["correct", "visible"]].sum()
            yield [kind, method, *(f"{100.0 * correct / visible:.1f} % ({correct:.0f})" if visible else "–"
                                   for correct, visible in sums.itertuples(index=False)),
                   f"{of_method.features.mean():.0f}", f"{of_method.ms_per_pair.mean():.0f} ms"]


TABLES = {"headlines": headline_table, "matching by group": group_table, "ablation": ablation_table, "robustness": robustness_table,
          "accuracy": accuracy_table, "scale change": scale_table}


def tables_of(folder):
    """Lines of the tables by name; without those whose files are missing, as after `lab/run experiments all --only …`."""
    parts = {}
    for name, rows in TABLES.items():
        try:
            parts[name] = marks.lines(list(rows(folder)))
        except FileNotFoundError:
            pass
    if not parts:
        sys.exit(f"error: {folder} has no results of lab/run experiments all")
    return parts


def page_with(parts, page):
    for name in marks.names(page):
        if name in parts:
            page = marks.between(page, name, parts[name])
        else:
            print(f"left as it is, its files are missing: {name}", file=sys.stderr)
    return page


def keep(folder):
    """Another folder's rows by drive in place of those that stand beside the page."""
    for path in COMMITTED.rglob("*.csv"):
        new = folder / path.relative_to(COMMITTED)
        if new.exists() and not new.samefile(path):
            shutil.copyfile(new, path)


def outside(old, new):
    """Prints the headlines of two folders, and counts those of `old` whose mean lies outside of the interval of `new`."""
    now, count = headlines(new), 0
    for name, values in headlines(old).items():
        low, high = bootstrap.interval(now[name])
        inside = low <= bootstrap.mean(values) <= high
        count += not inside
        print(f"{'ok     ' if inside else 'OUTSIDE'} {', '.join(name)}: {bootstrap.mean(values):+.1f} %, now {percent(now[name])}")
    return count


def options(parser):
    parser.add_argument("folder", nargs="?", type=pathlib.Path, default=COMMITTED, help="what lab/run experiments all wrote [default: %(default)s]")
    parser.add_argument("--check", action="store_true", help="exits 1 where the page's tables are others")
    parser.add_argument("--headlines-of", metavar="FOLDER", type=pathlib.Path, help="results whose headlines must lie inside of the intervals")
    marks.add_write(parser, marks.EXPERIMENTS)


def main(arguments):
    parts = tables_of(arguments.folder)
    page = marks.EXPERIMENTS.read_text()
    if arguments.check:
        return None if page_with(parts, page) == page else f"error: the tables of {marks.EXPERIMENTS} are not those of {arguments.folder}"
    if arguments.write:
        arguments.write.write_text(page_with(parts, page))
        keep(arguments.folder)
    elif arguments.headlines_of:
        return outside(arguments.headlines_of, arguments.folder)
    else:
        for name, lines in parts.items():
            print(f"{name}\n\n" + "\n".join(lines) + "\n")
