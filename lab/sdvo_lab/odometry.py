"""Runs of run_sequence over a drive, and their errors."""
import csv
import dataclasses
import json
import pathlib
import tempfile

import numpy

from . import poses, programs


@dataclasses.dataclass
class State:
    """What the odometry says of a pair; covariances are 6x6, m and rad."""
    state: str
    epoch: int
    moved: bool
    motion: numpy.ndarray
    pose: numpy.ndarray
    reason: str

    @property
    def has_pose(self):
        return self.state in ("TRACKING", "DEGRADED")


def read_states(path):
    with open(path) as file:
        rows = list(csv.reader(file))[1:]
    # A reason may have commas in it.
    return [State(row[2], int(row[3]), row[5] == "1", *(numpy.array(row[k:k + 36], float).reshape(6, 6) for k in (6, 42)),
                  ",".join(row[78:])) for row in rows]


@dataclasses.dataclass
class Run:
    """Of one drive: poses, a State and a row of the timing file for each pair, and what run_sequence printed."""
    poses: numpy.ndarray
    states: list
    timing: list
    said: str


def run(directory, *arguments, tools=programs.TOOLS):
    with tempfile.TemporaryDirectory() as work:
        estimate, states, timing = (pathlib.Path(work) / name for name in ("poses.txt", "states.csv", "timing.csv"))
        said = programs.run("run_sequence", directory, "--poses", estimate, "--states", states, "--timing", timing, *arguments,
                            tools=tools)
        with open(timing) as file:
            return Run(poses.read(estimate), read_states(states), list(csv.DictReader(file)), said)


def errors(truth, estimate, lengths):
    """What evaluate_trajectory writes of poses, each a file or a stack of them, as a dictionary."""
    with tempfile.TemporaryDirectory() as work:
        def file(given, name):
            if not isinstance(given, numpy.ndarray):
                return given
            poses.write(pathlib.Path(work) / name, given)
            return pathlib.Path(work) / name

        result = pathlib.Path(work) / "errors.json"
        truth, estimate = file(truth, "truth.txt"), file(estimate, "poses.txt")
        programs.run("evaluate_trajectory", "--ground-truth", truth, "--estimate", estimate, "--lengths", lengths, "--json", result)
        return json.loads(result.read_text())
