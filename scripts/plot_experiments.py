#!/usr/bin/env python3
"""Draws the figures of the paper's experiments from the CSV files that run_experiments writes."""
import argparse
import csv
import os
import sys

try:
    import matplotlib
except ImportError:
    sys.exit("error: drawing needs matplotlib (python3-matplotlib)")

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  the backend has to be chosen first


def read_table(folder, name):
    with open(os.path.join(folder, name), newline="") as file:
        return list(csv.DictReader(file))


def unique(values):
    return list(dict.fromkeys(values))


def number(text):
    return float(text) if text else float("nan")


def loosest(rows):
    """The rows of the largest tolerance."""
    largest = max(float(row["tolerance_px"]) for row in rows)
    return [row for row in rows if float(row["tolerance_px"]) == largest]


def interval(row, value, name):
    """Distances of an interval's ends from the value, for error bars; nothing where there is none."""
    low, high = number(row[name + "_low"]), number(row[name + "_high"])
    return [0.0 if low != low else number(row[value]) - low], [0.0 if high != high else high - number(row[value])]


def save(figure, folder, name):
    path = os.path.join(folder, name)
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)
    print("wrote " + path)


def plot_matching(folder):
    """Figure 7: improvement against the size of the feature set; and correct matches against the step."""
    rows = loosest(read_table(folder, "matching.csv"))
    descriptors = unique(row["descriptor"] for row in rows)
    figure, axes = plt.subplots(1, len(descriptors), figsize=(5.5 * len(descriptors), 4.2), squeeze=False)
    for axis, descriptor in zip(axes[0], descriptors):
        for layout in unique(row["layout"] for row in rows):
            mean = [r for r in rows if (r["sequence"], r["descriptor"], r["layout"]) == ("mean", descriptor, layout)]
            sizes = [int(r["features"]) for r in mean]
            line, = axis.plot(sizes, [number(r["improvement_percent"]) for r in mean], "o-",
                              label=layout + ", against 7 px")
            for size, row in zip(sizes, mean):
                axis.errorbar(size, number(row["improvement_percent"]), capsize=3, color=line.get_color(),
                              yerr=interval(row, "improvement_percent", "improvement"))
            axis.plot(sizes, [number(r["improvement_on_best_percent"]) for r in mean], "s:", color=line.get_color(),
                      label=layout + ", against the best constant size")
        if descriptor == "freak":
            axis.plot([310, 1350, 2320], [11.58, 15.37, 26.41], "k^--", label="paper, figure 7 (its sequence 21)")
        axis.set_title("scale normalised " + descriptor.upper())
        axis.set_xlabel("feature set size")
        axis.set_ylabel("improvement in correct matches, %")
        axis.axhline(0.0, color="grey", linewidth=0.6)
        axis.grid(linestyle=":")
        axis.legend(fontsize=7)
    save(figure, folder, "matching_feature_set_size.png")

    steps = loosest(read_table(folder, "matching_steps.csv"))
    largest = max(int(row["features"]) for row in steps)
    figure, axes = plt.subplots(1, len(descriptors), figsize=(5.5 * len(descriptors), 4.2), squeeze=False)
    for axis, descriptor in zip(axes[0], descriptors):
        chosen = [r for r in steps if (r["sequence"], r["descriptor"]) == ("mean", descriptor)
                  and int(r["features"]) == largest and r["layout"] == unique(s["layout"] for s in steps)[0]]
        for side in unique(row["side"] for row in chosen):
            of_side = [r for r in chosen if r["side"] == side]
            axis.plot([int(r["step"]) for r in of_side], [int(r["correct"]) / int(r["pairs"]) for r in of_side], "o-",
                      label=side.replace("_", " ") + (" px" if side.startswith("constant") else ""))
        axis.set_title("%s, %d features" % (descriptor.upper(), largest))
        axis.set_xlabel("step")
        axis.set_ylabel("correct matches of a pair")
        axis.set_yscale("log")
        axis.grid(linestyle=":", which="both")
        axis.legend(fontsize=7)
    save(figure, folder, "matching_steps.png")


def plot_robustness(folder):
    """Figure 5: inliers against the step."""
    rows = [r for r in read_table(folder, "robustness.csv") if r["step"] != "1-5"]
    sequences = unique(row["sequence"] for row in rows)
    figure, axes = plt.subplots(1, len(sequences), figsize=(4.2 * len(sequences), 4.0), squeeze=False)
    for axis, sequence in zip(axes[0], sequences):
        for system in unique(row["system"] for row in rows):
            chosen = [r for r in rows if (r["sequence"], r["system"]) == (sequence, system)]
            axis.plot([int(r["step"]) for r in chosen], [number(r["inliers"]) for r in chosen], "o-",
                      label=system.replace("_", " "))
        if sequence == "mean":
            for system, style in (("stereo", "k^--"), ("standard", "kv:")):
                chosen = [r for r in rows if (r["sequence"], r["system"]) == (sequence, system)]
                axis.plot([int(r["step"]) for r in chosen], [number(r["paper_inliers"]) for r in chosen], style,
                          label="paper, " + system)
        axis.set_title(sequence if sequence == "mean" else "sequence " + sequence)
        axis.set_xlabel("step")
        axis.set_ylabel("mean inliers")
        axis.set_yscale("log")
        axis.grid(linestyle=":", which="both")
        axis.legend(fontsize=7)
    save(figure, folder, "robustness_inliers.png")


def plot_accuracy(folder):
    """Translation error of a pair against the step, by what was done to the matches; and the gain of stereo."""
    rows = [r for r in read_table(folder, "accuracy_summary.csv") if r["sequence"] == "mean"]
    counts, methods = unique(row["features"] for row in rows), unique(row["method"] for row in rows)
    figure, axes = plt.subplots(len(counts), 2, figsize=(11.0, 4.2 * len(counts)), squeeze=False)
    lines = (("standard", "refined", "C0o:"), ("stereo", "refined", "C1o:"), ("standard", "aligned", "C0s--"),
             ("standard", "aligned_by_depth", "C0^-"), ("stereo", "aligned_by_depth", "C1^-"))
    gains = (("stereo", "refined", "gain", "C1o:", "refined, on standard refined"),
             ("stereo", "aligned_by_depth", "gain", "C1^-", "aligned by depth, on standard aligned by depth"),
             ("stereo", "aligned_by_depth", "gain_on_plain", "C2s--", "aligned by depth, on standard aligned"))
    for line, count in zip(axes, counts):
        chosen = [r for r in rows if (r["features"], r["method"]) == (count, methods[0])]

        def of(system, model):
            return [r for r in chosen if (r["system"], r["model"]) == (system, model)]

        for system, model, style in lines:
            line[0].plot([int(r["step"]) for r in of(system, model)],
                         [number(r["pair_percent"]) for r in of(system, model)], style,
                         label="%s, %s" % (system, model.replace("_", " ")))
        for k, (system, model, name, style, label) in enumerate(gains):
            for row in of(system, model):
                line[1].errorbar(int(row["step"]) + 0.08 * (k - 1), number(row[name + "_percent"]), fmt=style[:3],
                                 yerr=interval(row, name + "_percent", name), capsize=3,
                                 label=label if row["step"] == "1" else None)
        line[0].set_yscale("log")
        line[0].set_ylabel("translation error, % of the way")
        line[1].axhline(0.0, color="grey", linewidth=0.6)
        line[1].set_ylabel("gain of stereo, %")
        for axis in line:
            axis.set_title("%s features" % count)
            axis.set_xticks(range(1, 6))
            axis.set_xlabel("step")
            axis.grid(linestyle=":", which="both")
            axis.legend(fontsize=7)
    save(figure, folder, "accuracy_steps.png")


def plot_consensus(folder):
    """Success, inliers and time of the outlier rejection methods against the share of outliers."""
    rows = read_table(folder, "consensus.csv")
    budgets = unique(row["max_iterations"] for row in rows)
    columns = (("success_percent", "right motions, %"), ("inliers_of_true_percent", "inliers, % of the true motion's"),
               ("cpu_ms_per_call", "CPU time of a search, ms"))
    figure, axes = plt.subplots(len(budgets), 3, figsize=(14.0, 3.8 * len(budgets)), squeeze=False)
    for line, budget in zip(axes, budgets):
        for axis, (column, label) in zip(line, columns):
            for method in unique(row["method"] for row in rows):
                chosen = [r for r in rows if (r["max_iterations"], r["method"]) == (budget, method)]
                axis.plot([int(r["outlier_percent"]) for r in chosen], [number(r[column]) for r in chosen],
                          "x:" if "without" in method else "o-", label=method.replace("_", " "), markersize=4)
            axis.set_title("at most %s samples" % budget)
            axis.set_xlabel("outliers, %")
            axis.set_ylabel(label)
            axis.grid(linestyle=":")
        line[0].legend(fontsize=7)
    save(figure, folder, "consensus.png")


def plot_scale_change(folder):
    """Correct matches against the change of scale, of each method; and its time."""
    rows = read_table(folder, "scale_change.csv")
    figure, axis = plt.subplots(figsize=(7.0, 4.6))
    for method in unique(row["method"] for row in rows):
        chosen = [r for r in rows if r["method"] == method]
        scales = unique(r["scale"] for r in chosen)
        share = [100.0 * sum(number(r["correct"]) for r in chosen if r["scale"] == s)
                 / max(1.0, sum(number(r["visible"]) for r in chosen if r["scale"] == s)) for s in scales]
        ms = sum(number(r["ms_per_pair"]) for r in chosen) / len(chosen)
        style = {"freak": "C0", "sift": "C1", "orb": "C2"}[method.split()[0]]
        style += "o-" if "depth" in method else "s:" if "constant" in method else "^--"
        axis.plot([float(s) for s in scales], share, style, label="%s (%.0f ms)" % (method, ms))
    axis.set_xlabel("change of scale between the views")
    axis.set_ylabel("correct matches, % of the features in view")
    axis.set_xticks([1.0, 1.5, 2.0, 3.0, 4.0])
    axis.grid(linestyle=":")
    axis.legend(fontsize=8)
    save(figure, folder, "scale_change.png")


PLOTS = {"matching": plot_matching, "robustness": plot_robustness, "accuracy": plot_accuracy,
         "consensus": plot_consensus, "scale_change": plot_scale_change}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("experiment", choices=sorted(PLOTS))
    parser.add_argument("folder", help="directory that run_experiments wrote its CSV files to; receives the PNG files")
    arguments = parser.parse_args()
    try:
        PLOTS[arguments.experiment](arguments.folder)
    except (OSError, KeyError, ValueError) as error:
        sys.exit("error: cannot plot %s of %s: %s" % (arguments.experiment, arguments.folder, error))


if __name__ == "__main__":
    main()
