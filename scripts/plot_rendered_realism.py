#!/usr/bin/env python3
"""Compares a rendered drive with a real one: grey-level gradients, disparities, corner counts, and the pictures."""

import argparse
import sys
from pathlib import Path

import cv2
try:
    import matplotlib
except ImportError:
    sys.exit("error: drawing needs matplotlib (python3-matplotlib)")

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402


def pairs(directory, count):
    """`count` pairs spread evenly over a directory in KITTI layout."""
    names = sorted(p.name for p in (directory / "image_0").glob("*.png"))
    if not names:
        sys.exit(f"error: {directory} has no image_0/*.png: give a directory in KITTI layout")
    for i in np.linspace(0, len(names) - 1, min(count, len(names))).round().astype(int):
        both = [cv2.imread(str(directory / side / names[i]), cv2.IMREAD_GRAYSCALE) for side in ("image_0", "image_1")]
        if any(image is None for image in both):
            sys.exit(f"error: cannot read the pair {names[i]} of {directory}")
        yield both


class Statistics:
    """What a drive looks like, summed over some of its pairs."""

    DISPARITIES = np.arange(0.5, 128.5, 2.0)  # px
    SCALES = (1, 2, 4, 8, 16)  # px

    def __init__(self, directory, count):
        matcher = cv2.StereoSGBM_create(0, 128, 7, P1=8 * 49, P2=32 * 49, uniquenessRatio=10, speckleWindowSize=100,
                                        speckleRange=2)
        detector = cv2.FastFeatureDetector_create(20, True)
        gradients, disparities, greys, corners, contrast = [], [], [], [], []
        for left, right in pairs(directory, count):
            image = left.astype(float)
            gradients.append(np.diff(image, axis=1).ravel())
            greys.append(image.ravel())
            corners.append(len(detector.detect(left)))
            contrast.append([np.abs(image[:, k:] - image[:, :-k]).mean() for k in self.SCALES])
            disparity = matcher.compute(left, right) / 16.0
            disparities.append(disparity[disparity > 0.5])
            self.example = left
        self.gradients = np.concatenate(gradients)
        self.disparities = np.concatenate(disparities)
        self.greys = np.concatenate(greys)
        self.corners = corners
        self.contrast = np.mean(contrast, axis=0)

    def line(self):
        quartiles = np.percentile(self.disparities, [5, 25, 50, 75, 95])
        return (f"corners {np.mean(self.corners):5.0f} ({min(self.corners)} to {max(self.corners)})  "
                f"|gradient| {np.abs(self.gradients).mean():.2f}  grey {self.greys.mean():.0f} +- {self.greys.std():.0f}  "
                f"disparity 5/25/50/75/95 % " + " ".join(f"{q:.1f}" for q in quartiles))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--real", type=Path, required=True, help="sequence in KITTI layout")
    parser.add_argument("--rendered", type=Path, required=True, help="drive that render_drive made")
    parser.add_argument("--pairs", type=int, default=6, help="pairs of each to look at [6]")
    parser.add_argument("--output", type=Path, required=True, help="directory for the figures")
    parser.add_argument("--beside", type=Path, help="PNG to write with a real and a rendered picture")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)

    drives = {"real": Statistics(arguments.real, arguments.pairs),
              "rendered": Statistics(arguments.rendered, arguments.pairs)}
    figure, axes = plt.subplots(1, 4, figsize=(15, 3.6))
    for name, drive in drives.items():
        print(f"{name:9s} {drive.line()}")
        axes[0].hist(drive.gradients, bins=np.arange(-100.5, 101), density=True, histtype="step", label=name)
        axes[1].hist(drive.greys, bins=np.arange(-0.5, 256), density=True, histtype="step", label=name)
        axes[2].hist(drive.disparities, bins=Statistics.DISPARITIES, density=True, histtype="step", label=name)
        axes[3].plot(Statistics.SCALES, drive.contrast, "o-", label=name)
    axes[0].set(yscale="log", xlabel="horizontal gradient (grey levels per px)", ylabel="density")
    axes[1].set(xlabel="grey level")
    axes[2].set(xlabel="disparity by block matching (px)")
    axes[3].set(xscale="log", xlabel="distance (px)", ylabel="mean grey-level difference")
    axes[3].set_xticks(Statistics.SCALES, [str(k) for k in Statistics.SCALES])
    axes[0].legend()
    figure.tight_layout()
    figure.savefig(arguments.output / "rendered_histograms.png", dpi=80)

    if arguments.beside:  # not for publication: it shows the real data
        width = min(drive.example.shape[1] for drive in drives.values())
        cv2.imwrite(str(arguments.beside), np.vstack([drive.example[:, :width] for drive in drives.values()]))
    picture = cv2.resize(drives["rendered"].example, None, fx=0.75, fy=0.75, interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(arguments.output / "rendered_street.png"), picture, [cv2.IMWRITE_PNG_COMPRESSION, 9])


if __name__ == "__main__":
    main()
