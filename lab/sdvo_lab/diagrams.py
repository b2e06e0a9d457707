"""Figures of the paper's experiments, drawn from rows by drive."""
import numpy
import pandas
import yaml

from . import bootstrap, results
from .pictures import plt, save
from .results import select


def grid(rows, columns, width, height):
    return plt.subplots(rows, columns, figsize=(width * columns, height * rows), squeeze=False)


def finish(figure, path, **labels):
    for axis in figure.axes:
        axis.grid(linestyle=":", which="both")
        axis.legend(fontsize=7)
        axis.set(**labels)
    save(figure, path, dpi=120)


def with_interval(rows, x, column):
    """Mean of a column over the drives by x, and the distances of its interval's ends, for error bars."""
    of = {key: list(values.dropna()) for key, values in rows.groupby(x, sort=False)[column]}
    means = [bootstrap.mean(values) for values in of.values()]
    ends = numpy.array([bootstrap.interval(values) for values in of.values()])
    return [float(key) for key in of], means, numpy.nan_to_num(numpy.abs(ends.T - means))


def draw_matching(folder, rows):
    """Figure 7: improvement against the size of the feature set; and correct matches against the step."""
    rows = select(rows, tolerance_px=rows.tolerance_px.max())
    descriptors = rows.descriptor.unique()
    figure, axes = grid(1, len(descriptors), 5.5, 4.2)
    for axis, descriptor in zip(axes[0], descriptors):
        for k, layout in enumerate(rows.layout.unique()):
            chosen = select(rows, descriptor=descriptor, layout=layout)
            x, means, ends = with_interval(chosen, "features", "improvement_percent")
            axis.errorbar(x, means, yerr=ends, fmt=f"C{k}o-", capsize=3, label=f"{layout}, against 7 px")
            axis.plot(*with_interval(chosen, "features", "improvement_on_best_percent")[:2], f"C{k}s:",
                      label=f"{layout}, against the best constant size")
        if descriptor == "freak":
            axis.plot(*zip(*results.PUBLISHED_BY_COUNT.items()), "k^--", label="paper, figure 7 (its sequence 21)")
        axis.set_title("scale normalised " + descriptor.upper())
        axis.axhline(0.0, color="grey", linewidth=0.6)
    finish(figure, folder / "matching_feature_set_size.png", xlabel="feature set size", ylabel="improvement in correct matches, %")

    steps = results.read(folder / "matching_steps.csv")
    steps = select(steps, tolerance_px=steps.tolerance_px.max(), features=steps.features.max(), layout=steps.layout[0])
    figure, axes = grid(1, len(descriptors), 5.5, 4.2)
    for axis, descriptor in zip(axes[0], descriptors):
        for side, chosen in select(steps, descriptor=descriptor).groupby("side", sort=False):
            sums = chosen.groupby("step", sort=False)[["correct", "pairs"]].sum()
            axis.plot(sums.index.astype(int), sums.correct / sums.pairs, "o-",
                      label=side.replace("_", " ") + (" px" if side.startswith("constant") else ""))
        axis.set_title(f"{descriptor.upper()}, {steps.features.max()} features")
        axis.set_yscale("log")
    finish(figure, folder / "matching_steps.png", xlabel="step", ylabel="correct matches of a pair")


def draw_robustness(folder, rows):
    """Figure 5: inliers against the step, of each drive and in the mean."""
    rows = rows[rows.step != "1-5"]
    sequences = [*rows.sequence.unique(), "mean"]
    figure, axes = grid(1, len(sequences), 4.2, 4.0)
    for axis, sequence in zip(axes[0], sequences):
        chosen = rows if sequence == "mean" else select(rows, sequence=sequence)
        for system, of_system in chosen.groupby("system", sort=False):
            means = of_system.groupby("step", sort=False).inliers.mean()
            axis.plot(means.index.astype(int), means, "o-", label=system.replace("_", " "))
        if sequence == "mean":
            for (system, inliers), style in zip(results.PUBLISHED_INLIERS.items(), ("k^--", "kv:")):
                axis.plot(range(1, 6), inliers, style, label="paper, " + system)
        axis.set_title(sequence if sequence == "mean" else "sequence " + sequence)
        axis.set_yscale("log")
    finish(figure, folder / "robustness_inliers.png", xlabel="step", ylabel="mean inliers")


def draw_consensus(folder, rows):
    """Success, inliers and time of the outlier rejection methods against the share of outliers."""
    columns = {"success_percent": "right motions, %", "inliers_of_true_percent": "inliers, % of the true motion's",
               "cpu_ms_per_call": "CPU time of a search, ms"}
    budgets = rows.max_iterations.unique()
    figure, axes = grid(len(budgets), 3, 4.7, 3.8)
    for line, budget in zip(axes, budgets):
        for axis, (column, label) in zip(line, columns.items()):
            for method, chosen in select(rows, max_iterations=budget).groupby("method", sort=False):
                axis.plot(chosen.outlier_percent, chosen[column], "x:" if "without" in method else "o-", label=method.replace("_", " "),
                          markersize=4)
            axis.set(title=f"at most {budget} samples", ylabel=label)
    finish(figure, folder / "consensus.png", xlabel="outliers, %")


def draw_scale_change(folder, rows):
    """Correct matches against the change of scale, of each method; and its time. Real and rendered drives apart."""
    real = rows.sequence.isin(results.KITTI)
    kinds = [(f"KITTI {', '.join(rows.sequence[real].unique())}", rows[real]), ("rendered drives", rows[~real])]
    figure, (axes,) = grid(1, 2, 5.2, 4.2)
    for axis, (title, of_kind) in zip(axes, kinds):
        axis.set_title(title)
        for method, chosen in of_kind.groupby("method", sort=False):
            sums = chosen.groupby("scale", sort=False)[["correct", "visible"]].sum()
            style = {"freak": "C0", "sift": "C1", "orb": "C2"}[method.split()[0]]
            style += "o-" if "depth" in method else "s:" if "constant" in method else "^--"
            axis.plot(sums.index, 100.0 * sums.correct / numpy.maximum(1.0, sums.visible), style,
                      label=f"{method} ({chosen.ms_per_pair.mean():.0f} ms)")
    finish(figure, folder / "scale_change.png", xlabel="change of scale between the views",
           ylabel="correct matches, % of the features in view", ylim=(0.0, 42.0), xticks=[1.0, 1.5, 2.0, 3.0, 4.0])


FIGURES = {"matching": draw_matching, "robustness": draw_robustness, "consensus": draw_consensus, "scale_change": draw_scale_change}


def medians(x, y, edges):
    """Centre and median of y in every bin of x that holds at least ten samples."""
    bins = [(low * high, y[(x >= low) & (x < high)]) for low, high in zip(edges[:-1], edges[1:])]
    return zip(*[(square ** 0.5, numpy.median(inside)) for square, inside in bins if len(inside) >= 10])


def draw_depth_scale(samples, curve_file, output):
    """Samples and curve of learn size-curve."""
    rows = pandas.read_csv(samples)
    first, later, ratio = (rows[name].to_numpy() for name in ("first_disparity", "disparity", "ratio"))
    with open(curve_file) as file:
        curve = yaml.safe_load(file)["stereo_features"]["size_curve"]

    def unlimited(disparity):
        return curve["slope"] * disparity ** curve["exponent"] + curve["offset"]

    figure, ((left, right),) = grid(1, 2, 5.5, 4.4)
    dots = {"markersize": 2, "alpha": 0.25, "color": "C0", "label": "features"}
    change, reference = later / first, numpy.median(first)
    left.loglog(change, ratio, ".", **dots)
    left.loglog(*medians(change, ratio, numpy.geomspace(0.8, 5.0, 16)), "ko", label="medians")
    line = numpy.geomspace(change.min(), change.max(), 50)
    left.loglog(line, line, "C1", label="a d: size grows as the disparity")
    left.loglog(line, unlimited(reference * line) / unlimited(reference), "C3--", label=f"fitted, from a disparity of {reference:.0f} px")
    left.set(xlabel="disparity / first disparity", ylabel="best size / first size")

    # What each sample asks for when its first view has the size of the curve.
    sizes = unlimited(first) * ratio
    right.plot(later, sizes, ".", **dots)
    right.plot(*medians(later, sizes, numpy.geomspace(2.0, 120.0, 22)), "ko", label="medians")
    line = numpy.linspace(later.min(), later.max(), 200)
    right.plot(line, numpy.clip(unlimited(line), curve["min_size"], curve["max_size"]), "C3", label="curve in use")
    right.plot(line, unlimited(line), "C3:", label="without its limits")
    right.set(xlabel="disparity, px", ylabel="size, px", ylim=(0.0, numpy.percentile(sizes, 99.5)))
    finish(figure, output)
