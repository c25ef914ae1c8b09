"""The garments that outfits are drawn from: cuts, fabrics and dyes."""

from perpetua.actors.clothing.patterns import SkirtPattern, TopPattern, TrouserPattern

Colour = tuple[float, float, float]

# Linear RGB of dyes, by the names used in descriptions.
DYES: dict[str, Colour] = {
    "white": (0.72, 0.71, 0.68),
    "cream": (0.66, 0.58, 0.42),
    "grey": (0.20, 0.21, 0.22),
    "charcoal": (0.035, 0.037, 0.042),
    "navy": (0.012, 0.022, 0.075),
    "blue": (0.035, 0.13, 0.40),
    "sky": (0.26, 0.45, 0.66),
    "teal": (0.012, 0.17, 0.18),
    "green": (0.035, 0.16, 0.055),
    "olive": (0.11, 0.115, 0.035),
    "mustard": (0.55, 0.30, 0.025),
    "orange": (0.60, 0.16, 0.025),
    "red": (0.42, 0.025, 0.030),
    "burgundy": (0.12, 0.010, 0.022),
    "pink": (0.60, 0.24, 0.29),
    "purple": (0.13, 0.045, 0.23),
    "brown": (0.13, 0.060, 0.028),
    "beige": (0.46, 0.35, 0.23),
}
TOP_DYES = ("white", "teal", "red", "navy", "mustard", "green", "pink", "sky", "burgundy", "orange", "purple", "grey")
LEG_DYES = ("navy", "charcoal", "beige", "olive", "grey", "brown")
TOPS: dict[str, TopPattern] = {
    "T-shirt": TopPattern(
        sleeve_m=0.160,
        hem_z_m=0.010,
        neck_drop_m=0.055,
        vee=False,
        collar="band",
        ease_m=0.013,
        thickness_m=0.0025,
    ),
    "V-neck T-shirt": TopPattern(
        sleeve_m=0.150,
        hem_z_m=0.015,
        neck_drop_m=0.110,
        vee=True,
        collar="none",
        ease_m=0.012,
        thickness_m=0.0025,
    ),
    "polo shirt": TopPattern(
        sleeve_m=0.165,
        hem_z_m=0.005,
        neck_drop_m=0.060,
        vee=False,
        collar="polo",
        ease_m=0.013,
        thickness_m=0.0025,
        buttons_to_z_m=0.385,
    ),
    "shirt": TopPattern(
        sleeve_m=0.462,
        hem_z_m=-0.010,
        neck_drop_m=0.058,
        vee=False,
        collar="shirt",
        ease_m=0.015,
        thickness_m=0.0020,
        buttons_to_z_m=0.000,
        pocket=True,
    ),
    "jumper": TopPattern(
        sleeve_m=0.470,
        hem_z_m=0.025,
        neck_drop_m=0.050,
        vee=False,
        collar="band",
        ease_m=0.019,
        thickness_m=0.0050,
        fold_m=0.010,
    ),
    "long-sleeved top": TopPattern(
        sleeve_m=0.455,
        hem_z_m=0.015,
        neck_drop_m=0.070,
        vee=False,
        collar="band",
        ease_m=0.012,
        thickness_m=0.0025,
    ),
}
JACKETS: dict[str, TopPattern] = {
    "jacket": TopPattern(
        sleeve_m=0.470,
        hem_z_m=-0.030,
        neck_drop_m=0.075,
        vee=False,
        collar="none",
        ease_m=0.024,
        thickness_m=0.0060,
        open_m=0.040,
    ),
    "cardigan": TopPattern(
        sleeve_m=0.468,
        hem_z_m=-0.050,
        neck_drop_m=0.150,
        vee=True,
        collar="none",
        ease_m=0.022,
        thickness_m=0.0050,
        open_m=0.028,
    ),
}
# What a jacket may be worn over.
UNDER_JACKETS = ("T-shirt", "V-neck T-shirt")
JACKET_FABRICS = {"jacket": ("plain", "denim", "heather", "checks"), "cardigan": ("knit",)}
JACKET_DYES = ("navy", "charcoal", "olive", "beige", "brown", "grey", "burgundy")
BODICES = (
    TopPattern(
        sleeve_m=0.110,
        hem_z_m=0.085,
        neck_drop_m=0.075,
        vee=False,
        collar="none",
        ease_m=0.007,
        thickness_m=0.0025,
        fold_m=0.003,
    ),
    TopPattern(
        sleeve_m=0.145,
        hem_z_m=0.085,
        neck_drop_m=0.115,
        vee=True,
        collar="none",
        ease_m=0.007,
        thickness_m=0.0025,
        fold_m=0.003,
    ),
    TopPattern(
        sleeve_m=0.400,
        hem_z_m=0.085,
        neck_drop_m=0.060,
        vee=False,
        collar="none",
        ease_m=0.007,
        thickness_m=0.0025,
        fold_m=0.004,
    ),
)
DRESS_SKIRT = SkirtPattern(waist_z_m=0.125, hem_z_m=-0.400, hip_ease_m=0.004, thickness_m=0.003)
DRESS_FABRICS = ("print", "dots", "plain", "checks", "stripes")
TOP_FABRICS: dict[str, tuple[str, ...]] = {
    "T-shirt": ("stripes", "plain", "print", "heather"),
    "V-neck T-shirt": ("plain", "stripes", "dots", "print"),
    "polo shirt": ("stripes", "plain"),
    "shirt": ("checks", "gingham", "denim", "dots", "stripes"),
    "jumper": ("knit",),
    "long-sleeved top": ("stripes", "heather", "print"),
}
BOTTOMS: dict[str, TrouserPattern | SkirtPattern] = {
    "jeans": TrouserPattern(
        waist_z_m=0.125,
        leg_m=0.842,
        hip_ease_m=0.009,
        leg_ease_m=0.018,
        thickness_m=0.003,
        fold_m=0.0055,
        pockets=True,
    ),
    "slim trousers": TrouserPattern(
        waist_z_m=0.130,
        leg_m=0.836,
        hip_ease_m=0.008,
        leg_ease_m=0.014,
        thickness_m=0.003,
        fold_m=0.0045,
        pockets=True,
    ),
    "loose trousers": TrouserPattern(
        waist_z_m=0.130,
        leg_m=0.845,
        hip_ease_m=0.012,
        leg_ease_m=0.026,
        thickness_m=0.003,
        fold_m=0.0075,
    ),
    "shorts": TrouserPattern(
        waist_z_m=0.125,
        leg_m=0.375,
        hip_ease_m=0.012,
        leg_ease_m=0.028,
        thickness_m=0.003,
        pockets=True,
    ),
    "skirt": SkirtPattern(waist_z_m=0.090, hem_z_m=-0.380, hip_ease_m=0.003, thickness_m=0.003),
}
BOTTOM_FABRICS: dict[str, tuple[str, ...]] = {
    "jeans": ("denim",),
    "slim trousers": ("plain",),
    "loose trousers": ("plain", "heather"),
    "shorts": ("plain", "denim"),
    "skirt": ("plain", "checks", "denim", "print"),
}
# What is drawn from for legs; what stands twice is twice as likely.
MEN_WEAR = ("jeans", "slim trousers", "jeans", "loose trousers", "shorts", "loose trousers")
WOMEN_WEAR = ("jeans", "slim trousers", "skirt", "jeans", "loose trousers", "skirt", "shorts")
SHOES = ("trainers", "runners", "leather shoes")
SOCK_DYES = ("white", "grey", "charcoal", "navy", "white")
