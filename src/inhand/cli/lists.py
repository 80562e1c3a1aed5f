"""`inhand hands` and `inhand objects`: what there is."""

from inhand.cli.terminal import print_table, say
from inhand.hands import names as hand_names
from inhand.hands import objects
from inhand.hands.fit import widest_opening


def list_hands() -> None:
    """Print the hands of the catalogue."""
    rows = []
    for name in hand_names.CATALOGUE:
        hand = hand_names.parse_hand_name(name)
        links = [" + ".join(f"{1e3 * length:.1f}" for length in finger.links) for finger in hand.fingers]
        rows.append((name, *links, f"{1e3 * hand.palm_width:.1f}", f"{1e3 * widest_opening(hand):.0f}"))
    print_table("Hands", ("Name", "Left links [mm]", "Right links [mm]", "Palm [mm]", "Opens to [mm]"), rows)
    say(f"Any name of the form {hand_names.FORM} is a hand; {hand_names.LAB_LIMITS_SUFFIX!r} at its end adds the")
    say("laboratory's joint limits. A TOML file describes any other hand (docs/hands-and-objects.md).")


def list_objects() -> None:
    """Print the objects of the catalogue."""
    rows = []
    for spec in objects.CATALOGUE.values():
        size = " x ".join(f"{1e3 * length:g}" for length in spec.size)
        rows.append((spec.name, _shape(spec), size, f"{1e3 * spec.mass:g}", f"{spec.friction:g}"))
    print_table("Objects", ("Name", "Shape", "Size [mm]", "Mass [g]", "Friction"), rows, numbers=2)
    say("Any shape_SIZE or shape_XxY in mm is an object (box_30x45, triangle_30x40); a TOML file describes any other,")
    say("any outline given by its corners among them. A CSV, SVG or DXF file is an outline too, with its unit and")
    say("mass as in part.dxf:unit=mm:mass_kg=0.05 (docs/hands-and-objects.md).")


def _shape(spec: objects.ObjectSpec) -> str:
    """Return the word for an object's outline; of a polygon, its corners and its convex pieces, if it has several."""
    if spec.shape != "polygon":
        return spec.shape
    pieces = len(objects.convex_pieces(spec))
    concave = f", concave, {pieces} pieces" if pieces > 1 else ""
    return f"polygon, {len(spec.corners)} corners{concave}"
