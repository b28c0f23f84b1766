"""The layout of figures."""


def room_around(figure):
    """Return the room [inches] on the left, below, on the right and above what a figure shows; below 0 is cut off."""
    (width, height), box = figure.get_size_inches(), figure.get_tightbbox()
    return box.x0, box.y0, width - box.x1, height - box.y1
