"""What pictures say as SVG, and where."""

from itertools import combinations
from xml.etree import ElementTree

from photogram.show.sketch.layout import width
from photogram.show.sketch.svg import svg_of


def overlap(one, other):
    """Return whether two boxes (left, upper, right, lower) have a common area."""
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def elements(sketch):
    """Return the parts of a picture as they are read of its file."""
    root = ElementTree.fromstring(svg_of(sketch, "name", "a <title>"))
    assert root.get("aria-label") == "a <title>"
    return root, list(root.iter())


def boxes(root):
    """Return the words of a picture that stand upright, and the boxes of these."""
    found = []

    def walk(node, size, anchor):
        size, anchor = float(node.get("font-size", size)), node.get("text-anchor", anchor)
        if node.tag.endswith("text") and "transform" not in node.attrib:
            wide = width(node.text, size)
            left = float(node.get("x")) - {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * wide
            low = float(node.get("y"))
            found.append((node.text, (left, low - 0.7 * size, left + wide, low)))
        for child in node:
            walk(child, size, anchor)

    walk(root, 8.0, "start")
    return found


def assert_readable(sketch, what):
    """Hold that no upright word lies over another, or is cut."""
    root, _ = elements(sketch)
    *_, wide, high = map(float, root.get("viewBox").split())
    words = boxes(root)
    for said, (left, top, right, low) in words:
        assert min(left, top) >= 0, (what, said)
        assert right <= wide, (what, said)
        assert low <= high, (what, said)
    over = [(a, b) for (a, one), (b, other) in combinations(words, 2) if overlap(one, other)]
    assert over == [], what
    return words
