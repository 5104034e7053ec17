#!/usr/bin/env python3
"""Puts PNG pictures side by side with their names above: one column a method, one row a frame.

    contact_strip.py NWA-30=out/nwa PBI-30=out/pbi exact=out/reference --frames 30,75,104 -o strip.png
    contact_strip.py before=a.png after=b.png -o strip.png

Pixels are copied one to one unless --width asks for another width of a column. Needs numpy and
matplotlib (Debian: python3-numpy, python3-matplotlib).
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

GAP = 6  # pixels between pictures
TEXT = 26  # pixels for a line of text
DPI = 100


class Failure(Exception):
    """A message for the user, one line."""


def picture_file(place, frame):
    return place if frame is None else place / f"frame_{frame:04}.png"


def read_picture(file):
    import matplotlib.image

    try:
        return matplotlib.image.imread(file)
    except FileNotFoundError as error:
        raise Failure(f"{file}: no such picture") from error
    except (OSError, SyntaxError, ValueError) as error:
        raise Failure(f"{file}: cannot be read as a PNG: {error}") from error


def draw(columns, frames, width, title, output):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    grid = [[read_picture(picture_file(place, frame)) for _, place in columns] for frame in frames]
    height_over_width = max(p.shape[0] / p.shape[1] for row in grid for p in row)
    width = width or max(p.shape[1] for row in grid for p in row)
    height = round(width * height_over_width)
    left = GAP if frames == [None] else 4 * TEXT
    top = TEXT * (2 if title else 1) + GAP
    full_width = left + len(columns) * (width + GAP)
    full_height = top + len(frames) * (height + GAP)

    # Places below are in pixels from the top left; figures count fractions from the bottom left.
    figure = plt.figure(figsize=(full_width / DPI, full_height / DPI), dpi=DPI, facecolor="white")
    across = lambda x: x / full_width
    down = lambda y: 1 - y / full_height
    if title:
        figure.text(0.5, down(TEXT / 2), title, ha="center", va="center", fontsize=12)
    for c, (label, _) in enumerate(columns):
        x = left + c * (width + GAP)
        figure.text(across(x + width / 2), down(top - TEXT / 2 - GAP / 2), label, ha="center", va="center",
                    fontsize=11)
        for r, frame in enumerate(frames):
            y = top + r * (height + GAP)
            axis = figure.add_axes((across(x), down(y + height), width / full_width, height / full_height))
            axis.imshow(grid[r][c], cmap="gray", vmin=0, vmax=1,
                        interpolation="nearest" if width == grid[r][c].shape[1] else "antialiased")
            axis.axis("off")
    for r, frame in enumerate(frames):
        if frame is not None:
            y = top + r * (height + GAP) + height / 2
            figure.text(across(left / 2), down(y), f"frame {frame}", ha="center", va="center", fontsize=10)

    handle, temporary = tempfile.mkstemp(dir=output.parent, prefix=".", suffix=".png")
    os.close(handle)
    try:
        figure.savefig(temporary, dpi=DPI)
        os.chmod(temporary, 0o644)
        os.replace(temporary, output)
    except BaseException:
        os.unlink(temporary)
        raise


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("column", nargs="+", metavar="LABEL=PLACE",
                        help="a PNG, or with --frames a folder of frame_0000.png, ...")
    parser.add_argument("--frames", metavar="LIST", help="frames, one a row, as 30,75,104")
    parser.add_argument("--width", type=int, metavar="PIXELS", help="of a column [that of the pictures]")
    parser.add_argument("--title", default="", help="line above everything")
    parser.add_argument("-o", "--output", required=True, type=Path, metavar="FILE.png")
    arguments = parser.parse_args()
    if arguments.width is not None and arguments.width < 1:
        parser.error(f"--width: {arguments.width}, expected at least 1")
    columns = []
    for text in arguments.column:
        label, equals, place = text.partition("=")
        if not equals or not place:
            parser.error(f"'{text}', expected LABEL=PLACE")
        columns.append((label, Path(place)))
    try:
        frames = [int(f) for f in arguments.frames.split(",")] if arguments.frames else [None]
    except ValueError:
        parser.error(f"--frames: '{arguments.frames}', expected numbers with commas between")
    try:
        draw(columns, frames, arguments.width, arguments.title, arguments.output)
    except (Failure, OSError) as error:
        print(f"contact_strip.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
