"""Draws the rooms of the sources and which includes which: docs/images/layout.svg, from the #include lines alone.

An arrow means "includes"; arrows that follow from others are left out."""
import re
import sys
import textwrap

from .programs import ROOT

PICTURE = ROOT / "docs" / "images" / "layout.svg"
HEADERS, SOURCES = ROOT / "include" / "stereo_descriptor_vo", ROOT / "src"
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)

# What the includes do not tell: what a room is for, and its place from left (0) to right in the picture.
ROOMS = {
    "common": ("what all sides speak", 0.5),
    "options": ("options of features and odometry", 1.7),
    "front_end": ("image side: pair of images to features", 1.0),
    "motion": ("correspondences to a pose", 0.0),
    "matching": ("features to matches, aligned patches", 0.0),
    "map": ("points, key frames, window", 0.0),
    "belief": ("prior, hypotheses, doubt", 0.0),
    "rig": ("what is learnt of this rig", 0.0),
    "odometry": ("a pair's way through these rooms", 0.0),
    "places": ("places recognised by features", 2.3),
    "data": ("files of data sets", 3.4),
    "config": ("all options in one place", 3.0),
    "messages": ("messages meet the core", 2.0),
    "ros": ("nodelets: parameters, topics, threads", 1.5),
    "check": ("steps of a camera's check", 1.0),
    "tools": ("command lines", 2.2),
}
WIDTH, GAP, MARGIN, LINE = 250, 30, 15, 15
MOTION_SIDE = ("motion", "matching", "map", "belief", "rig", "odometry")
COLOURS = {"front_end": "#dcebfa", "places": "#dcebfa", "common": "#e3e0f7", "ros": "#eef6e6",
           **{room: "#dcebfa" for room in MOTION_SIDE}}


def files_of(room):
    return [f for parent in (HEADERS, SOURCES) for f in sorted((parent / room).rglob("*")) if f.is_file()]


def room_of(header, includer):
    """Empty for headers from elsewhere."""
    public, source = HEADERS.parent / header, (includer.parent / header).resolve()
    for path, rooms in ((public, HEADERS), (source, SOURCES)):
        if path.is_file() and rooms in path.parents:
            return path.relative_to(rooms).parts[0]
    return ""


def includes_of(room, rooms):
    found = {room_of(header, f) for f in files_of(room) for header in INCLUDE.findall(f.read_text())}
    return {other for other in found if other in rooms and other != room}


def reachable(room, includes):
    return set().union(*({other} | reachable(other, includes) for other in includes[room]), set())


def picture():
    rooms = sorted({d.name for parent in (HEADERS, SOURCES) for d in parent.iterdir() if d.is_dir()})
    unknown = [room for room in rooms if room not in ROOMS]
    if unknown:
        sys.exit(f"error: give {', '.join(unknown)} a place in ROOMS")
    includes = {room: includes_of(room, rooms) for room in rooms}
    level = {room: 0 for room in rooms}
    for _ in rooms:  # the longest way down
        level = {room: max((level[other] + 1 for other in includes[room]), default=0) for room in rooms}
    text = {room: textwrap.wrap(", ".join(sorted({f.stem for f in files_of(room)})), 34) for room in rooms}
    height = {room: 50 + LINE * len(text[room]) for room in rooms}

    top, y = {}, MARGIN
    for row in range(max(level.values()), -1, -1):
        inside = [room for room in rooms if level[room] == row]
        y += max(height[room] for room in inside)
        top.update({room: y - height[room] for room in inside})  # so that no arrow down crosses a neighbour
        y += 45
    total_height = y - 45 + MARGIN
    left = {room: MARGIN + ROOMS[room][1] * (WIDTH + GAP) for room in rooms}
    total_width = max(left.values()) + WIDTH + MARGIN

    svg = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{total_width:.0f}" height="{total_height}" '
        f'viewBox="0 0 {total_width:.0f} {total_height}" font-family="sans-serif" font-size="12">',
        '  <defs><marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="8" markerHeight="8" orient="auto">'
        '<path d="M0 0L10 5L0 10z" fill="#333"/></marker></defs>',
        f'  <rect width="{total_width:.0f}" height="{total_height}" fill="#fff"/>',
    ]
    for room in rooms:
        for other in sorted(includes[room]):
            if any(other in reachable(between, includes) for between in includes[room] - {other}):
                continue
            lines = f"M{left[room] + WIDTH / 2:.0f} {top[room] + height[room]}L{left[other] + WIDTH / 2:.0f} {top[other]}"
            svg.append(f'  <path d="{lines}" fill="none" stroke="#333" marker-end="url(#tip)"/>')
    for room in rooms:
        x, y = left[room], top[room]
        svg.append(f'  <rect x="{x:.0f}" y="{y}" width="{WIDTH}" height="{height[room]}" rx="6" '
                   f'fill="{COLOURS.get(room, "#f4f6f8")}" stroke="#357"/>')
        svg.append(f'  <text x="{x + 8:.0f}" y="{y + 18}" font-weight="bold" font-size="14">{room}/</text>')
        svg.append(f'  <text x="{x + 8:.0f}" y="{y + 34}" fill="#556">{ROOMS[room][0]}</text>')
        for i, line in enumerate(text[room]):
            svg.append(f'  <text x="{x + 8:.0f}" y="{y + 50 + LINE * i}">{line}</text>')
    return "\n".join(svg + ["</svg>", ""])


def options(parser):
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 when the picture is old")


def main(arguments):
    new = picture()
    if not arguments.check:
        PICTURE.write_text(new)
    elif PICTURE.read_text() != new:
        sys.exit(f"error: {PICTURE} is old: lab/run layout")
