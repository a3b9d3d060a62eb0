"""Writes pictures into an MP4 and a GIF as they come; both have their names when they are whole."""

from __future__ import annotations

import contextlib
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image

from catenary.base.files import appears_whole
from catenary.postproc.files.disk import unwritten

# A GIF has pictures of this width [px], and so many a second at most.
_GIF_WIDTH, _GIF_RATE = 800, 12.5
# Pixels that a colour has among those of the first picture from which colours are chosen.
_SHARE = 20_000


def write(
    pictures: Iterable[np.ndarray],
    size: tuple[int, int],
    rate: float,
    mp4: Path,
    gif: Path,
    colours: Sequence[str] = (),
) -> int:
    """Write both films; returns how many pictures they were made of. Not collective.

    One process of ffmpeg takes each picture and forgets it: memory does not grow with the film.

    Parameters
    ----------
    pictures : iterable of ndarray, shape (height, width, 4), dtype uint8
        Pictures of the film.
    size : tuple of int
        Width and height [px], both even.
    rate : float
        Pictures a second of the MP4 [1/s].
    mp4, gif : Path
        Files, replaced when the new ones are whole.
    colours : sequence of str, optional
        Colours of the pictures; the GIF takes its 256 from these and from the first picture.

    Raises
    ------
    RunBroken
        If a file cannot be written.
    """
    try:
        with appears_whole(mp4) as film, appears_whole(gif) as picture:
            return _encode(pictures, size, rate, (film, picture), colours)
    except OSError as error:
        raise unwritten(mp4, error) from error


def _encode(
    pictures: Iterable[np.ndarray],
    size: tuple[int, int],
    rate: float,
    parts: Sequence[Path],
    colours: Sequence[str],
) -> int:
    """Number of pictures that ffmpeg has written into both files."""
    count, pipe, whole = 0, None, False
    with tempfile.TemporaryDirectory() as place, tempfile.TemporaryFile() as errors:
        palette = Path(place) / "palette.png"
        try:
            for picture in pictures:
                if pipe is None:
                    _palette(picture, colours).save(palette)
                    command = _command(size, rate, palette, parts)
                    pipe = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=errors)
                pipe.stdin.write(np.ascontiguousarray(picture).data)  # type: ignore[union-attr]
                count += 1
            whole = True
        except BrokenPipeError:
            pass  # ffmpeg has ended, and says why
        finally:
            if pipe is not None:
                with contextlib.suppress(BrokenPipeError):
                    pipe.stdin.close()  # type: ignore[union-attr]
                if not whole:
                    pipe.kill()
                pipe.wait()
        if pipe is None or pipe.returncode:
            errors.seek(0)
            lines = errors.read().decode(errors="replace").split("\n")
            raise OSError(next((line for line in lines if line.strip()), "ffmpeg ended"))
    return count


def _command(size: tuple[int, int], rate: float, palette: Path, parts: Sequence[Path]) -> list[str]:
    """Command of ffmpeg: pictures from standard input into a film and an animated picture."""
    small = f"fps={min(rate, _GIF_RATE):g},scale={_GIF_WIDTH}:-1:flags=area"
    ways = f"[0:v]split[a][b];[b]{small}[s];[s][1:v]paletteuse=dither=none[g]"
    return [
        imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error",
        "-f", "rawvideo", "-pix_fmt", "rgb0", "-s", f"{size[0]}x{size[1]}", "-r", f"{rate:g}",
        "-i", "-", "-i", str(palette), "-filter_complex", ways,
        "-map", "[a]", "-c:v", "libx264", "-preset", "veryfast", "-crf", "20",
        "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", str(parts[0]),
        "-map", "[g]", "-loop", "0", "-f", "gif", str(parts[1]),
    ]  # fmt: skip


def _palette(picture: np.ndarray, colours: Sequence[str]) -> Image.Image:
    """256 colours as a picture of 16 by 16 pixels."""
    seen = np.asarray(picture)[..., :3].reshape(-1, 3)
    more = np.array([to_rgb(colour) for colour in colours]).reshape(-1, 3)
    wanted = np.repeat(np.round(255.0 * more).astype(np.uint8), _SHARE, axis=0)
    image = Image.fromarray(np.concatenate([seen, wanted])[None])
    chosen = image.quantize(256).getpalette() or []
    table = np.zeros((256, 3), dtype=np.uint8)
    table.reshape(-1)[: len(chosen)] = chosen
    return Image.fromarray(table.reshape(16, 16, 3))
