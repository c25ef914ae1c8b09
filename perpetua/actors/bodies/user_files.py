"""Which files of the user's the drawn bodies are made from."""

from perpetua.actors.bodies.bedlam import textures_folder
from perpetua.actors.bodies.smplx_body import models_folder
from perpetua.actors.clothing.wardrobe import clothes_folder
from perpetua.actors.config import ActorsConfig
from perpetua.machine.assets import file_listing


def body_listing(config: ActorsConfig) -> list[str]:
    """Name, size and time of change of all files that bodies and their clothes may be made from."""
    if config.body == "smplx":
        return [*file_listing(models_folder(config.smplx)), *file_listing(textures_folder(config.smplx.textures))]
    return file_listing(clothes_folder(config.clothing.folder)) if config.clothing.source == "makehuman" else []
