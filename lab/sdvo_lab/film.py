"""Moving picture of a drive: what the pipeline sees beside the path from above and the truth, as a GIF of at most 3 MB for the README.

    rosrun stereo_descriptor_vo render_drive --trajectory hand_held --rig d435_small --frames 340 --output room
    lab/run film --sequence room --output docs/images/drive.gif
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


def draw_path(path, truth, now, side):
    """The path so far and the camera over the whole true path, as a square picture of `side` px."""
    dots = 100
    figure, axis = plt.subplots(figsize=(side / dots, side / dots), dpi=dots)
    axis.plot(*truth[:, [0, 2], 3].T, color="tab:green", alpha=0.35, linewidth=5, label="truth")
    axis.plot(*path[:now + 1, [0, 2], 3].T, color="tab:blue", linewidth=1.5, label="odometry")
    axis.plot(*path[now, [0, 2], 3], "o", color="tab:red", markersize=5)
    axis.set_aspect("equal", "datalim")
    axis.tick_params(labelsize=7)
    axis.legend(fontsize=7, loc="upper right")
    travelled = np.linalg.norm(np.diff(truth[:now + 1, :3, 3], axis=0), axis=1).sum()
    error = np.linalg.norm(path[now, :3, 3] - truth[now, :3, 3])
    axis.set_title(f"path from above [m]\n{100 * error:.1f} cm off after {travelled:.1f} m", fontsize=8)
    figure.tight_layout(pad=0.4)
    with io.BytesIO() as png:
        figure.savefig(png, format="png")
        plt.close(figure)
        return Image.open(png).convert("RGB")


def palette_of(*parts):
    """The colours of (picture, how many): grey images leave none for a few lines."""
    palette = Image.new("P", (1, 1))
    palette.putpalette([value for picture, count in parts for value in picture.quantize(count).getpalette()[:3 * count]])
    return palette


def options(parser):
    parser.add_argument("--sequence", required=True, help="rendered drive: a folder with its poses.txt")
    parser.add_argument("--output", required=True, help="GIF to write")
    parser.add_argument("--frames", type=int, default=340, help="pairs")
    parser.add_argument("--every", type=int, default=8, help="one picture of so many pairs")
    parser.add_argument("--colours", type=int, default=32, help="of the images")
    programs.add_params(parser)


def main(arguments):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        programs.run("run_sequence", arguments.sequence, "--frames", arguments.frames, "--pictures", folder / "pictures",
                     "--poses", folder / "poses.txt", *programs.params(arguments))
        path = poses.read(folder / "poses.txt")
        truth = poses.read(pathlib.Path(arguments.sequence) / "poses.txt", len(path))
        truth = np.linalg.inv(truth[0]) @ truth
        frames = []
        for now in range(arguments.every, len(path), arguments.every):
            seen = Image.open(folder / "pictures" / f"{now:06d}.jpg")
            seen = seen.resize((WIDTH, seen.height * WIDTH // seen.width), Image.LANCZOS)
            both = Image.new("RGB", (WIDTH + seen.height, seen.height), "white")
            both.paste(seen, (0, 0))
            drawn = draw_path(path, truth, now, seen.height)
            both.paste(drawn, (WIDTH, 0))
            frames.append(both.quantize(palette=palette_of((seen, arguments.colours), (drawn, 16)), dither=Image.NONE))
    output = pathlib.Path(arguments.output)
    frames[0].save(output, save_all=True, append_images=frames[1:], duration=120, loop=0, optimize=True)
    size = output.stat().st_size
    print(f"wrote {output}: {len(frames)} pictures, {size / 1e6:.1f} MB")
    if size > LARGEST:
        sys.exit(f"error: that is more than {LARGEST / 1e6:.0f} MB: a larger --every, fewer --colours")
