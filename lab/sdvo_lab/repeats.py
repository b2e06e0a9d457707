"""Views whose texture repeats: planes of exact truth before a small rig, from a stand and at speed, with dirt that does not repeat.

    lab/run repeats
    lab/run repeats --seed 100 --only fence stairs    # other textures and noise

Dirt is aperiodic texture; its standard deviation is a ratio of that of the texture it lies on."""
import dataclasses

import cv2
import numpy

from . import drives, marks, odometry, poses, programs

SEEDS = {"wall in bays": 8501, "tiles": 8502, "rack": 8503, "fence": 8504, "stairs": 8505, "stairs, balusters": 8506,
         "fence, one period a pair": 8507}
DIRT = (0, 0.01, 0.02, 0.04)
BESIDE = 0.02  # dirt of the variant with unique texture beside
WIDTH, HEIGHT, FOCAL, BASELINE, RATE = 640, 400, 450.0, 0.075, 15.0  # px, px, px, m, 1/s: the rig "oak_d_lite"
NOISE, BLUR, LEVEL, CONTRAST = 1.5, 0.7, 110, 38  # grey levels, px of the lens, grey levels and their standard deviation
PAIRS, STANDING, SPEED = 14, 6, 0.5  # pairs, of these at rest where a drive begins from a stand, m/s
FINE = 2  # samples in a pixel's side
PICKETS = 0.12  # m, period of the fence
CAMERA = numpy.array([[FOCAL, 0, (WIDTH - 1) / 2], [0, FOCAL, (HEIGHT - 1) / 2], [0, 0, 1]])


@dataclasses.dataclass
class Plane:
    """Texels of a rectangle (grey level, dirt, opacity; premultiplied), its first corner and the unit axes of columns and rows. x is to
    the right, y down, z ahead."""
    texels: numpy.ndarray
    corner: tuple
    across: tuple
    along: tuple
    scale: float  # texels/m

    def draw(self, pose, image):
        """Over what `image` shows, from the pose of a camera before which the whole plane lies."""
        to_fine = numpy.array([[FINE, 0, FINE / 2 - 0.5], [0, FINE, FINE / 2 - 0.5], [0, 0, 1]])
        axes = numpy.column_stack([numpy.array(self.across) / self.scale, numpy.array(self.along) / self.scale, self.corner - pose[:3, 3]])
        centres = numpy.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
        warped = cv2.warpPerspective(self.texels, to_fine @ CAMERA @ pose[:3, :3].T @ axes @ centres, image.shape[1::-1])
        image *= 1 - warped[..., 2:]
        image += warped


def unique(generator, height, width, patch=(5, 40)):
    """Texture of rectangles of all sizes, of zero mean and unit standard deviation."""
    image = numpy.zeros((height, width), numpy.float32)
    for _ in range(int(4 * height * width / patch[0] / patch[1]) + 1):
        w, h = numpy.exp(generator.uniform(*numpy.log(patch), 2)).astype(int)
        x, y = generator.integers(-patch[0], width), generator.integers(-patch[0], height)
        cv2.rectangle(image, (int(x), int(y)), (int(x + w), int(y + h)), float(generator.normal()), -1)
    image = cv2.GaussianBlur(image, (0, 0), 1.0)
    return (image - image.mean()) / image.std()


def plane(generator, corner, size, tile=None, nearest=1.0, bars=None, along=(0, 1, 0)):
    """Texture in tiles (m), or of one piece, as fine as the camera sees it from the nearest distance; with bars (m), nothing between
    those of a tile's left side."""
    scale = FOCAL * FINE / nearest * 0.75
    width, height = (max(round(scale * side), 1) for side in size)
    texels = numpy.ones((height, width, 3), numpy.float32)
    if tile:
        columns, rows = (round(scale * side) for side in tile)
        scale_to = columns / tile[0]  # whole texels a tile
        piece = numpy.tile(unique(generator, rows, columns), (height // rows + 1, width // columns + 1))[:height, :width]
        texels[..., 0], texels[..., 1] = piece, unique(generator, height, width)
        if bars:
            texels[:, numpy.arange(width) % columns >= round(bars * scale_to), 2] = 0
        scale = scale_to
    else:
        texels[..., 0], texels[..., 1] = unique(generator, height, width), 0
    texels[..., 0] = LEVEL + CONTRAST * texels[..., 0]
    texels[..., 1] *= CONTRAST
    texels[..., :2] *= texels[..., 2:]
    return Plane(texels, numpy.array(corner, float), (1, 0, 0), along, scale)


def fence(generator, distance=1.2):
    return plane(generator, (-4, -1.2, distance), (8, 2.4), (PICKETS, 2.4), distance, 0.05)


def stairs(generator):
    """Twelve of them ahead, from the far one to the near one."""
    depth, height, nearest, first = 0.28, 0.17, 1.3, 0.9
    for step in reversed(range(12)):
        yield plane(generator, (-3, first - height * step, nearest + depth * step), (6, depth), (0.3, depth), nearest + 0.1 * step, along=(0, 0, 1))
        yield plane(generator, (-3, first - height * step, nearest + depth * step), (6, height), (0.3, height), nearest + 0.1 * step)


def scene(name, generator, beside):
    """Planes from far to near."""
    far = plane(generator, (-40, -25, 30), (80, 50), nearest=30)
    if name == "wall in bays":
        planes, distance = [far, plane(generator, (-5, -2.5, 3), (10, 5), (0.6, 1.5), 3)], 3
    elif name == "tiles":
        planes, distance = [plane(generator, (-2, -1, 1), (4, 2), (0.2, 0.2))], 1
    elif name == "rack":
        boxes = plane(generator, (-4, -2, 2.2), (8, 4), (0.4, 0.5), 2)
        planes, distance = [boxes, plane(generator, (-4, -2, 1.9), (8, 4), (0.8, 0.5), 1.9, 0.08)], 1.9
    elif name.startswith("fence"):
        planes, distance = [far, fence(generator)], 1.2
    else:
        wall = plane(generator, (-3, -3, 4.8), (6, 6), (0.3, 0.3), 4.8)
        planes, distance = [wall, *stairs(generator)], 1.3
        if name.endswith("balusters"):
            planes, distance = [*planes, plane(generator, (-3, -1, 1.1), (6, 2), (PICKETS, 2), 1.1, 0.025)], 1.1
    if beside:
        wide = 0.9 * distance * WIDTH / FOCAL
        planes.append(plane(generator, (0.1 * wide, -wide, 0.9 * distance), (0.45 * wide, 2 * wide), nearest=0.9 * distance))
    return planes


def path(name, is_standing):
    """Poses in the world; the motion is sideways, with the shake of a robot."""
    step = PICKETS if name.endswith("a pair") else SPEED / RATE
    shake, i = numpy.radians(0.4), numpy.arange(PAIRS)
    moved = numpy.maximum(i - STANDING + 1, 0) if is_standing else i
    for k in range(PAIRS):
        turn = cv2.Rodrigues(shake * numpy.sin([0.5 * moved[k], 0.31 * moved[k] + 1, 0.4 * moved[k] + 2]))[0]
        pose = poses.translation([step * (moved[k] - 7), 0.004 * numpy.sin(0.2 * moved[k]), 0.01 * numpy.sin(0.3 * moved[k])])
        pose[:3, :3] = turn
        yield pose


def views(planes, path):
    """Left and right images of poses: grey levels without dirt, and the dirt."""
    right = poses.translation([BASELINE, 0, 0])
    for pose in path:
        for at in (pose, pose @ right):
            image = numpy.zeros((HEIGHT * FINE, WIDTH * FINE, 3), numpy.float32)
            for each in planes:
                each.draw(at, image)
            yield cv2.GaussianBlur(cv2.resize(image, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)[..., :2], (0, 0), BLUR)


def write(folder, shown, dirt, truth, seed):
    """A drive in KITTI layout."""
    generator = numpy.random.default_rng(seed)
    for side in "01":
        (folder / f"image_{side}").mkdir(parents=True, exist_ok=True)
    for k, image in enumerate(shown):
        grey = image[..., 0] + dirt * image[..., 1] + generator.normal(0, NOISE, image.shape[:2])
        cv2.imwrite(str(folder / f"image_{k % 2}" / f"{k // 2:06d}.png"), numpy.clip(grey + 0.5, 0, 255).astype(numpy.uint8))
    projections = [numpy.column_stack([CAMERA, [-FOCAL * b, 0, 0]]) for b in (0, BASELINE)]
    (folder / "calib.txt").write_text("".join(f"P{i}: {' '.join(map(str, P.ravel()))}\n" for i, P in enumerate(projections)))
    (folder / "times.txt").write_text("".join(f"{i / RATE:.6f}\n" for i in range(PAIRS)))
    poses.write(folder / "poses.txt", truth)


def measure(directory, truth, params):
    """Counts of TRACKING, DEGRADED and LOST; wrong pairs; the largest error of a TRACKING pair in sigma; the error of the path at its end, m;
    None without a pose there."""
    run = odometry.run(directory, *params)
    errors = list(odometry.motion_errors(run, truth))
    with_pose = [i for i, state in enumerate(run.states) if state.has_pose]
    end = None
    if with_pose and with_pose[-1] == PAIRS - 1:
        motion, true = (poses.relative(stack[with_pose[0]], stack[-1]) for stack in (run.poses, truth))
        end = numpy.linalg.norm(poses.relative(motion, true)[:3, 3])
    return ([sum(state.state == word for state in run.states) for word in ("TRACKING", "DEGRADED", "LOST")],
            sum(is_wrong for _, is_wrong in errors), max((sigmas for sigmas, _ in errors), default=0.0), end)


def rows(folder, arguments):
    yield ["scene", "dirt [%]", "TRACKING/DEGRADED/LOST", "wrong pairs", "largest error [sigma]", "error of the path [mm]: from a stand, at speed"]
    for name, seed in SEEDS.items():
        if arguments.only and name not in arguments.only:
            continue
        found = {}
        for beside in (False, True):
            planes = scene(name, numpy.random.default_rng(seed + arguments.seed), beside)
            for is_standing in (True, False):
                way = numpy.array(list(path(name, is_standing)))
                truth, shown = numpy.array([poses.relative(way[0], pose) for pose in way]), list(views(planes, way))
                for dirt in (BESIDE,) if beside else DIRT:
                    directory = folder / f"{name}_{dirt}_{beside}_{is_standing}".replace(" ", "_")
                    write(directory, shown, dirt, truth, seed + arguments.seed)
                    found.setdefault((dirt, beside), []).append(measure(directory, truth, programs.params(arguments)))
        for (dirt, beside), results in found.items():
            counts, wrong, sigmas, ends = zip(*results)
            yield [name, f"{100 * dirt:.0f}" + ", unique beside" * beside, "/".join(str(sum(each)) for each in zip(*counts)), sum(wrong),
                   f"{max(sigmas):.1f}", ", ".join("–" if end is None else f"{1e3 * end:.0f}" for end in ends)]


def options(parser):
    parser.add_argument("--seed", type=int, default=0, help="added to the scenes' seeds [default 0]")
    parser.add_argument("--only", nargs="+", metavar="SCENE", default=[], help="[default: all]")
    programs.add_params(parser)
    drives.add_rendered(parser)
    marks.add_write(parser, marks.FAULTS)


def main(arguments):
    marks.check_names(arguments.only, SEEDS)
    with drives.folders(arguments) as (_, folder):
        marks.show(rows(folder, arguments), arguments.write, "repeats")
