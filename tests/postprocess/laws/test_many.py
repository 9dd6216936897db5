"""Forces of many joints at once."""

import warnings

import numpy as np
import pytest

from archord.postprocess.laws.general.general_law import general_law
from archord.postprocess.laws.general.joint import LawJoint, LawRangeWarning
from archord.postprocess.laws.general.many import loads

SAME = {"radius": 10.0, "E_star": 115e3, "plane": "strain", "nu": 0.3}


def test_each_row_is_the_law_of_its_joint_and_faults_stay_in_their_rows():
    """A joint outside the range, one beyond the table and one that is none have nan and a
    reason."""
    given = {"clearance": [0.05, 0.04, 1.0, -1.0, 0.05], "block_yield": [np.nan, 300, 1, 1, 300]}
    delta = np.array([0.05, 0.08, 0.05, 0.05, 0.2])
    found = loads(SAME | given, delta)
    joint = LawJoint(**SAME, clearance=0.04, block_yield=300.0)
    assert found.load[1] == general_law(joint).at(0.08).load
    assert found.load[0] == general_law(LawJoint(**SAME, clearance=0.05)).at(0.05).load
    assert np.isnan(found.load[2:]).all()
    assert [*found.reason[:2]] == ["", ""]
    assert "dR/R = 0.1 is outside" in found.reason[2]
    assert "clearance = -1 must be a positive number" in found.reason[3]
    assert "beyond 0.15, 3 dR" in found.reason[4]


def test_a_frame_is_a_table_of_joints():
    """Columns of words and missing values too; ways back have a deepest displacement."""
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(
        {
            "radius": 10.0,
            "clearance": [0.05, 0.06],
            "E_star": 115e3,
            "plane": ["strain", "stress"],
            "nu": 0.3,
            "pin_yield": [250.0, None],
            "block_yield": 250.0,
        }
    )
    delta = np.array([[0.02, 0.08, 0.06], [0.02, 0.08, 0.06]])
    deepest = np.array([0.0, 0.0, 0.08])
    found = loads(frame, delta, np.broadcast_to(deepest, delta.shape))
    law = general_law(LawJoint(10.0, 0.06, 115e3, plane="stress", nu=0.3, block_yield=250.0))
    assert found.load[1] == pytest.approx(law.at(delta[1], deepest).load, rel=1e-12)
    assert (found.load[:, 2] < found.load[:, 1]).all()
    assert not found.reason.any()


@pytest.mark.parametrize("given", [{"delta": [0.02, np.nan]}, {"deepest": [0.05, np.nan]}])
def test_a_missing_displacement_is_told(given):
    """Of its joint alone, whose other displacements keep their forces."""
    found = loads(SAME | {"clearance": [0.05, 0.05]}, **{"delta": 0.02} | given)
    assert list(np.isnan(found.load)) == [False, True]
    assert list(found.reason) == ["", "archord: a displacement is missing"]
    both = loads(SAME | {"clearance": 0.05}, [[0.02, np.nan]])
    assert list(np.isnan(both.load[0])) == [False, True]
    assert both.reason[0]


def test_displacements_and_ways_back_belong_to_joints():
    """One of each joint, whatever the other has: as many joints as columns change nothing."""
    table = SAME | {"clearance": [0.05, 0.04], "block_yield": 250.0}
    delta = np.array([[0.02, 0.03], [0.05, 0.07]])
    deepest = np.array([0.1, 0.08])
    found = loads(table, delta, deepest)
    again = loads(table, delta[:, 0], delta)
    for row, clearance in enumerate(table["clearance"]):
        law = general_law(LawJoint(**SAME, clearance=clearance, block_yield=250.0))
        assert found.load[row] == pytest.approx(law.at(delta[row], deepest[row]).load)
        assert again.load[row] == pytest.approx(law.at(delta[row, 0], delta[row]).load)
    for wrong in (np.zeros(3), np.zeros((3, 2)), np.zeros((2, 3)), np.zeros((1, 2, 2))):
        with pytest.raises(ValueError, match="are not of 2 joints"):
            loads(table, delta, wrong)


def test_tables_whose_rows_have_another_order_are_refused():
    """Rows count by their order: a series that was sorted gave each joint another joint's
    displacement or yield stress."""
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(SAME | {"clearance": [0.05, 0.06]}, index=[5, 3])
    delta = pandas.Series({5: 0.02, 3: 0.08})
    assert loads(frame, delta).load[0] == loads(frame, [0.02, 0.08]).load[0]
    with pytest.raises(ValueError, match="delta: has another index than joints"):
        loads(frame, delta.sort_index())
    columns = {"clearance": frame["clearance"], "block_yield": frame["clearance"].sort_index()}
    with pytest.raises(ValueError, match="block_yield: has another index than clearance"):
        loads(SAME | columns, 0.05)


def test_a_column_that_changes_nothing_is_refused():
    """A length made no force the whole pin's, and no coefficient of Winkler's law counted."""
    table = SAME | {"clearance": [0.05, 0.06]}
    for idle in ({"length": [20.0, None]}, {"k": 0.9}, {"c": [1.0, 1.2]}):
        with pytest.raises(ValueError, match="changes nothing here: forces are"):
            loads(table | idle, 0.05)
    usual = {"length": None, "k": 0.85, "c": [1.0, 1.0]}
    np.testing.assert_array_equal(loads(table | usual, 0.05).load, loads(table, 0.05).load)


def test_a_flag_is_true_or_false():
    """A large strain of 2 was counted twice."""
    found = loads(SAME | {"clearance": 0.05, "large_strain": [1, 2]}, 0.05)
    assert list(np.isnan(found.load)) == [False, True]
    assert found.reason[1] == "large_strain = 2 must be True or False"


def test_unknown_columns_and_lengths_are_refused():
    with pytest.raises(ValueError, match="gap: no parameter of a joint"):
        loads(SAME | {"clearance": 0.05, "gap": 1.0}, 0.05)
    with pytest.raises(ValueError, match="different lengths"):
        loads(SAME | {"clearance": [0.05, 0.06], "nu": [0.1, 0.2, 0.3]}, 0.05)


def test_joints_whose_forces_are_others_are_warned_of_once():
    """A small block makes a joint softer, a whole pin stiffer: a row keeps the law's force, and a
    warning tells by how much it is off."""
    table = SAME | {"clearance": 0.05, "block_size": [1000.0, 25.0, 30.0], "whole": [0, 0, True]}
    with pytest.warns(LawRangeWarning) as caught:
        found = loads(table, 0.08)
    said = [str(warning.message) for warning in caught]
    assert len(said) == 2
    assert said[0].startswith("joint 1: archord: is a law for a block of 100 R; in this one of 2.5")
    assert said[1].startswith("joint 2: archord: is a law for half a pin")
    assert not np.isnan(found.load).any()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        loads(SAME | {"clearance": 0.05, "block_size": [1000.0, np.nan]}, 0.08)
