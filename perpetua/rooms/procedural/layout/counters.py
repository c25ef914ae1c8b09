"""How a kitchen counter is divided into modules: where its sink, hob and oven are."""

from perpetua.rooms.procedural.layout.plan import Piece

MODULE_M = 0.6
SPLASH_M = 0.5


def module_x_m(piece: Piece, module: int) -> float:
    """The middle of a module of a counter, in the piece's own frame."""
    count = modules(piece)
    return (module + 0.5) * piece.size_m[0] / count - 0.5 * piece.size_m[0]


def modules(piece: Piece) -> int:
    """How many cabinets a counter consists of."""
    return max(2, round(piece.size_m[0] / MODULE_M))


def hob_module(piece: Piece) -> int:
    """The module with oven and hob."""
    return max(0, modules(piece) - 2) if piece.detail[0] < 0.5 else min(1, modules(piece) - 1)


def sink_module(piece: Piece) -> int:
    """The module with the sink."""
    count = modules(piece)
    return (hob_module(piece) + max(1, count // 2)) % count
