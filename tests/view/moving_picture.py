"""Makes demo.gif from the frames in a folder. The name of each frame is its time [ms]."""

import sys
from pathlib import Path

from PIL import Image

WIDTH = 800
COLORS = 128

folder = Path(sys.argv[1])
files = sorted((folder / "frames").glob("*.png"))
times = [int(file.stem) for file in files]
images = [Image.open(file).convert("RGB") for file in files]
images = [image.resize((WIDTH, round(image.height * WIDTH / image.width)), Image.LANCZOS) for image in images]
# One palette of several frames side by side: static parts then have the same colors in each frame, and cost nothing.
some = images[:: max(1, len(images) // 6)]
strip = Image.new("RGB", (WIDTH, sum(image.height for image in some)))
for number, image in enumerate(some):
    strip.paste(image, (0, number * image.height))
palette = strip.quantize(COLORS, dither=Image.Dither.NONE)
images = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
pauses = [later - earlier for earlier, later in zip(times, times[1:])] + [1500]
images[0].save(folder / "demo.gif", save_all=True, append_images=images[1:], duration=pauses, loop=0, optimize=True)
print(f"{folder / 'demo.gif'}: {len(images)} frames, {(folder / 'demo.gif').stat().st_size} bytes")
