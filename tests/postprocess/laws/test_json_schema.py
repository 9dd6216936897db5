"""The published schema of laws as JSON: it has the keys of the laws, and takes what is exported."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path

import pytest

from archord.postprocess.laws.exports.export import export_law
from archord.postprocess.laws.fitted_law import FittedLaw
from archord.postprocess.laws.general.joint_curve import JointCurve
from tests.postprocess.laws.test_element import FITTED, LAWS

SCHEMA = json.loads(
    (Path(__file__).parents[3] / "docs" / "law.schema.json").read_text(encoding="utf-8")
)
TARGET = Path("law.json")


def test_the_schema_names_all_keys_in_their_order() -> None:
    """With a description each."""
    kinds = SCHEMA["$defs"]
    assert [*kinds["table"]["properties"]] == [field.name for field in fields(JointCurve)]
    assert [*kinds["formula"]["properties"]] == [*FittedLaw.model_fields]
    for kind in kinds.values():
        assert all(key["description"] for key in kind["properties"].values())


@pytest.mark.parametrize("law", [*(make() for make in LAWS.values()), FITTED], ids=[*LAWS, "fit"])
def test_the_schema_takes_what_is_exported(law: JointCurve | FittedLaw) -> None:
    """And refuses a file without a column."""
    jsonschema = pytest.importorskip("jsonschema", reason="jsonschema is not here")
    check = jsonschema.Draft202012Validator(SCHEMA)
    check.check_schema(SCHEMA)
    told = json.loads(export_law(law, TARGET))
    assert [*check.iter_errors(told)] == []
    del told["k" if law is FITTED else "y"]
    assert not check.is_valid(told)
