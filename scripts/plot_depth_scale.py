#!/usr/bin/env python3
"""Draws the samples and the curve of fit_depth_scale."""
import argparse
import csv
import sys

try:
    import matplotlib
except ImportError:
    sys.exit("error: drawing needs matplotlib (python3-matplotlib)")

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  the backend has to be chosen first
import numpy as np  # noqa: E402
import yaml  # noqa: E402


def read_samples(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    return (np.array([float(row[name]) for row in rows]) for name in ("first_disparity", "disparity", "ratio"))


def medians(x, y, edges):
    """Centre and median of y in every bin of x that holds at least ten samples."""
    centres, middles = [], []
    for low, high in zip(edges[:-1], edges[1:]):
        inside = (x >= low) & (x < high)
        if np.count_nonzero(inside) >= 10:
            centres.append(np.sqrt(low * high))
            middles.append(np.median(y[inside]))
    return centres, middles


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("samples", help="CSV with first_disparity, disparity, ratio")
    parser.add_argument("curve", help="YAML that fit_depth_scale wrote")
    parser.add_argument("output", help="PNG to write")
    arguments = parser.parse_args()
    try:
        first, later, ratio = read_samples(arguments.samples)
        with open(arguments.curve) as file:
            curve = yaml.safe_load(file)["stereo_features"]["size_curve"]
    except (OSError, KeyError, TypeError, ValueError) as error:
        sys.exit("error: cannot plot %s: %s" % (arguments.samples, error))

    def unlimited(disparity):
        return curve["slope"] * disparity ** curve["exponent"] + curve["offset"]

    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.4))
    change = later / first
    left.loglog(change, ratio, ".", markersize=2, alpha=0.25, color="C0", label="features")
    left.loglog(*medians(change, ratio, np.geomspace(0.8, 5.0, 16)), "ko", label="medians")
    line = np.geomspace(change.min(), change.max(), 50)
    left.loglog(line, line, "C1", label="a d: size grows as the disparity")
    reference = np.median(first)
    left.loglog(line, unlimited(reference * line) / unlimited(reference), "C3--",
                label="fitted, from a disparity of %.0f px" % reference)
    left.set_xlabel("disparity / first disparity")
    left.set_ylabel("best size / first size")

    # What each sample asks for when its first view has the size of the curve.
    right.plot(later, unlimited(first) * ratio, ".", markersize=2, alpha=0.25, color="C0", label="features")
    right.plot(*medians(later, unlimited(first) * ratio, np.geomspace(2.0, 120.0, 22)), "ko", label="medians")
    line = np.linspace(later.min(), later.max(), 200)
    right.plot(line, np.clip(unlimited(line), curve["min_size"], curve["max_size"]), "C3", label="curve in use")
    right.plot(line, unlimited(line), "C3:", label="without its limits")
    right.set_xlabel("disparity, px")
    right.set_ylabel("size, px")
    right.set_ylim(0.0, np.percentile(unlimited(first) * ratio, 99.5))
    for axis in (left, right):
        axis.grid(linestyle=":", which="both")
        axis.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(arguments.output, dpi=120)
    print("wrote " + arguments.output)


if __name__ == "__main__":
    main()
