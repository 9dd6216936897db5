"""Meshes kept for the next joint of the same shape, without gmsh and bound to no communicator."""

from __future__ import annotations

import copy
from collections import OrderedDict
from typing import Any


class Answers:
    """What a gmsh model answered to each question that dolfinx asked it, to be asked again when gmsh is gone.

    Answers are copied, as dolfinx works in some of the arrays. Knows nothing but what was asked while ``model`` was
    there, until `forget_model`.
    """

    def __init__(self, model: Any, _prefix: str = "", _known: dict[tuple, Any] | None = None) -> None:
        self._model, self._prefix = model, _prefix
        self._known: dict[tuple, Any] = {} if _known is None else _known

    @property
    def mesh(self) -> Answers:
        """The same for ``model.mesh``."""
        return Answers(None if self._model is None else self._model.mesh, "mesh.", self._known)

    def __getattr__(self, name: str) -> Any:
        """The method ``name`` of the model."""
        if name.startswith("__"):
            raise AttributeError(name)

        def ask(*arguments: Any, **named: Any) -> Any:
            question = (self._prefix + name, *map(int, arguments), *((k, int(v)) for k, v in sorted(named.items())))
            if question not in self._known:
                self._known[question] = getattr(self._model, name)(*arguments, **named)
            return copy.deepcopy(self._known[question])

        return ask

    def forget_model(self) -> None:
        """Answer from memory alone from now on."""
        self._model = None


class MeshCache:
    """The last meshes of this process, by what they were made from; ``capacity`` is how many it keeps.

    ``made`` and ``reused`` count the meshes that gmsh made and those that it did not have to.
    """

    def __init__(self, capacity: int = 0) -> None:
        self.capacity = capacity
        self.made = self.reused = 0
        self._kept: OrderedDict[tuple, Answers] = OrderedDict()

    def find(self, key: tuple) -> Answers | None:
        """The mesh that was made from ``key``; None if it is not kept."""
        if key not in self._kept:
            return None
        self.reused += 1
        self._kept.move_to_end(key)
        return self._kept[key]

    def keep(self, key: tuple, answers: Answers) -> None:
        """Keep a mesh just made from ``key``, and forget the one that was not used for longest."""
        self.made += 1
        answers.forget_model()
        self._kept[key] = answers
        while len(self._kept) > self.capacity:
            self._kept.popitem(last=False)

    def forget(self) -> None:
        """Keep none of the meshes any longer."""
        self._kept.clear()


MESHES = MeshCache()  # of this process; keeps none unless somebody gives it a capacity
