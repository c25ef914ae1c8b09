"""Full-body motion along a route: from words, from recorded clips, or by an outside model."""
