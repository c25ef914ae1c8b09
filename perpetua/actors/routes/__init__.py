"""Where actors go: random walks, optimised together, checked against hard limits."""

from perpetua.actors.routes.plan import plan_routes

__all__ = ["plan_routes"]
