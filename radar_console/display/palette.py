"""Colours by their meaning: one hue a meaning, and never hue alone (shape and line style carry it too)."""

from dataclasses import dataclass

Colour = tuple[int, int, int]
"""Red, green, blue in 0 … 255."""


def colour(code: str) -> Colour:
    """The colour of ``#rrggbb``."""
    if len(code) != 7 or code[0] != "#":
        raise ValueError(f"a colour is #rrggbb, found {code!r}")
    return int(code[1:3], 16), int(code[3:5], 16), int(code[5:7], 16)


def code(value: Colour) -> str:
    """``#rrggbb``, for style sheets."""
    return "#{:02x}{:02x}{:02x}".format(*value)


def mix(one: Colour, other: Colour, part: float) -> Colour:
    """`part` of `other` in `one`."""
    red, green, blue = (round(a + (b - a) * part) for a, b in zip(one, other, strict=True))
    return red, green, blue


@dataclass(frozen=True, slots=True)
class Palette:
    """A colour for every meaning.

    Attributes
    ----------
    background, scope, panel : behind everything, behind the scope, behind tables
    hairline, ring, ring_text : separators; range rings and spokes; their figures
    coast, border, own_map, land : the map
    text, dim, bright : what is read, what is furniture, what is emphasised
    phosphor : plots and their afterglow, from the faintest to the brightest
    sweep : the beam
    centroid, track, tentative, coasting, truth : what is on the scope
    selection : the bracket about the selected track, and its row
    alarm, warning, good : states of the equipment
    """

    background: Colour
    scope: Colour
    panel: Colour
    hairline: Colour
    ring: Colour
    ring_text: Colour
    coast: Colour
    border: Colour
    own_map: Colour
    land: Colour
    text: Colour
    dim: Colour
    bright: Colour
    phosphor: tuple[Colour, ...]
    sweep: Colour
    centroid: Colour
    track: Colour
    tentative: Colour
    coasting: Colour
    truth: Colour
    selection: Colour
    alarm: Colour
    warning: Colour
    good: Colour


NIGHT = Palette(
    background=colour("#080c11"),
    scope=colour("#060a0f"),
    panel=colour("#0d131a"),
    hairline=colour("#1b2630"),
    ring=colour("#1e2c38"),
    ring_text=colour("#6a8296"),
    coast=colour("#35506a"),
    border=colour("#263a4c"),
    own_map=colour("#5a6f4c"),
    land=colour("#0a1118"),
    text=colour("#c9d6e2"),
    dim=colour("#7a90a2"),
    bright=colour("#edf4fa"),
    phosphor=(colour("#0c3324"), colour("#2ea06c"), colour("#beffda")),
    sweep=colour("#5fd79b"),
    centroid=colour("#ffc55c"),
    track=colour("#8fe3ff"),
    tentative=colour("#4f8196"),
    coasting=colour("#8fe3ff"),
    truth=colour("#e07be0"),
    selection=colour("#edf4fa"),
    alarm=colour("#ff6b57"),
    warning=colour("#ffc55c"),
    good=colour("#5fd79b"),
)

# The hues of Okabe and Ito, "Color Universal Design", 2008; greys as by night.
OKABE_ITO = Palette(
    background=colour("#0a0a0c"),
    scope=colour("#060608"),
    panel=colour("#111114"),
    hairline=colour("#26262b"),
    ring=colour("#2a2a30"),
    ring_text=colour("#85858e"),
    coast=colour("#55555f"),
    border=colour("#3c3c44"),
    own_map=colour("#77776a"),
    land=colour("#0e0e11"),
    text=colour("#d8d8dc"),
    dim=colour("#8e8e98"),
    bright=colour("#ffffff"),
    phosphor=(colour("#00352a"), colour("#009e73"), colour("#9ff0d6")),
    sweep=colour("#009e73"),
    centroid=colour("#f0e442"),
    track=colour("#56b4e9"),
    tentative=colour("#3f6f8c"),
    coasting=colour("#56b4e9"),
    truth=colour("#cc79a7"),
    selection=colour("#ffffff"),
    alarm=colour("#d55e00"),
    warning=colour("#e69f00"),
    good=colour("#009e73"),
)

PALETTES: dict[str, Palette] = {"night": NIGHT, "okabe-ito": OKABE_ITO}
