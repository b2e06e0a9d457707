"""Learns constants of the package on rendered drives alone; no image or pose of a data set is among them.

    lab/run learn freak-pairs                         # FREAK's bit pairs: src/front_end/freak_pairs.inc
    lab/run learn size-curve --output FILE ARGUMENT … # one run of learn size-curve, with its arguments

No table has these seeds."""
from . import drives, programs

PASSES_ON = True  # what it does not know are arguments of the program
PAIRS = programs.ROOT / "src/front_end/freak_pairs.inc"
# Images of a drive lie far apart: trajectory, rig, seed, for each world, with its pairs a second; then the same in other light, with more noise.
DAY = {("street", 1): [("straight", "kitti", 8811), ("figure_eight", "kitti", 8812), ("city_loop", "kitti", 8813), ("city_loop", "d435", 8814),
                       ("figure_eight", "oak_d", 8815), ("straight", "zed_mini", 8816)],
       ("room", 0.5): [("hover", "euroc", 8821), ("hover", "d435_small", 8822), ("hand_held", "d435", 8823), ("hand_held", "d435_small", 8824),
                       ("hand_held", "zed_mini", 8825), ("turn_in_place", "oak_d", 8826)],
       ("corridor", 0.5): [("corridor", "oak_d", 8831), ("corridor", "d435_small", 8832)],
       ("desk", 0.5): [("desk", "d435", 8841), ("desk", "d435_small", 8842)]}
DUSK = {("street", 1): [("straight", "kitti", 8861), ("figure_eight", "kitti", 8862), ("city_loop", "kitti", 8863), ("back_and_forth", "kitti", 8864),
                        ("city_loop", "kitti", 8865), ("figure_eight", "euroc", 8866), ("city_loop", "oak_d", 8867), ("straight", "d435_small", 8868)],
        ("room", 0.5): [("hover", "zed_mini", 8871), ("hover_1m", "d435", 8872), ("hand_held", "euroc", 8873), ("hand_held", "d435_small", 8874),
                        ("turn_in_place", "d435", 8875), ("turn_in_place", "kitti", 8876)],
        ("corridor", 0.5): [("corridor", "zed_mini", 8881), ("corridor", "euroc", 8882)],
        ("desk", 0.5): [("desk", "zed_mini", 8883), ("desk", "oak_d", 8884)]}
EFFECTS = {"noise": 2, "exposure": 0.3}
# Drives that sizes are chosen on, from where the camera is under way: trajectory, rig, seed, first pose.
SIZED = [("city_loop", "kitti", 8851, 100), ("figure_eight", "kitti", 8852, 50), ("hand_held", "d435_small", 8853, 40),
         ("hand_held", "zed_mini", 8854, 40)]


def render(folder, chosen, pairs, **options):
    """Directories, in the order of their names."""
    def one(drive):
        trajectory, rig, seed, *start = drive
        name = f"{trajectory}_{rig}_{seed}"
        return drives.rendered(folder, trajectory, rig, seed, *(start or [0]), pairs, name=name, threads=1, **options).directory

    with programs.pool() as pool:
        return sorted(pool.map(one, chosen))


def learn_freak_pairs(folder, rest):
    directories = []
    for worlds, pairs, effects in ((DAY, 12, {}), (DUSK, 10, EFFECTS)):
        for (world, rate), chosen in worlds.items():
            directories += render(folder, chosen, pairs, world=world, rate=rate, **effects)
    images = [image for directory in sorted(directories) for image in sorted(directory.glob("image_0/*.png"))]
    print(programs.run("learn", "freak-pairs", *images, "--output", PAIRS, *rest))


def choose_size_curve(folder, rest):
    directories = render(folder, SIZED, 21, **EFFECTS)
    print(programs.run("learn", "size-curve", "--sequence", ",".join(map(str, directories)), *rest))


def options(parser):
    parser.add_argument("what", choices=["freak-pairs", "size-curve"])
    drives.add_rendered(parser)


def main(arguments):
    with drives.folders(arguments) as (_, folder):
        learn = learn_freak_pairs if arguments.what == "freak-pairs" else choose_size_curve
        learn(folder, arguments.rest)
