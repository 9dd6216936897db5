"""A joint of a thickness lies between the planes."""

from archord.benchmarks.space import planes


def test_a_joint_as_thick_as_its_radius_lies_between_the_planes(monkeypatch):
    """In force and peak pressure, but for the elastic force, which is that of plane stress."""
    monkeypatch.setitem(planes.JOINT, "relative_element_size", 0.3)
    table = planes.table_of([1.0])
    rows = [[float(value) for value in row] for row in table.rows]
    assert [moved for _, moved, *_ in rows] == [0.8, 1.6, 3.2]
    for _, _, stress, strain, peak_stress, peak_strain, rim in rows:
        assert strain < 1 < stress
        assert peak_strain < 1 < peak_stress
        assert rim < 0.9
    assert rows[0][2] < 1.01
