"""Writes pictures into an MP4 and a GIF, which have their names when they are whole."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from PIL import Image

from catenary.base.errors import InputError

# A GIF has pictures of this width [px], and so many a second at most.
_GIF_WIDTH, _GIF_RATE = 640, 12.5
# Height of what adds a colour to the palette [px].
_BAND = 8


def write(
    pictures: Iterable[np.ndarray],
    size: tuple[int, int],
    rate: float,
    mp4: Path,
    gif: Path,
    later: Sequence[str] = (),
) -> int:
    """Write both films; returns how many pictures they were made of. Not collective.

    Parameters
    ----------
    pictures : (height, width, 3) uint8 each
    size : width and height [px], both even
    rate : pictures a second of the MP4
    mp4, gif : files, replaced when the new ones are whole
    later : colours that the first picture may lack and others have

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    parts = [path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}") for path in (mp4, gif)]
    try:
        for part in parts:  # a link that was put there would be written through
            part.unlink(missing_ok=True)
        count, small = _write_mp4(pictures, size, rate, parts[0], later)
        small[0].save(
            parts[1], save_all=True, append_images=small[1:], loop=0, disposal=1,
            duration=round(1000.0 * _skipped(rate) / rate),
        )  # fmt: skip
        for part, path in zip(parts, (mp4, gif), strict=True):
            os.replace(part, path)
    except OSError as error:
        raise InputError(f"the film cannot be written to {mp4.parent}: {error}") from error
    finally:
        for part in parts:
            part.unlink(missing_ok=True)
    return count


def _skipped(rate: float) -> int:
    """Of how many pictures a GIF shows one."""
    return max(1, round(rate / _GIF_RATE))


def _write_mp4(
    pictures: Iterable[np.ndarray],
    size: tuple[int, int],
    rate: float,
    path: Path,
    later: Sequence[str],
) -> tuple[int, list[Image.Image]]:
    """Number of pictures written, and those of the GIF."""
    writer = imageio_ffmpeg.write_frames(
        str(path), size, fps=rate, codec="libx264", quality=7, macro_block_size=2,
        ffmpeg_log_level="error",
    )  # fmt: skip
    writer.send(None)
    small: list[Image.Image] = []
    count, palette = 0, None
    height = round(_GIF_WIDTH * size[1] / size[0])
    try:
        for picture in pictures:
            writer.send(np.ascontiguousarray(picture))
            if count % _skipped(rate) == 0:
                image = Image.fromarray(picture).resize((_GIF_WIDTH, height))
                # One palette for all: pictures differ little, and flicker would show.
                if palette is None:
                    palette = _with_colours(image, later).quantize(128)
                small.append(image.quantize(palette=palette, dither=Image.Dither.NONE))
            count += 1
    finally:
        writer.close()
    return count, small


def _with_colours(image: Image.Image, colours: Sequence[str]) -> Image.Image:
    """A picture with bands of further colours below it."""
    width, height = image.size
    wider = Image.new("RGB", (width, height + _BAND * len(colours)))
    wider.paste(image, (0, 0))
    for number, colour in enumerate(colours):
        low = height + _BAND * number
        wider.paste(colour, (0, low, width, low + _BAND))
    return wider
