"""Moving picture of a drive: what the pipeline sees beside the path from above, as a GIF of at most 3 MB for the README.

    lab/run film --sequence .catkin_ws/demo/drive --output docs/images/drive.gif
"""
import io
import pathlib
import sys
import tempfile

import numpy as np
from PIL import Image

from . import poses, programs
from .pictures import plt

LARGEST = 3000000  # bytes
WIDTH = 480  # px of the images


def draw_path(positions, now, lowest, highest):
    """The path so far and the camera, as a square picture."""
    figure, axis = plt.subplots(figsize=(1.8, 1.8), dpi=100)
    axis.plot(*positions[:now + 1].T, color="tab:blue", linewidth=1.5)
    axis.plot(*positions[now], "o", color="tab:red", markersize=4)
    axis.set(xlim=(lowest[0], highest[0]), ylim=(lowest[1], highest[1]), aspect="equal")
    axis.tick_params(labelsize=6)
    axis.set_title("path from above [m]", fontsize=7)
    figure.tight_layout(pad=0.4)
    with io.BytesIO() as png:
        figure.savefig(png, format="png")
        plt.close(figure)
        return Image.open(png).convert("RGB")


def options(parser):
    parser.add_argument("--sequence", required=True, help="recording that run_sequence reads")
    parser.add_argument("--output", required=True, help="GIF to write")
    parser.add_argument("--frames", type=int, default=250, help="pairs")
    parser.add_argument("--every", type=int, default=5, help="one picture of so many pairs")
    parser.add_argument("--colours", type=int, default=64)
    programs.add_params(parser)


def main(arguments):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        programs.run("run_sequence", arguments.sequence, "--frames", arguments.frames, "--pictures", folder / "pictures",
                     "--poses", folder / "poses.txt", *programs.params(arguments))
        positions = poses.read(folder / "poses.txt")[:, [0, 2], 3]
        middle = (positions.min(0) + positions.max(0)) / 2
        reach = np.full(2, 0.55 * (positions.max(0) - positions.min(0)).max() + 0.1)
        frames = []
        for now in range(arguments.every, len(positions), arguments.every):
            seen = Image.open(folder / "pictures" / f"{now:06d}.jpg")
            seen = seen.resize((WIDTH, seen.height * WIDTH // seen.width), Image.LANCZOS)
            path = draw_path(positions, now, middle - reach, middle + reach)
            both = Image.new("RGB", (WIDTH + path.width, max(seen.height, path.height)), "white")
            both.paste(seen, (0, (both.height - seen.height) // 2))
            both.paste(path, (WIDTH, (both.height - path.height) // 2))
            frames.append(both.quantize(arguments.colours, dither=Image.NONE))
    output = pathlib.Path(arguments.output)
    frames[0].save(output, save_all=True, append_images=frames[1:], duration=120, loop=0, optimize=True)
    size = output.stat().st_size
    print(f"wrote {output}: {len(frames)} pictures, {size / 1e6:.1f} MB")
    if size > LARGEST:
        sys.exit(f"error: that is more than {LARGEST / 1e6:.0f} MB: a larger --every, fewer --colours")
