"""`inhand hands` and `inhand objects`: what there is."""

from inhand.cli.answer import Answer, Listing
from inhand.cli.commands import HandsConfig, ObjectsConfig
from inhand.hands import names as hand_names
from inhand.hands import objects
from inhand.hands.fit import widest_opening
from inhand.hands.spatial import names as spatial_names
from inhand.hands.spatial import objects as solids


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
    table, more = _hands_in_space()
    told = (*sentences, f"In space a name has the form {spatial_names.FORM} (docs/spatial.md).")
    return Answer((Listing("Hands", header, rows), table), told, lambda: [*entries, *more])


def _hands_in_space() -> tuple[Listing, list[dict[str, object]]]:
    rows: list[tuple[str, ...]] = []
    entries: list[dict[str, object]] = []
    for name in spatial_names.CATALOGUE:
        hand = spatial_names.parse_spatial_name(name)
        finger, height = next(iter(hand.fingers)), 1e3 * hand.start_position[2]  # all are alike
        lengths = [1e3 * link.origin[2] for link in finger.links[2:]] + [1e3 * finger.tip[2]]
        tip = 1e3 * finger.tip_radius
        entries.append({"name": name, "fingers": len(hand.fingers), "links_mm": lengths, "tip_radius_mm": tip})
        links = " + ".join(f"{length:g}" for length in lengths)
        rows.append((name, str(len(hand.fingers)), links, f"{tip:g}", f"{height:.0f}"))
    header = "Name", "Fingers", "Links [mm]", "Tip radius [mm]", "Object starts at [mm]"
    return Listing("Hands in space", header, rows), entries


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
    table, more = _solids()
    told = (*sentences, f"In space an object is {solids.FORM} (docs/spatial.md).")
    return Answer((Listing("Objects", header, rows, numbers=2), table), told, lambda: [*entries, *more])


def _solids() -> tuple[Listing, list[dict[str, object]]]:
    rows: list[tuple[str, ...]] = []
    entries: list[dict[str, object]] = []
    for name in solids.CATALOGUE:
        spec = solids.parse_solid_name(name)
        sizes = {"size_mm": [1e3 * length for length in spec.size], "mass_g": 1e3 * spec.mass}
        entries.append({"name": name, "shape": spec.shape} | sizes | {"friction": spec.friction})
        size = " x ".join(f"{1e3 * length:g}" for length in spec.size)
        rows.append((name, spec.shape, size, f"{1e3 * spec.mass:g}", f"{spec.friction:g}"))
    header = "Name", "Shape", "Size [mm]", "Mass [g]", "Friction"
    return Listing("Objects in space", header, rows, numbers=2), entries


def _shape(spec: objects.ObjectSpec) -> str:
    """Return the word for an object's outline; of a polygon, its corners and its convex pieces, if it has several."""
    if spec.shape != "polygon":
        return spec.shape
    pieces = len(objects.convex_pieces(spec))
    concave = f", concave, {pieces} pieces" if pieces > 1 else ""
    return f"polygon, {len(spec.corners)} corners{concave}"
