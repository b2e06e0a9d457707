"""Every fault that images and stamps can have, as functions of a part's pairs, the drive and random numbers, that change the list or
its pairs."""
import dataclasses
import pathlib

import cv2
import numpy

from . import drives

cv2.setNumThreads(1)

# Pairs that a fault touches, out of every so many, and those after it without which there is none.
FIRST, LAST, EVERY, AFTER = 30, 45, 80, 15
PERIOD = 0.1  # s
BRAKING = 8.0  # m/s^2, of a car on a dry road


@dataclasses.dataclass
class Pair:
    """What the odometry gets, and the number of the rendered pair whose pose is the truth. An image is a path (it is
    linked) or an array (it is written)."""
    left: object
    right: object
    stamp: float
    truth: int


def pairs_of(drive):
    return [Pair(drive.path(0, i), drive.path(1, i), stamp, i) for i, stamp in enumerate(drive.stamps)]


def pixels(image):
    return drives.pixels(image) if isinstance(image, pathlib.Path) else image


def parts(pairs):
    """A long drive is hit again and again."""
    return [pairs[i:i + EVERY] for i in range(0, len(pairs), EVERY)]


def is_hit(part):
    return len(part) >= LAST + AFTER


def touched(pairs):
    return pairs[FIRST:LAST]


def images(change, sides=(0, 1)):
    """A fault that changes the pixels of some sides."""
    def fault(pairs, drive, random):
        for pair in touched(pairs):
            if 0 in sides:
                pair.left = change(pixels(pair.left), drive, random)
            if 1 in sides:
                pair.right = change(pixels(pair.right), drive, random)
        return pairs
    return fault


def shifted(dx, dy):
    def change(image, drive, random):
        return cv2.warpAffine(image, numpy.float32([[1, 0, dx], [0, 1, dy]]), image.shape[::-1], borderMode=cv2.BORDER_REPLICATE)
    return images(change, sides=(1,))


def rotated(degrees):
    def change(image, drive, random):
        _, cx, cy, _ = drive.camera
        matrix = cv2.getRotationMatrix2D((cx, cy), degrees, 1.0)
        return cv2.warpAffine(image, matrix, image.shape[::-1], borderMode=cv2.BORDER_REPLICATE)
    return images(change, sides=(1,))


def distorted(image, drive, random):
    """As a lens with k1 = -0.3 would show it, right where the sides differ a little."""
    f, cx, cy, _ = drive.camera
    rows, columns = image.shape
    u, v = numpy.meshgrid(numpy.arange(columns, dtype=numpy.float32), numpy.arange(rows, dtype=numpy.float32))
    x, y = (u - cx) / f, (v - cy) / f
    scale = 1 + 0.3 * (x * x + y * y)
    return cv2.remap(image, numpy.float32(f * x * scale + cx), numpy.float32(f * y * scale + cy),
                     cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


def unrectified(pairs, drive, random):
    """Raw images: distorted, and the right camera mounted half a degree off and 3 px down."""
    for pair in touched(pairs):
        pair.left = distorted(pixels(pair.left), drive, random)
        pair.right = distorted(pixels(pair.right), drive, random)
    return rotated(0.5)(shifted(0, 3)(pairs, drive, random), drive, random)


def gained(gain):
    return lambda image, drive, random: numpy.uint8(numpy.clip(image * gain, 0, 255))


def grey(level):
    return lambda image, drive, random: numpy.full_like(image, level)


def noisy(sigma):
    return lambda image, drive, random: numpy.uint8(numpy.clip(image + random.normal(0, sigma, image.shape), 0, 255))


def hidden(share):
    """Something dark on the lens, at the left."""
    def change(image, drive, random):
        image = image.copy()
        image[:, :round(share * image.shape[1])] = 8
        return image
    return change


def salted(image, drive, random):
    image, chance = image.copy(), random.random(image.shape)
    image[chance < 0.025], image[chance > 0.975] = 0, 255
    return image


def rained(image, drive, random):
    """Streaks anywhere, others in each image."""
    image = image.copy()
    for _ in range(600):
        x, y, length = random.integers(image.shape[1]), random.integers(image.shape[0]), random.integers(5, 25)
        cv2.line(image, (int(x), int(y)), (int(x) + 2, int(y + length)), int(random.integers(150, 255)), 1)
    return image


def blurred(image, drive, random):
    return cv2.GaussianBlur(image, (0, 0), 4.0)


def smeared(image, drive, random):
    return cv2.blur(image, (31, 1))


def compressed(image, drive, random):
    return cv2.imdecode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 10])[1], cv2.IMREAD_GRAYSCALE)


def frozen(pairs, drive, random):
    """Both cameras repeat their images while stamps and truth go on."""
    for pair in touched(pairs):
        pair.left, pair.right = pairs[FIRST - 1].left, pairs[FIRST - 1].right
    return pairs


def frozen_right(pairs, drive, random):
    for pair in touched(pairs):
        pair.right = pairs[FIRST - 1].right
    return pairs


def right_late(pairs, drive, random):
    rights = [pair.right for pair in pairs]
    for i in range(FIRST, LAST):
        pairs[i].right = rights[i - 1]
    return pairs


def right_one_pair_late(pairs, drive, random):
    """From the first pair to the last."""
    rights = [pair.right for pair in pairs]
    for pair, right in zip(pairs[1:], rights):
        pair.right = right
    return pairs


def torn(share, sides=(0, 1)):
    """From some row on, every third image is still that of the pair before."""
    def fault(pairs, drive, random):
        for i in range(FIRST, LAST, 3):
            old, new = pairs[i - 1], pairs[i]
            for name in ("left", "right")[sides[0]:sides[-1] + 1]:
                image, before = pixels(getattr(new, name)).copy(), pixels(getattr(old, name))
                row = round((1 - share) * len(image))
                image[row:] = before[row:]
                setattr(new, name, image)
        return pairs
    return fault


def rows_aside(pairs, drive, random):
    """From some row on, every third pair lies 8 or 16 px aside, in both images alike, as a damaged stream leaves it."""
    for pair in touched(pairs)[::3]:
        rows = len(pixels(pair.left))
        row, shift = random.integers(rows // 5, 4 * rows // 5), random.choice((-16, -8, 8, 16))
        pair.left, pair.right = pixels(pair.left).copy(), pixels(pair.right).copy()
        for image in (pair.left, pair.right):
            image[row:] = numpy.roll(image[row:], shift, axis=1)
    return pairs


def swapped(pairs, drive, random):
    for pair in touched(pairs):
        pair.left, pair.right = pair.right, pair.left
    return pairs


def duplicated(pairs, drive, random):
    """Every second pair shows the images of the one before."""
    for before, pair in zip(pairs[FIRST:LAST:2], pairs[FIRST + 1:LAST:2]):
        pair.left, pair.right = before.left, before.right
    return pairs


def out_of_order(pairs, drive, random):
    """Images of neighbouring pairs have changed places."""
    for a, b in zip(pairs[FIRST:LAST - 1:2], pairs[FIRST + 1:LAST:2]):
        (a.left, a.right, a.truth), (b.left, b.right, b.truth) = (b.left, b.right, b.truth), (a.left, a.right, a.truth)
    return pairs


def gap(seconds):
    def fault(pairs, drive, random):
        return pairs[:FIRST] + pairs[FIRST + round(seconds / PERIOD) - 1:]
    return fault


def sparse(pairs, drive, random):
    return [pair for i, pair in enumerate(pairs) if i < FIRST or i >= LAST or random.random() > 0.4]


def jittered(pairs, drive, random):
    for pair in touched(pairs):
        pair.stamp += random.uniform(-0.04, 0.04)
    return pairs


def uneven(pairs, drive, random):
    """Stamps 10 and 190 ms apart of pairs taken evenly."""
    for pair in pairs[FIRST:LAST:2]:
        pair.stamp += 0.9 * PERIOD
    return pairs


def bursts(pairs, drive, random):
    """Pairs taken evenly arrive by threes and are stamped on arrival, 1 ms apart."""
    for i in range(FIRST, LAST):
        pairs[i].stamp = pairs[i - i % 3].stamp + 0.001 * (i % 3)
    return pairs


def surface(random, rows, columns):
    """Something textured, grey level by grey level different."""
    texture = sum(cv2.resize(numpy.float32(random.normal(0, 1, (rows // s + 2, columns // s + 2))), (columns, rows),
                             interpolation=cv2.INTER_CUBIC) * s ** 0.5 for s in (3, 6, 12, 24))
    return numpy.clip(120 + 14 * texture, 0, 255)


def covered(share, velocity, depth=4.0):
    """A textured board parallel to the image `depth` m ahead that covers a share of it and moves by `velocity` (m/s, right
    and ahead); at zero it is fixed to the camera. Both cameras see it as geometry says."""
    def fault(pairs, drive, random):
        f, cx, cy, baseline = drive.camera
        rows, columns = pixels(pairs[0].left).shape
        board = surface(random, 2 * rows, 3 * columns)
        for k, pair in enumerate(touched(pairs)):
            away = depth + velocity[1] * PERIOD * k
            scale = depth / away
            for side in (0, 1):
                # Image of the board's texel (a, b): its middle lies ahead at the beginning.
                x = velocity[0] * PERIOD * k - side * baseline
                matrix = numpy.float32([[scale, 0, cx + f * x / away - scale * 1.5 * columns],
                                        [0, scale, cy - scale * rows]])
                drawn = cv2.warpAffine(board, matrix, (columns, rows), flags=cv2.INTER_AREA)
                drawn = numpy.clip(drawn + random.normal(0, 1.5, drawn.shape), 0, 255)
                # It ends at the same column of its own in both views, and of the left image on average as asked.
                edge = round(share * columns - side * f * baseline / away)
                image = pixels(pair.right if side else pair.left).copy()
                image[:, :max(edge, 0)] = drawn[:, :max(edge, 0)]
                if side:
                    pair.right = image
                else:
                    pair.left = image
        return pairs
    return fault


def blackened(pair):
    return dataclasses.replace(pair, left=numpy.zeros_like(pixels(pair.left)), right=numpy.zeros_like(pixels(pair.right)))


def black(count):
    def fault(pairs, drive, random):
        return pairs[:FIRST] + [blackened(pair) for pair in pairs[FIRST:FIRST + count]] + pairs[FIRST + count:]
    return fault


def paused_in_the_dark(count):
    """The drive brakes in the dark, stands for so many black pairs, and goes on as it braked."""
    def fault(pairs, drive, random):
        before, now = (drive.poses[pairs[i].truth][:3, 3] for i in (FIRST - 1, FIRST))
        step = numpy.linalg.norm(now - before)
        speed = step / PERIOD
        ways = numpy.arange(0.0, speed * speed / (2 * BRAKING), step) if step > 0 else numpy.zeros(1)
        braked = len(ways) - 1  # whole steps until it stands
        slow = numpy.diff((speed - numpy.sqrt(speed * speed - 2 * BRAKING * ways)) / BRAKING)
        rest = len(pairs) - FIRST - 2 * braked
        stamps = pairs[FIRST - 1].stamp + numpy.cumsum([*slow, *[PERIOD] * count, *slow[::-1], *[PERIOD] * rest])
        dark = [blackened(pair) for pair in pairs[FIRST:FIRST + braked] + [pairs[FIRST + braked - 1]] * count]
        return pairs[:FIRST] + [dataclasses.replace(pair, stamp=float(stamp))
                                for pair, stamp in zip(dark + pairs[FIRST + braked:], stamps)]
    return fault


def every_100th_black(pairs, drive, random):
    return [blackened(pair) if pair.truth % 100 == FIRST else pair for pair in pairs]


def carried_in_the_dark(pairs, drive, random):
    """Five black pairs, after which the camera is where it would be ten pairs later."""
    stamps = [pair.stamp for pair in pairs]
    pairs = black(5)(pairs, drive, random)
    pairs = pairs[:FIRST + 5] + pairs[FIRST + 15:]
    return [dataclasses.replace(pair, stamp=stamp) for pair, stamp in zip(pairs, stamps)]


FAULTS = {
    "none": lambda pairs, drive, random: pairs,
    "frozen": frozen, "frozen_right": frozen_right, "right_100_ms_late": right_late, "right_one_pair_late": right_one_pair_late, "swapped": swapped,
    "duplicated": duplicated, "out_of_order": out_of_order,
    "gap_0.5_s": gap(0.5), "gap_1.5_s": gap(1.5), "gap_3_s": gap(3.0), "dropped_40_percent": sparse,
    "stamps_jitter_40_ms": jittered, "stamps_10_190_ms": uneven, "bursts_1_ms": bursts,
    "right_down_1_px": shifted(0, 1), "right_down_3_px": shifted(0, 3), "right_down_5_px": shifted(0, 5),
    "right_up_4_px": shifted(0, -4), "right_rotated_0.5_deg": rotated(0.5), "right_rotated_2_deg": rotated(2.0),
    "raw_images": unrectified,
    "right_gain_1.6": images(gained(1.6), (1,)), "right_gain_3": images(gained(3.0), (1,)),
    "right_gain_0.4": images(gained(0.4), (1,)), "gain_3": images(gained(3.0)),
    "darkness": images(grey(2)), "white": images(grey(255)), "left_black": images(grey(0), (0,)),
    "right_black": images(grey(0), (1,)), "right_covered_30": images(hidden(0.3), (1,)),
    "right_covered_70": images(hidden(0.7), (1,)), "rows_aside": rows_aside,
    "black_1": black(1), "black_5": black(5), "black_20": black(20), "black_100": paused_in_the_dark(100),
    "every_100th_black": every_100th_black, "carried_in_the_dark": carried_in_the_dark,
    "noise_10": images(noisy(10)), "noise_30": images(noisy(30)), "salt_and_pepper": images(salted), "rain": images(rained),
    "blur_4_px": images(blurred), "right_blur_4_px": images(blurred, (1,)), "motion_blur_31_px": images(smeared),
    "jpeg_10": images(compressed),
    "occluder_40": covered(0.4, (0.0, 0.0)), "occluder_70": covered(0.7, (0.0, 0.0)),
    "mover_40": covered(0.4, (1.0, 0.0)), "mover_55": covered(0.55, (1.0, 0.0)), "mover_70": covered(0.7, (1.0, 0.0)),
}
for percent in (30, 50, 70):
    FAULTS.update({f"torn_{percent}": torn(percent / 100), f"left_torn_{percent}": torn(percent / 100, (0,)),
                   f"right_torn_{percent}": torn(percent / 100, (1,))})
# Of the whole drive, as options of render_drive.
RENDERED = {**{f"right_early_{ms}_ms": {"right_delay": -1e-3 * ms} for ms in (1, 3, 6, 16)},
            **{f"readout_{ms}_ms": {"readout": 1e-3 * ms} for ms in (10, 25)}}
FAULTS.update({name: FAULTS["none"] for name in RENDERED})
# With a standing camera.
STANDING_FAULTS = {
    "standing": FAULTS["none"], "standing_frozen": frozen, "standing_bursts_1_ms": bursts, "standing_noise_10": FAULTS["noise_10"],
    "standing_mover_40": covered(0.4, (1.0, 0.0)), "standing_mover_55": covered(0.55, (1.0, 0.0)),
    "standing_mover_70": covered(0.7, (1.0, 0.0)), "standing_slow_mover_40": covered(0.4, (0.1, 0.0)),
    "standing_slow_mover_55": covered(0.55, (0.1, 0.0)), "standing_approached_40": covered(0.4, (0.0, 1.0)),
    "standing_approached_70": covered(0.7, (0.0, 1.0)), "standing_dark": FAULTS["darkness"],
    **{f"standing_{name}": FAULTS[name] for name in ("black_1", "black_5", "black_20", "black_100", "every_100th_black", "gap_3_s")},
}

# These make a drive longer, so they come once.
LENGTHENING_FAULTS = ("black_100", "standing_black_100")
# These have no end.
LASTING_FAULTS = ("right_one_pair_late",)


def faulty_pairs(name, seed, drive):
    fault = STANDING_FAULTS.get(name) or FAULTS[name]
    random = numpy.random.default_rng(seed)
    if name in LASTING_FAULTS:
        return fault(pairs_of(drive), drive, random)
    return [pair for part in parts(pairs_of(drive)) for pair in (fault(part, drive, random) if is_hit(part) else part)]


def write_sequence(pairs, drive, directory):
    for side in (0, 1):
        (directory / f"image_{side}").mkdir(parents=True)
    (directory / "calib.txt").write_text((drive.directory / "calib.txt").read_text())
    (directory / "times.txt").write_text("".join(f"{pair.stamp:.9f}\n" for pair in pairs))
    for i, pair in enumerate(pairs):
        for side, image in enumerate((pair.left, pair.right)):
            path = directory / f"image_{side}" / f"{i:06d}.png"
            if isinstance(image, pathlib.Path):
                path.symlink_to(image)
            else:
                cv2.imwrite(str(path), image, [cv2.IMWRITE_PNG_COMPRESSION, 0])
