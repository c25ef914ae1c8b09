# SPDX-License-Identifier: GPL-3.0-or-later
"""What Infinigen's object names mean in plain English; names that stand for nothing known are clutter."""

import re

CLUTTER = "clutter"

# The first pattern that matches the whole name, without Blender's ".001" and a "_00" counter, gives the category.
_PATTERNS = tuple(
    (re.compile(pattern), category)
    for pattern, category in (
        (r"room_floor", "floor"),
        (r"room_ceiling(_back|_sill)?", "ceiling"),
        (r"room_wall(_corners|_back|_sill)?", "wall"),
        (r"room_skirting", "skirting_board"),
        (r"window|skylight", "window"),
        (r"curtain|window_curtain", "curtain"),
        (r"window_trim|cutout_trim|trim", "window_frame"),
        (r"door", "door"),
        (r"ceiling_light|ceiling_lamp\w*|light_bar\w*", "ceiling_lamp"),
        (r"(lamp_)?floor_lamp\w*|lamp_floor\w*", "floor_lamp"),
        (r"lamp_desk\w*|bedside_lamp|lamp\w*", "table_lamp"),
        (r"painting|wall_art\w*", "painting"),
        (r"mirror", "mirror"),
        (r"rug\w*", "rug"),
        (r"bathroom_wall_storage|sink_cabinet|sink_support", "bathroom_cabinet"),
        (r"kitchen_(upper_)?cabinet", "kitchen_cabinet"),
        (r"kitchen_countertop", "kitchen_counter"),
        (r"kitchen_plinth", "kitchen_plinth"),
        (r"kitchen_stool", "stool"),
        (r"(kitchen|bathroom|bathtub)_hardware", "fittings"),
        (r"(kitchen|bathroom)_sink", "sink"),
        (r"(kitchen|bathtub|sink)_tap|tap", "tap"),
        (r"bathtub", "bathtub"),
        (r"toilet", "toilet"),
        (r"mattress", "mattress"),
        (r"bed", "bed"),
        (r"cushion_bed_pillow\w*", "pillow"),
        (r"cushion\w*", "cushion"),
        (r"bedside_table", "bedside_table"),
        (r"sofa\w*", "sofa"),
        (r"dining_table", "dining_table"),
        (r"cocktail_table", "cocktail_table"),
        (r"_?table_coffee\w*", "coffee_table"),
        (r"_?(storage_)?table_side\w*", "side_table"),
        (r"_?table\w*", "table"),
        (r"desk_monitor", "monitor"),
        (r"television", "television"),
        (r"desk_chair", "desk_chair"),
        (r"(dining|cocktail)_chair|chair\w*", "chair"),
        (r"desk", "desk"),
        (r"tv_storage", "tv_stand"),
        (r"wall_board_shelf|wall_shelf|board_shelf", "wall_shelf"),
        (r"storage_box", "box"),
        (r"(wall_)?storage\w*|wall_cubby|cubby", "cabinet"),
        (r"plant\w*", "plant"),
        (r"vase\w*", "vase"),
        (r"bowl\w*", "bowl"),
        (r"cup\w*", "cup"),
        (r"book_(stack|row)", "books"),
        (r"jar", "jar"),
        (r"bottle", "bottle"),
        (r"candle", "candle"),
        (r"picture_frame", "picture_frame"),
        (r"towels", "towels"),
    )
)

# A person may stand on the upward faces of these.
WALKABLE = frozenset({"floor", "rug"})

# Small objects: where one hangs in the air it may fall or be left out, and the room stays what it is.
SMALL = frozenset(
    {
        "books",
        "bottle",
        "bowl",
        "box",
        "candle",
        "clutter",
        "cup",
        "cushion",
        "jar",
        "picture_frame",
        "pillow",
        "plant",
        "table_lamp",
        "towels",
        "vase",
    }
)

# Furniture that stands on the floor.
STANDING = frozenset(
    {
        "bed",
        "bedside_table",
        "chair",
        "cocktail_table",
        "coffee_table",
        "desk",
        "desk_chair",
        "dining_table",
        "floor_lamp",
        "side_table",
        "sofa",
        "stool",
        "table",
    }
)

# Panes of glass in these are openings that one looks through.
GLAZED = frozenset({"window", "door", "cabinet", "kitchen_cabinet", "bathroom_cabinet", "tv_stand", "ceiling_lamp"})

# A lamp stands inside these, so their own shade must not keep its light in.
LAMPS = frozenset({"ceiling_lamp", "floor_lamp", "table_lamp"})


def category_of(name: str) -> str:
    """The readable category of an Infinigen object name such as ``kitchen_cabinet_00.003``."""
    stem = re.sub(r"(_\d+)+$", "", re.sub(r"(\.\d+)+$", "", name))
    for pattern, category in _PATTERNS:
        if pattern.fullmatch(stem):
            return category
    return CLUTTER
