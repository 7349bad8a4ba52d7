"""Renders a graph with the nodes of the pack through the Python package `shibo`."""
from pathlib import Path

import shibo

graph = shibo.load(str(Path(__file__).parents[1] / "graphs" / "landscape.ron"))
height = graph.render("height", resolution=64)
assert height.shape == (64, 64), height.shape
assert 0.0 <= height.min() < height.max() <= 1.0, (height.min(), height.max())
print("the pack renders in Python")
