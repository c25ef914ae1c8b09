# SPDX-License-Identifier: GPL-3.0-or-later
"""Guesses what an object in a stranger's scene is from the words in its name, its collections' and its materials'."""

import re
from collections.abc import Iterable

from blender_scripts.worker.categories import category_of

# Words that say what an object is, in the plain nouns of the other sources; of several the longest phrase counts,
# and of equally long ones the last, because English puts the noun last ("kitchen table", "sofa cushion").
_PHRASES: dict[str, str] = {
    phrase: category
    for category, phrases in {
        "floor": "floor, flooring, parquet, floorboards, fussboden, boden",
        "ceiling": "ceiling, plafond",
        "wall": "wall, walls",
        "skirting_board": "skirting, skirting board, baseboard, plinth",
        "column": "column, pillar",
        "beam": "beam",
        "stairs": "stairs, stair, staircase, steps",
        "window": "window, windows, skylight",
        "window_frame": "window frame, window trim, windowsill, window sill",
        "door": "door, doors, doorway",
        "door_frame": "door frame, doorframe, door trim",
        "curtain": "curtain, curtains, drape, drapes, blind, blinds",
        "curtain_rod": "curtain rod, curtain rail",
        "ceiling_lamp": "ceiling lamp, ceiling light, pendant, pendant lamp, pendant light, chandelier, downlight",
        "floor_lamp": "floor lamp, standing lamp, floor light",
        "table_lamp": "lamp, table lamp, desk lamp, bedside lamp",
        "wall_lamp": "wall lamp, wall light, sconce",
        "rug": "rug, carpet, mat, doormat",
        "sofa": "sofa, couch, settee, loveseat",
        "armchair": "armchair, arm chair, recliner",
        "chair": "chair, dining chair",
        "desk_chair": "office chair, desk chair, swivel chair",
        "stool": "stool, bar stool, ottoman, footstool, pouf",
        "bench": "bench",
        "bed": "bed, bunk bed",
        "mattress": "mattress",
        "pillow": "pillow, pillows",
        "cushion": "cushion, cushions",
        "blanket": "blanket, duvet, quilt, bedspread",
        "nightstand": "nightstand, night stand, bedside table, bedside cabinet",
        "table": "table",
        "dining_table": "dining table",
        "coffee_table": "coffee table",
        "side_table": "side table, end table",
        "desk": "desk, writing table",
        "wardrobe": "wardrobe, wardrobe door, closet",
        "dresser": "dresser, chest of drawers, drawers",
        "cabinet": "cabinet, cabinet door, cupboard, cupboard door, sideboard, credenza, locker, storage",
        "bookshelf": "bookshelf, bookcase, book shelf",
        "shelf": "shelf, shelves, shelving, rack",
        "tv_bench": "tv bench, tv stand, tv storage, media console",
        "tv": "tv, television",
        "monitor": "monitor, computer, laptop, screen",
        "books": "book, books",
        "picture": "picture, painting, poster, wall art, picture frame, photo, artwork",
        "mirror": "mirror",
        "clock": "clock",
        "plant": "plant, potted plant, houseplant, flower, flowers, tree",
        "vase": "vase",
        "bowl": "bowl",
        "cup": "cup, mug",
        "plate": "plate, dish",
        "bottle": "bottle",
        "glass": "drinking glass, wine glass",
        "candle": "candle",
        "box": "box, crate",
        "basket": "basket, hamper",
        "bin": "bin, trash can, wastebasket",
        "kitchen_counter": "counter, countertop, worktop, kitchen counter",
        "kitchen_cabinet": "kitchen cabinet, kitchen cabinet door, kitchen cupboard",
        "kitchen_island": "kitchen island",
        "oven": "oven, oven door, stove, cooker, hob",
        "microwave": "microwave",
        "fridge": "fridge, fridge door, refrigerator, freezer",
        "dishwasher": "dishwasher",
        "washing_machine": "washing machine, washer, dryer",
        "extractor_hood": "extractor, extractor hood, range hood",
        "sink": "sink, basin, washbasin",
        "tap": "tap, faucet",
        "toilet": "toilet, wc",
        "bathtub": "bathtub, bath, tub",
        "shower": "shower",
        "bathroom_cabinet": "bathroom cabinet, vanity",
        "towel": "towel, towels",
        "radiator": "radiator, heater",
        "fireplace": "fireplace, chimney",
        "piano": "piano",
        "guitar": "guitar",
        "toy": "toy, toys",
        "ground": "ground, terrain, grass, lawn",
    }.items()
    for phrase in phrases.split(", ")
}  # fmt: skip
_LONGEST = max(len(phrase.split()) for phrase in _PHRASES)
# Materials tell what the building is made of; "wood" or "fabric" on an object tells nothing.
_FROM_MATERIALS = frozenset({"floor", "ceiling", "wall", "rug", "window"})


def guess_category(name: str, around: Iterable[str], materials: Iterable[str]) -> str:
    """The category of an object; ``clutter`` where nothing is told.

    Args:
        name: the object's own name.
        around: names of its parents and collections, the nearest first.
        materials: names of its materials.
    """
    for hint in (name, *around):
        category = _from_words(hint)
        if category is not None:
            return category
    told = {_from_words(material) for material in materials}
    if len(told) == 1 and (only := told.pop()) in _FROM_MATERIALS:
        return str(only)
    return category_of(name)


def _from_words(name: str) -> str | None:
    words = _words(name)
    for length in range(min(_LONGEST, len(words)), 0, -1):
        for start in range(len(words) - length, -1, -1):
            category = _PHRASES.get(" ".join(words[start : start + length]))
            if category is not None:
                return category
    return None


def _words(name: str) -> list[str]:
    """Lower-case words of ``KitchenTable_02.001``, ``kitchen-table`` or ``TVStand``: no counters, no marks."""
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", name)
    return [word.lower() for word in re.findall(r"[^\W\d_]+", parted)]
