"""What measures the odometry, one subcommand each; lab/run SUBCOMMAND --help says more."""
import argparse
import importlib
import sys

# Subcommand: module and what it is for. A module has options(parser) and main(arguments).
COMMANDS = {
    "accuracy": ("accuracy", "errors of recorded, disguised and rendered drives"),
    "covariance": ("covariance", "covariances against errors"),
    "faults": ("faults", "faults put into drives: what the odometry says of them"),
    "outages": ("outages", "drives blinded for a while: is the map found again, and only there?"),
    "ablate": ("ablate", "the odometry without one of its mechanisms"),
    "benchmark": ("benchmark", "cost of a pair: instructions, CPU time, latency"),
    "places": ("places", "recognised revisits and false loops of long drives"),
    "self-check": ("self_check", "the self-checks of run_sequence against the ground truth"),
    "experiments": ("experiments", "the paper's experiments"),
    "learn": ("learn", "FREAK's bit pairs and size curves, on rendered drives alone"),
    "tables": ("tables", "tables of the paper's experiments from their CSV files"),
    "figures": ("figures", "tables of the pages, made anew where the odometry is another one"),
    "golden": ("golden", "poses, states and covariances of two builds"),
    "shutters": ("shutters", "rolling shutters: ignored, estimated, known"),
    "delays": ("delays", "right cameras that are late or early"),
    "repeats": ("repeats", "texture that repeats: walls, tiles, racks, fences, stairs"),
    "two-cameras": ("two_cameras", "two cameras of one robot, fused by robot_localization"),
    "guises": ("guises", "a drive turned, cut, spoilt or in another order"),
    "film": ("film", "moving picture of a drive: features and path"),
    "layout": ("layout", "picture of the rooms of the sources"),
}


def main():
    parser = argparse.ArgumentParser(prog="lab/run", description=__doc__)
    commands = parser.add_subparsers(dest="command", metavar="SUBCOMMAND")
    commands.required = True
    for name, (_, purpose) in COMMANDS.items():
        commands.add_parser(name, help=purpose, add_help=False)
    chosen = parser.parse_args(sys.argv[1:2]).command
    module = importlib.import_module("." + COMMANDS[chosen][0], __package__)
    parser = argparse.ArgumentParser(prog=f"lab/run {chosen}", description=module.__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    module.options(parser)
    arguments, arguments.rest = parser.parse_known_args(sys.argv[2:])
    if arguments.rest and not hasattr(module, "PASSES_ON"):
        parser.error("unrecognized arguments: " + " ".join(arguments.rest))
    return module.main(arguments)


if __name__ == "__main__":
    sys.exit(main())
