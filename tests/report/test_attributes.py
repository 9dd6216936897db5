"""Objects in words: alike in every process, and others where anything of the object is another."""

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from archord.report.attributes import attributes_of


class Plain:
    """An object of the attributes that it is given."""

    def __init__(self, **attributes):
        vars(self).update(attributes)

    @cached_property
    def inverse(self):
        return 1 / self.k


class Slotted:
    """An object without a dictionary."""

    __slots__ = ("E",)

    def __init__(self, E):
        self.E = E


@dataclass(frozen=True)
class Holder:
    """An object that holds another one."""

    held: object


def curve(last):
    return PchipInterpolator([0.0, 1.0, 2.0], [0.0, 1.0, last])


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (lambda: Plain(k=1.0), lambda: Plain(k=1.0 + 1e-15)),
        (lambda: Plain(_k=1.0), lambda: Plain(_k=2.0)),
        (lambda: Slotted(1.0), lambda: Slotted(2.0)),
        (lambda: Holder(Plain(k=1.0)), lambda: Holder(Plain(k=2.0))),
        (lambda: Holder([Slotted(1.0)]), lambda: Holder([Slotted(2.0)])),
        (lambda: Holder({"a": Slotted(1.0)}), lambda: Holder({"a": Slotted(2.0)})),
        (lambda: Holder(np.arange(5000.0)), lambda: Holder(np.append(np.arange(4999.0), 0.0))),
        (lambda: Holder(list(range(999))), lambda: Holder([*range(998), 0])),
        (lambda: Holder(np.array([Plain(k=1)])), lambda: Holder(np.array([Plain(k=2)]))),
        (lambda: Holder(curve(2.0)), lambda: Holder(curve(3.0))),
        (lambda: Holder({1, 2}), lambda: Holder({1, 3})),
        (lambda: Plain(f=partial(max, 1)), lambda: Plain(f=partial(max, 2))),
    ],
)
def test_another_attribute_has_other_words(one, other):
    assert attributes_of(one()) == attributes_of(one())
    assert attributes_of(one()) != attributes_of(other())
    assert " at 0x" not in str(attributes_of(one()))


def test_what_is_cached_is_no_attribute():
    law = Plain(k=2.0)
    before = attributes_of(law)
    assert law.inverse == 0.5
    assert attributes_of(law) == before == {"k": "2.0"}


def test_numbers_of_numpy_are_told_as_numbers_of_python():
    assert attributes_of(Plain(k=np.float64(0.1))) == {"k": "0.1"}


def test_an_object_that_holds_itself_has_words():
    law = Plain(k=1.0)
    law.own = law
    assert attributes_of(law) == {"k": "1.0", "own": "itself"}


def test_words_are_short():
    assert all(len(words) < 200 for words in attributes_of(Holder(list(range(9999)))).values())
