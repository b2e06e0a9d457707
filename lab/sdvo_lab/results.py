"""Results of run_experiments, one row for each drive: sums over steps and means over seeds, but none over drives."""
import pathlib

import pandas

KITTI = ("01", "04", "06")  # recorded drives of the experiments; the others are rendered

# Figure 7 of the paper, improvement of SN-FREAK by the size of the feature set, %; its figure 5, inliers by step.
PUBLISHED_BY_COUNT = {310: 11.58, 1350: 15.37, 2320: 26.41}
PUBLISHED_INLIERS = {"stereo": (133.0, 103.0, 62.0, 40.0, 27.0), "standard": (126.0, 91.5, 51.0, 33.0, 22.0)}


def read(path):
    """A CSV file; names of drives stay text."""
    return pandas.read_csv(path, dtype={"sequence": str, "step": str})


def gain(ours, theirs):
    return 100.0 * (ours / theirs - 1.0)


def matching(folder):
    """Correct matches of a pair by depth and at the standard size, and what the former gain: on the standard size, on the best
    constant one, and on the standard size in one view."""
    rows = read(folder / "matching_steps.csv")
    case = ["sequence", "descriptor", "layout", "features", "tolerance_px", "reference", "options"]
    sums = rows.groupby([*case, "side"], sort=False)[["correct", "pairs"]].sum()
    of_side = (sums["correct"] / sums["pairs"]).unstack("side")
    constant = of_side.filter(like="constant_")
    best = constant.max(axis=1)
    found = pandas.DataFrame({
        "scale_normalised": of_side["scale_normalised"], "standard": of_side["constant_7"],
        "improvement_percent": gain(of_side["scale_normalised"], of_side["constant_7"]),
        "best_constant_size": constant.idxmax(axis=1).str[len("constant_"):].astype(int), "best_constant": best,
        "improvement_on_best_percent": gain(of_side["scale_normalised"], best)}).reset_index()
    left = found[found.layout == "left"].set_index(["sequence", "descriptor", "features", "tolerance_px"])["standard"]
    keys = found.set_index(["sequence", "descriptor", "features", "tolerance_px"]).index
    found["improvement_on_standard_left_percent"] = gain(found["scale_normalised"], left.reindex(keys).to_numpy())
    return found


def robustness(folder):
    """Mean matches and inliers of a run by step, and the mean of the inliers over the steps as step 1-5; the gain on the standard
    system."""
    rows = read(folder / "robustness_steps.csv")
    found = rows.assign(matches=rows.matches / rows.runs, inliers=rows.inliers / rows.runs,
                        success_percent=100.0 * rows.successes / rows.runs).drop(columns=["successes", "runs"])
    over_steps = found.groupby(["sequence", "descriptor", "features", "system", "seeds", "options"], sort=False)["inliers"].mean().reset_index()
    found = pandas.concat([found, over_steps.assign(step="1-5")])
    keys = ["sequence", "descriptor", "features", "step"]
    standard = found[found.system == "standard"].set_index(keys)["inliers"]
    found["gain_percent"] = gain(found["inliers"], standard.reindex(found.set_index(keys).index).to_numpy())
    return found


def accuracy_summary(folder):
    """Errors over the seeds, and how much smaller they are than the standard system's, with the same treatment of the matches and with
    the best that needs no depth."""
    rows = read(folder / "accuracy.csv")
    keys = ["sequence", "descriptor", "features", "step", "model", "method", "system"]
    groups = rows.groupby([*keys, "options"], sort=False)
    path = groups["path_percent"]
    found = pandas.DataFrame({
        "seeds": groups["seed"].count(), "pair_percent": groups["pair_percent"].mean(), "pair_degrees": groups["pair_degrees"].mean(),
        "failure_percent": 100.0 * groups["failures"].mean() / groups["pairs"].mean(),
        "best_path_percent": path.min(), "mean_path_percent": path.mean(), "worst_path_percent": path.max()}).reset_index()
    errors = found.set_index(keys)["pair_percent"]
    for name, other in (("gain_percent", {"system": "standard"}), ("gain_on_plain_percent", {"system": "standard", "model": "aligned"})):
        standard = errors.reindex(found.assign(**other).set_index(keys).index).to_numpy()
        found[name] = 100.0 * (1.0 - found["pair_percent"] / standard)
    return found


SUMMARIES = {"matching": (matching, "matching.csv"), "robustness": (robustness, "robustness.csv"),
             "accuracy": (accuracy_summary, "accuracy_summary.csv")}


def summarise(experiment, folder):
    """Writes the rows by drive beside those of run_experiments, where they differ, and returns them."""
    folder = pathlib.Path(folder)
    if experiment not in SUMMARIES:
        return read(folder / f"{experiment}.csv")
    of, name = SUMMARIES[experiment]
    found = of(folder)
    found.to_csv(folder / name, index=False, float_format="%.6g")
    return found


def select(rows, **wanted):
    for column, value in wanted.items():
        rows = rows[rows[column] == value]
    return rows
