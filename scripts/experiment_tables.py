#!/usr/bin/env python3
"""The tables of docs/experiments.md from the CSV files of `run_experiments all`.

A table stands in a page between the lines <!-- NAME --> and <!-- /NAME -->. Intervals are 95 % percentile intervals by bootstrap over drives."""
import argparse
import csv
import math
import os
import random
import re
import sys

KITTI = ("01", "04", "06")
OTHER_REAL = ("19", "MH_01_half", "MH_01_moving")
STREETS = ("d00", "d01", "d02", "d03", "d05", "d08", "d09", "d10")
SMALL = ("s1", "s2", "s3", "s4")
GROUPS = (("KITTI 01, 04, 06", KITTI), ("Karlsruhe 19, MH_01 (2)", OTHER_REAL), ("rendered streets (8)", STREETS),
          ("rendered small rigs (4)", SMALL), ("all drives", KITTI + OTHER_REAL + STREETS + SMALL))
SETUPS = ("paper", "product")


FOUND = []  # files that the present table was made of


def read(folder, name):
    path = os.path.join(folder, name)
    if not os.path.exists(path):
        return []
    FOUND.append(path)
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def number(text):
    return float(text) if text else float("nan")


def mean(values):
    return sum(values) / len(values)


def bootstrap(values, draws=5000):
    """The 95 % percentile interval of the mean; the value itself where there is but one."""
    generator = random.Random(1)
    means = sorted(mean(generator.choices(values, k=len(values))) for _ in range(draws))
    return means[round(0.025 * (draws - 1))], means[round(0.975 * (draws - 1))]


def percent(values):
    """A mean with its interval, as a cell."""
    if not values:
        return "–"
    if len(values) == 1:
        return "%+.1f %%" % values[0]
    return "%+.1f %% [%.1f, %.1f]" % ((mean(values),) + bootstrap(values))


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "| " + " | ".join("---" for _ in header) + " |"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def chosen(rows, **wanted):
    return [r for r in rows if all(r[key] == value for key, value in wanted.items())]


def of_drives(rows, drives, column):
    """A column's finite values, one of each drive that is there."""
    return [number(r[column]) for r in rows if r["sequence"] in drives and math.isfinite(number(r[column]))]


def freak(folder, setup, features="2320", tolerance="3.000", layout="left"):
    return chosen(read(folder, setup + "/matching.csv"), descriptor="freak", features=features, tolerance_px=tolerance,
                  layout=layout)


def sift(folder, setup):
    return chosen(read(folder, setup + "/sift/matching.csv"), descriptor="sift", features="2320", layout="left")


def inliers(folder, setup, step="1-5", system="stereo"):
    return chosen(read(folder, setup + "/robustness.csv"), step=step, system=system)


def headlines(folder):
    """Values by name, one of each drive."""
    found = {}
    for setup in SETUPS:
        for name, drives in (GROUPS[0], GROUPS[-1]):
            found["A, SN-FREAK, %s, %s" % (setup, name)] = of_drives(freak(folder, setup), drives, "improvement_percent")
            found["A, SN-SIFT, %s, %s" % (setup, name)] = of_drives(sift(folder, setup), drives, "improvement_percent")
            found["B, stereo FREAK, %s, %s" % (setup, name)] = of_drives(inliers(folder, setup), drives, "gain_percent")
    return found


def headline_table(folder):
    found = headlines(folder)
    published = {"A, SN-FREAK": "+26.3 %", "A, SN-SIFT": "+7.35 %", "B, stereo FREAK": "+19 % (text), +12.8 % (figure)"}
    rows = []
    for claim, paper in published.items():
        if not any(found["%s, %s, %s" % (claim, setup, GROUPS[0][0])] for setup in SETUPS):
            return None  # not all experiments were run
        cells = [percent(found["%s, %s, %s" % (claim, setup, group)])
                 for setup in SETUPS for group in (GROUPS[0][0], GROUPS[-1][0])]
        rows.append([claim, paper] + cells)
    return table(["claim", "paper"] + ["%s set-up, %s" % (setup, group) for setup in SETUPS
                                       for group in ("KITTI 01, 04, 06", "all drives")], rows)


def group_table(folder):
    rows = []
    for name, drives in GROUPS:
        rows.append([name, str(len(of_drives(freak(folder, "paper"), drives, "improvement_percent")))] +
                    [percent(of_drives(freak(folder, setup), drives, column)) for setup in SETUPS
                     for column in ("improvement_percent", "improvement_on_best_percent")])
    return table(["drives", "number", "paper set-up, on 7 px", "on the better of 7 and 14 px", "product set-up, on 7 px",
                  "on the better of 7 and 14 px"], rows)


def drive_table(folder):
    rows = []
    for drive in GROUPS[-1][1]:
        cells = []
        for setup in SETUPS:
            found = chosen(freak(folder, setup), sequence=drive)
            for r in found:
                cells += ["%.1f" % number(r["scale_normalised"]), "%.1f" % number(r["standard"]),
                          "%+.1f %%" % number(r["improvement_percent"])]
        published = [r["paper_percent"] for r in chosen(freak(folder, "paper"), sequence=drive)]
        if cells:
            rows.append([drive] + cells + ["+%.1f %%" % number(p) if p else "–" for p in published])
    return table(["drive", "paper set-up: by depth", "7 px", "improvement", "product set-up: by depth", "7 px",
                  "improvement", "paper"], rows)


def tolerance_table(folder):
    rows = []
    for tolerance in ("1.000", "2.000", "3.000"):
        rows.append(["%s px" % tolerance[0]] +
                    [percent(of_drives(freak(folder, setup, tolerance=tolerance), drives, "improvement_percent"))
                     for setup in SETUPS for drives in (KITTI, GROUPS[-1][1])])
    return table(["tolerance", "paper set-up, KITTI", "all drives", "product set-up, KITTI", "all drives"], rows)


def count_table(folder):
    published = {"310": "+11.6 %", "1350": "+15.4 %", "2320": "+26.4 %"}
    rows = []
    for features, paper in published.items():
        rows.append([features, paper] +
                    [percent(of_drives(freak(folder, setup, features=features), drives, "improvement_percent"))
                     for setup in SETUPS for drives in (KITTI, GROUPS[-1][1])])
    return table(["N", "paper", "paper set-up, KITTI", "all drives", "product set-up, KITTI", "all drives"], rows)


def stereo_table(folder):
    rows = []
    for name, drives in GROUPS:
        rows.append([name] + [percent(of_drives(freak(folder, setup, layout="left+right"), drives,
                                                "improvement_on_standard_left_percent")) for setup in SETUPS])
    return table(["drives", "paper set-up", "product set-up"], rows)


def sift_table(folder):
    rows = []
    for name, drives in GROUPS:
        rows.append([name] + [percent(of_drives(sift(folder, setup), drives, column)) for setup in SETUPS
                              for column in ("improvement_percent", "improvement_on_best_percent")])
    return table(["drives", "paper set-up, on 7 px", "on the better of 5 and 7 px", "product set-up, on 7 px",
                  "on the better of 5 and 7 px"], rows)


def ablation_table(folder):
    rows = []
    base = os.path.join(folder, "ablation")
    names = sorted(os.listdir(base)) if os.path.isdir(base) else []
    for setup in ("product", "paper"):
        for name in sorted((n for n in names if n.startswith(setup)), key=lambda n: (n != setup + " as it is", n)):
            found = [r for r in read(base, name + "/matching.csv") if r["sequence"] in KITTI]
            if not found:
                continue
            rows.append([setup, name[len(setup) + 1:]] +
                        ["%.1f" % mean([number(r[column]) for r in found]) for column in ("scale_normalised", "standard")] +
                        [percent([number(r["improvement_percent"]) for r in found]),
                         percent([number(r["improvement_on_best_percent"]) for r in found])])
    return table(["set-up", "change", "by depth", "7 px", "improvement", "on the better of 7 and 14 px"], rows)


def robustness_table(folder):
    published = {"1": "+5.6 %", "2": "+12.6 %", "3": "+21.6 %", "4": "+21.2 %", "5": "+22.7 %",
                 "1-5": "+12.8 % (text: +19 %)"}
    rows = []
    for step, paper in published.items():
        rows.append([step.replace("-", "…"), paper] +
                    [percent(of_drives(inliers(folder, setup, step), drives, "gain_percent"))
                     for setup in SETUPS for drives in (KITTI, GROUPS[-1][1])])
    return table(["step", "paper", "paper set-up, KITTI", "all drives", "product set-up, KITTI", "all drives"], rows)


def accuracy_table(folder):
    rows = []
    for setup in SETUPS:
        found = read(folder, setup + "/accuracy_summary.csv")
        for step in "12345":
            cells = []
            for model in ("refined", "aligned_by_depth"):
                of_step = chosen(found, step=step, model=model)
                drives = [r["sequence"] for r in chosen(of_step, system="stereo") if r["sequence"] != "mean"]
                errors = [mean(of_drives(chosen(of_step, system=system), drives, "pair_percent"))
                          if drives else float("nan") for system in ("standard", "stereo")]
                cells += ["%.2f %%" % error for error in errors]
                cells.append(percent(of_drives(chosen(of_step, system="stereo"), drives, "gain_percent")))
            if found:
                rows.append([setup, step] + cells)
    return table(["set-up", "step", "refined: standard", "stereo", "gain", "aligned by depth: standard", "stereo",
                  "gain"], rows)


def path_table(folder):
    """Errors of sub-paths of 5 m and more, of drives that are long enough."""
    rows = []
    for setup in SETUPS:
        for system in ("standard", "stereo"):
            found = chosen(read(folder, setup + "/accuracy_summary.csv"), step="1", model="refined", system=system)
            drives = [r["sequence"] for r in found if r["sequence"] != "mean"]
            errors = [of_drives(found, drives, column)
                      for column in ("best_path_percent", "mean_path_percent", "worst_path_percent")]
            if not all(errors):
                continue
            paper = chosen(found, sequence="mean")[0]
            rows.append([setup, system, str(len(errors[0]))] + ["%.2f" % mean(values) for values in errors] +
                        ["%.2f / %.2f / %.2f" % tuple(number(paper[c]) for c in ("paper_best", "paper_mean", "paper_worst"))])
    return table(["set-up", "system", "drives", "best", "mean", "worst", "paper: best / mean / worst"], rows)


def scale_table(folder):
    rows = []
    found = read(folder, "scale_change/scale_change.csv")
    kinds = (("real: KITTI 04, 06", lambda d: d in KITTI), ("rendered", lambda d: d not in KITTI))
    for kind, belongs in kinds:
        for method in dict.fromkeys(r["method"] for r in found):
            of_method = [r for r in found if r["method"] == method and belongs(r["sequence"])]
            if not of_method:
                continue
            cells = []
            for scale in dict.fromkeys(r["scale"] for r in of_method):
                of_scale = chosen(of_method, scale=scale)
                visible = sum(number(r["visible"]) for r in of_scale)
                correct = sum(number(r["correct"]) for r in of_scale)
                cells.append("%.1f %% (%d)" % (100.0 * correct / visible, correct) if visible else "–")
            rows.append([kind, method] + cells + ["%.0f" % mean([number(r["features"]) for r in of_method]),
                                                  "%.0f ms" % mean([number(r["ms_per_pair"]) for r in of_method])])
    return table(["drives", "method", "scale 1", "1.5", "2", "3", "4", "features a view", "CPU time a view"], rows)


def consensus_table(folder):
    rows = []
    found = read(folder, "consensus/consensus.csv")
    methods = list(dict.fromkeys(r["method"] for r in found))
    for budget in dict.fromkeys(r["max_iterations"] for r in found):
        for share in dict.fromkeys(r["outlier_percent"] for r in found):
            cells = []
            for method in methods:
                for r in chosen(found, max_iterations=budget, outlier_percent=share, method=method):
                    cells.append("%.0f / %.0f / %.2f" % (number(r["success_percent"]), number(r["inliers_of_true_percent"]),
                                                         number(r["cpu_ms_per_call"])))
            rows.append([budget, share + " %"] + cells)
    return table(["samples", "outliers"] + [m.replace("_", " ") for m in methods], rows)


TABLES = {"headlines": headline_table, "matching by group": group_table, "matching by drive": drive_table,
          "tolerance": tolerance_table, "feature set size": count_table, "stereo on standard": stereo_table,
          "sift": sift_table, "ablation": ablation_table, "robustness": robustness_table, "accuracy": accuracy_table,
          "paths": path_table, "scale change": scale_table, "consensus": consensus_table}


def part(name, text):
    return "<!-- %s -->\n%s\n<!-- /%s -->" % (name, text, name)


def tables_of(folder):
    """Tables by name; without those that have no files, as after `run_experiments all --only …`."""
    parts = {}
    for name, make in TABLES.items():
        FOUND.clear()
        text = make(folder)
        if FOUND and text:
            parts[name] = text
    if not parts:
        sys.exit("error: '%s' has no results of run_experiments all" % folder)
    return parts


def replaced(page, parts, allow_missing=False):
    """The page with the tables between its marks. A mark without a table is an error, or it is left as it is and named."""
    for name in re.findall(r"^<!-- ([a-z ]+) -->$", page, re.MULTILINE):
        if name not in parts:
            if name not in TABLES or not allow_missing:
                sys.exit("error: there is no table '%s'" % name)
            print("left as it is, its files are missing: " + name)
            continue
        pattern = r"<!-- %s -->\n.*?<!-- /%s -->" % (name, name)
        if not re.search(pattern, page, re.DOTALL):
            sys.exit("error: the mark <!-- /%s --> is missing" % name)
        page = re.sub(pattern, lambda _, name=name: part(name, parts[name]), page, flags=re.DOTALL)
    return page


def compare(old, new):
    """Names of the headlines of `old` whose mean lies outside of the interval of `new`."""
    now, outside = headlines(new), []
    for name, values in headlines(old).items():
        if not values or not now[name]:
            continue
        low, high = bootstrap(now[name])
        inside = low <= mean(values) <= high
        print("%s %s: %+.1f %%, now %s" % ("ok     " if inside else "OUTSIDE", name, mean(values), percent(now[name])))
        if not inside:
            outside.append(name)
    return outside


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", help="what run_experiments all wrote, or docs/experiments")
    parser.add_argument("--output", help="tables.md to write")
    parser.add_argument("--into", metavar="PAGE", help="page whose tables are replaced")
    parser.add_argument("--check", metavar="PAGE", help="page whose tables must be these")
    parser.add_argument("--headlines-of", metavar="FOLDER", help="CSV files whose headline figures must lie inside of the intervals of these")
    arguments = parser.parse_args()
    parts = tables_of(arguments.folder)
    if arguments.output:
        with open(arguments.output, "w") as file:
            file.write("\n\n".join(part(name, text) for name, text in parts.items()) + "\n")
    if arguments.into:
        with open(arguments.into) as file:
            page = replaced(file.read(), parts, allow_missing=True)
        with open(arguments.into, "w") as file:
            file.write(page)
    if arguments.check:
        with open(arguments.check) as file:
            page = file.read()
        if replaced(page, parts) != page:
            sys.exit("error: the tables of %s are not those of %s" % (arguments.check, arguments.folder))
    if arguments.headlines_of:
        outside = compare(arguments.headlines_of, arguments.folder)
        if outside:
            sys.exit("error: %d headline figures lie outside of the new intervals" % len(outside))


if __name__ == "__main__":
    main()
