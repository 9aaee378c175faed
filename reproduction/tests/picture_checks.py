"""What every figure must pass: data that say what they are, and a picture that is whole."""

from matplotlib.backends.backend_agg import FigureCanvasAgg

from saltus.plots.conventions import style


def check_provenance(name, data):
    for node in data.subtree:
        assert "saltus_version" in node.attrs, name
        assert "what" in node.attrs, name
        for variable in node.data_vars:
            assert node[variable].attrs.get("units"), f"{name}: {variable} has no units"


def clipped(picture):
    """The parts of a picture, axes with all their labels and texts, that reach beyond its edges by
    more than a pixel.
    """
    with style():
        FigureCanvasAgg(picture).draw()
    frame = picture.bbox.padded(1.0)
    parts = list(picture.texts)
    for axes in picture.axes:  # a box in space may be larger than the picture; its axes may not
        parts += [axes.xaxis, axes.yaxis, axes.zaxis] if hasattr(axes, "zaxis") else [axes]
    boxes = [(part, part.get_tightbbox(picture.canvas.get_renderer())) for part in parts]
    return [
        part
        for part, box in boxes
        if not (frame.contains(box.x0, box.y0) and frame.contains(box.x1, box.y1))
    ]
