"""What the commands of laws share: files with laws, warnings, and bad input in a sentence."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from archord.commands.options import warn
from archord.report.errors import InputError

if TYPE_CHECKING:
    from archord.postprocess.laws.exports.contact import Contact
    from archord.postprocess.laws.fitted_law import FittedLaw
    from archord.postprocess.laws.general.joint_curve import JointCurve

Text = tuple[Path, Callable[[], str | bytes]]  # a file, and what makes its content


@contextmanager
def sentences() -> Iterator[None]:
    """Around formulas, whose ValueErrors are bad input here."""
    try:
        yield
    except ValueError as error:
        raise InputError(str(error)) from error


def exports_of(
    law: JointCurve | FittedLaw, targets: Iterable[Path], contact: Contact | None = None
) -> list[Text]:
    """The files ``targets`` with a law, for `write`; ``contact`` of its force element."""
    return [(target, partial(_exported, law, target, contact)) for target in targets]


def _exported(law: JointCurve | FittedLaw, target: Path, contact: Contact | None) -> str | bytes:
    """The content of the file ``target``. Raises `InputError` for a suffix of no language."""
    from archord.postprocess.laws.exports.export import FILE_FORMS, export_law
    from archord.postprocess.laws.exports.fmu import export_fmu

    known = [*FILE_FORMS, ".fmu", ".json"]
    if target.suffix not in known:
        raise InputError(target, f"must end in {', '.join(known[:-1])} or {known[-1]}.")
    if target.suffix == ".fmu":
        return export_fmu(law, target, contact)
    return export_law(law, target, contact)


def write(texts: list[Text], inputs: list[Path], force: bool) -> list[Path]:
    """Write the files that are named, and return them. Raises `InputError` before for one of the
    ``inputs`` among them, for two of one name, and, without ``force``, for files that are there."""
    from archord.output.user_file import check_target, writing

    targets = [target for target, _ in texts]
    for target in targets:
        check_target(target, inputs, force=force)
    if len({target.resolve() for target in targets}) < len(targets):
        raise InputError(targets[0], "is named for two files; choose different ones.")
    with warnings.catch_warnings(record=True, action="always", category=UserWarning) as caught:
        contents = [make() for _, make in texts]
    for target, content in zip(targets, contents, strict=True):
        with writing(target) as new:
            new.write_bytes(content.encode() if isinstance(content, str) else content)
    warn(*(str(warning.message) for warning in caught))
    return targets
