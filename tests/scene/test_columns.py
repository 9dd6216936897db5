"""The columns that the parts of a scene make in history.csv."""

from archord.scene.columns import part_columns
from archord.scene.file import load_scene


def test_a_body_of_revolution_tells_areas_and_whole_forces():
    """Its directions are r and z, and there are no moments."""
    lug = load_scene("scenes/lug.toml")
    ring = lug.model_copy(
        update={"analysis": lug.analysis.model_copy(update={"plane": "axisymmetric"})}
    )
    units = {f"{part} {what}": unit for _, part, what, unit in part_columns(ring)}
    (name,) = (interaction.name for interaction in ring.interaction)
    assert units[f"{name} contact area"] == "mm2"
    assert units[f"{name} force z"] == "N"
    assert units[f"{name} at r"] == "mm"
    assert not any(column.endswith((" moment", " x", " y", "length")) for column in units)
