"""`inhand hands` and `inhand objects`: what there is."""

from inhand.cli.answer import Answer, Listing
from inhand.cli.commands import HandsConfig, ObjectsConfig
from inhand.hands import names as hand_names
from inhand.hands import objects
from inhand.hands.fit import widest_opening


def run_hands(_: HandsConfig) -> Answer:
    """Return the hands of the catalogue."""
    rows, entries = [], []
    for name in hand_names.CATALOGUE:
        hand = hand_names.parse_hand_name(name)
        lengths = [[1e3 * length for length in finger.links] for finger in hand.fingers]
        sizes = {"palm_mm": 1e3 * hand.palm_width, "opens_to_mm": 1e3 * widest_opening(hand)}
        entries.append({"name": name, "links_mm": lengths} | sizes)
        links = [" + ".join(f"{1e3 * length:.1f}" for length in finger.links) for finger in hand.fingers]
        rows.append((name, *links, f"{1e3 * hand.palm_width:.1f}", f"{1e3 * widest_opening(hand):.0f}"))
    header = "Name", "Left links [mm]", "Right links [mm]", "Palm [mm]", "Opens to [mm]"
    sentences = (
        f"Any name of the form {hand_names.FORM} is a hand; {hand_names.LAB_LIMITS_SUFFIX!r} at its end adds the",
        "laboratory's joint limits. A TOML file describes any other hand (docs/hands-and-objects.md).",
    )
    return Answer((Listing("Hands", header, rows),), sentences, lambda: entries)


def run_objects(_: ObjectsConfig) -> Answer:
    """Return the objects of the catalogue."""
    rows, entries = [], []
    for spec in objects.CATALOGUE.values():
        size = " x ".join(f"{1e3 * length:g}" for length in spec.size)
        sizes = {"size_mm": [1e3 * length for length in spec.size], "mass_g": 1e3 * spec.mass}
        entries.append({"name": spec.name, "shape": spec.shape} | sizes | {"friction": spec.friction})
        rows.append((spec.name, _shape(spec), size, f"{1e3 * spec.mass:g}", f"{spec.friction:g}"))
    sentences = (
        "Any shape_SIZE or shape_XxY in mm is an object (box_30x45, triangle_30x40); a TOML file describes any other,",
        "any outline given by its corners among them. A CSV, SVG or DXF file is an outline too, with its unit and",
        "mass as in part.dxf:unit=mm:mass_kg=0.05 (docs/hands-and-objects.md).",
    )
    header = "Name", "Shape", "Size [mm]", "Mass [g]", "Friction"
    return Answer((Listing("Objects", header, rows, numbers=2),), sentences, lambda: entries)


def _shape(spec: objects.ObjectSpec) -> str:
    """Return the word for an object's outline; of a polygon, its corners and its convex pieces, if it has several."""
    if spec.shape != "polygon":
        return spec.shape
    pieces = len(objects.convex_pieces(spec))
    concave = f", concave, {pieces} pieces" if pieces > 1 else ""
    return f"polygon, {len(spec.corners)} corners{concave}"
