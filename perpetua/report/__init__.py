"""A page about a data set: what it holds, how it is spread, whether it passed its checks, what it cost."""
