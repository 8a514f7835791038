"""The picture at the top of README: four parts side by side, cut out of the pictures of their pages. Needs Pillow."""

from pathlib import Path

from PIL import Image, ImageChops

FIGURES = Path(__file__).parents[2] / "figures"
PANEL = (640, 520)
# file, and the part of it without titles, scales and legends, as fractions: left, top, right, bottom
PANELS = [
    ("bracket_end.png", (0, 0, 0.9, 0.93)),
    ("gripper_part.png", (0, 0.06, 0.80, 0.93)),
    ("press_fit_hub.png", (0, 0.05, 1, 0.88)),
    ("half_ball_on_plate.png", (0, 0, 0.915, 0.97)),
]


def panel(name, part):
    """The drawn part of a picture, centred on white."""
    picture = Image.open(FIGURES / name).convert("RGB")
    width, height = picture.size
    left, top, right, bottom = part
    picture = picture.crop((int(left * width), int(top * height), int(right * width), int(bottom * height)))
    picture = picture.crop(ImageChops.difference(picture, Image.new("RGB", picture.size, "white")).getbbox())
    scale = min((PANEL[0] - 40) / picture.width, (PANEL[1] - 20) / picture.height)
    picture = picture.resize((round(scale * picture.width), round(scale * picture.height)), Image.Resampling.LANCZOS)
    ground = Image.new("RGB", PANEL, "white")
    ground.paste(picture, ((PANEL[0] - picture.width) // 2, (PANEL[1] - picture.height) // 2))
    return ground


front = Image.new("RGB", (PANEL[0] * len(PANELS), PANEL[1]), "white")
for i, (name, part) in enumerate(PANELS):
    front.paste(panel(name, part), (i * PANEL[0], 0))
front.save(FIGURES / "front.png", optimize=True)
