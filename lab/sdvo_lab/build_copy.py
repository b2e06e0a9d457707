"""A copy of the package's last commit that is built with some lines changed."""
import contextlib
import os
import shutil
import subprocess
import sys

from .programs import ROOT


class BuildCopy:
    def __init__(self, name):
        """Lies in .catkin_ws/NAME; its workspace stays there, so that the next copy has its object files."""
        self.folder = ROOT / ".catkin_ws" / name
        self.package, self.workspace = self.folder / "package", self.folder / "workspace"
        self.tools = self.workspace / "devel/lib/stereo_descriptor_vo"
        shutil.rmtree(self.package, ignore_errors=True)
        self.package.mkdir(parents=True)
        archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout
        subprocess.run(["tar", "-x", "-C", self.package], input=archive, check=True)

    def build(self, *targets):
        if not self.builds(*targets):
            sys.exit(f"error: the package does not build, see {self.folder}/build.log")

    def builds(self, *targets):
        with open(self.folder / "build.log", "w") as log:
            return subprocess.run([self.package / "scripts/build", *targets], stdout=log, stderr=subprocess.STDOUT,
                                  env=dict(os.environ, WORKSPACE=str(self.workspace))).returncode == 0

    @contextlib.contextmanager
    def edited(self, edits):
        """The copy with other lines: `find`, which the `file` has once, becomes `replace`."""
        before = {}
        try:
            for edit in edits:
                path = self.package / edit["file"]
                text = path.read_text()
                before.setdefault(path, text)
                path.write_text(replaced(edit, text))
            yield
        finally:
            for path, text in before.items():
                path.write_text(text)


def replaced(edit, text):
    if text.count(edit["find"]) != 1 or edit["find"] == edit["replace"]:
        sys.exit(f"error: {edit['file']} has {text.count(edit['find'])} times, not once: {edit['find']}")
    return text.replace(edit["find"], edit["replace"])
