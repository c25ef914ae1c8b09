"""What Rerun's viewer shows of a recording at first, and where."""

import math
from importlib import import_module
from typing import Any

from perpetua.formats.source import ExportSource


def viewer_layout(source: ExportSource) -> Any:
    """The scene on the left, or the points of depth in its place; the views' images on the right.

    The scene is shown without walls and ceiling, which would hide it from outside, and without depth; both are an
    entry in the viewer's list away.
    """
    rrb = import_module("rerun.blueprint")
    views = range(len(source.sequence.views))
    depth = [f"- /world/view_{view}/depth/**" for view in views]
    scene = rrb.Spatial3DView(
        origin="world", name="scene", contents=["+ /world/**", "- /world/shell/**", *depth], background=_PAPER
    )
    surfaces = [f"- /world/{group}/**" for group in ("room", "shell", "people")]
    points = rrb.Spatial3DView(
        origin="world", name="points of depth", contents=["+ /world/**", *surfaces], background=_PAPER
    )
    first = 0 if source.meshes is not None else 1
    images = [
        rrb.Spatial2DView(origin=f"world/view_{view}/image", name=f"view {view}", contents="$origin/**")
        for view in views
    ]
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Tabs(scene, points, active_tab=first),
            rrb.Grid(*images, grid_columns=math.ceil(math.sqrt(len(images)))),
            column_shares=[1.2, 1.0],
        ),
        rrb.TimePanel(expanded=False),
        rrb.SelectionPanel(expanded=False),
        rrb.BlueprintPanel(expanded=False),
    )


# Dark enough for bright tracks, light enough for dark furniture.
_PAPER = (58, 62, 68)
