#!/usr/bin/env python3
"""What happens on a disk that is really full? Needs root, to mount one; no part of the suite.

    full_disk.py [--build build] [--kind tmpfs|ext4] [--runs 24]

Mounts a disk of 8 MiB on which old outputs lie and fills it but for some room, from none to what the
command needs; then runs the command. Each run must end with exit code 0 and the right file, or with
exit code 1, one line that names the file, and the old file as it was; no temporary file is left. Commands:
precompute of a picture and of vertices, compress, relight. Prints a line a command; exit code 1
unless all is so.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

DISK_KIB = 8192
OLD = b"an old file\n" * 3000  # which takes room, too


class Disk:
    def __init__(self, folder, kind):
        self.place, self.kind, self.image = folder / "disk", kind, folder / "image"
        self.place.mkdir()

    def __enter__(self):
        if self.kind == "tmpfs":
            words = ["mount", "-t", "tmpfs", "-o", f"size={DISK_KIB}k", "tmpfs", str(self.place)]
        else:
            with open(self.image, "wb") as image:
                image.truncate(DISK_KIB * 1024)
            subprocess.run(["mkfs.ext4", "-q", "-F", "-m", "0", str(self.image)], check=True)
            words = ["mount", "-o", "loop", str(self.image), str(self.place)]
        subprocess.run(words, check=True)
        return self

    def __exit__(self, *_):
        subprocess.run(["umount", str(self.place)], check=True)
        self.place.rmdir()

    def clear(self):
        for entry in self.place.iterdir():
            if entry.name == "lost+found":
                continue
            shutil.rmtree(entry) if entry.is_dir() else entry.unlink()

    def fill(self, room_kib):
        """Takes all of the disk but `room_kib`."""
        subprocess.run(["sync", "-f", str(self.place)], check=True)
        usage = shutil.disk_usage(self.place)
        ballast = usage.free - room_kib * 1024
        if ballast <= 0:
            return
        with open(self.place / "ballast", "wb") as file:
            try:
                file.write(bytes(ballast))
            except OSError:
                pass
        subprocess.run(["sync", "-f", str(self.place)], check=True)


def table(path):
    path.write_text("v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -0.4 0.1 -0.4\nv 0.4 0.1 -0.4\nv 0 0.8 0\n"
                    "f 4 3 2 1\nf 5 7 6\n")


class Command:
    def __init__(self, name, words, output):
        self.name, self.words, self.output = name, words, output


def commands(folder, disk, program):
    table(folder / "table.obj")
    scene = [program, "precompute", str(folder / "table.obj"), "--face", "8", "--spp", "2",
             "--uniform-spp", "--threads", "2", "--effects", "shadows"]
    picture = scene + ["--size", "64x64"]
    vertices = scene + ["--vertices", "--max-vertices", "500"]
    for made, words in (("p.hlt", picture), ("v.hlt", vertices)):
        subprocess.run(words + ["-o", str(folder / made)], check=True, capture_output=True)
    light = folder / "sky.hdr"
    light.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n" +
                      bytes([128, 90, 60, 129]) * 32)
    out = disk.place / "out"
    return [
        Command("precompute, a picture", picture + ["-o", str(out / "a.hlt")], "a.hlt"),
        Command("precompute, vertices", vertices + ["-o", str(out / "a.hlt")], "a.hlt"),
        Command("compress", [program, "compress", str(folder / "v.hlt"), "-o", str(out / "c.hlt"),
                             "--clusters", "4", "--basis", "8"], "c.hlt"),
        Command("relight", [program, "relight", str(folder / "p.hlt"), "--env", str(light),
                            "--frames", "1", "--formats", "exr", "-o", str(out)], "frame_0000.exr"),
    ]


def try_all(command, disk, runs):
    out = disk.place / "out"
    disk.clear()
    out.mkdir()
    whole = subprocess.run(command.words, capture_output=True, text=True)
    if whole.returncode != 0:
        sys.exit(f"{command.name}: fails on an empty disk: {whole.stderr}")
    right = (out / command.output).read_bytes()
    # A journal and the file that is put together from it lie there at the same time.
    need = 3 * len(right) // 1024 + 64
    done = refused = 0
    wrong = []
    for i in range(runs):
        disk.clear()
        out.mkdir()
        (out / command.output).write_bytes(OLD)
        disk.fill(need * i // (runs - 1))
        result = subprocess.run(command.words, capture_output=True, text=True)
        there = (out / command.output).read_bytes()
        left = [p.name for p in out.iterdir() if ".tmp-" in p.name]
        if result.returncode == 0:
            done += 1
            good = there == right and not left
        else:
            refused += 1
            good = (result.returncode == 1 and there == OLD and not left
                    and str(out) in result.stderr)
        if not good:
            wrong.append(f"room {need * i // (runs - 1)} KiB: exit code {result.returncode}, file "
                         f"{'old' if there == OLD else 'right' if there == right else 'NEITHER'}, "
                         f"left {left}, said: {result.stderr.strip()}")
    print(f"{command.name}: {runs} runs, {refused} refused, {done} done, {len(wrong)} wrong",
          flush=True)
    print("\n".join(wrong), end="\n" if wrong else "")
    return bool(wrong) or refused < 1 or done < 1


def main():
    root = Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--build", type=Path, default=root / "build")
    parser.add_argument("--kind", choices=("tmpfs", "ext4"), default="tmpfs")
    parser.add_argument("--runs", type=int, default=24)
    options = parser.parse_args()
    program = str((options.build / "bin/haarlight").resolve())
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with Disk(folder, options.kind) as disk:
            bad = [try_all(command, disk, options.runs)
                   for command in commands(folder, disk, program)]
    return 1 if any(bad) else 0


if __name__ == "__main__":
    sys.exit(main())
