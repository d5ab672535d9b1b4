"""The pages on the file formats name every key, and what they show as examples is accepted."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from levelone.config.quantities import Quantity
from levelone.config.rotor_csv import COLUMNS
from levelone.config.schema import Strict
from levelone.config.study_file import load_study
from levelone.config.study_schema import StudyFile
from levelone.config.units import KNOWN
from levelone.config.vehicle_file import library, load_vehicle
from levelone.config.vehicle_schema import VehicleFile
from levelone.uncertainty import DISTRIBUTIONS
from levelone.vehicle import TARGETS

ROOT = Path(__file__).parents[2]
PAGES = {
    name: (ROOT / "docs" / "reference" / f"{name}.md").read_text(encoding="utf-8")
    for name in ("vehicle-file", "study-file", "command")
}


def tables_in(annotation):
    if isinstance(annotation, type) and issubclass(annotation, Strict):
        yield annotation
    for part in getattr(annotation, "__args__", ()):
        yield from tables_in(part)


def keys_of(model):
    for name, field in model.model_fields.items():
        yield name
        for part in tables_in(field.annotation):
            if part is not Quantity:
                yield from keys_of(part)


@pytest.mark.parametrize(("page", "model"), [("vehicle-file", VehicleFile), ("study-file", StudyFile)])
def test_every_key_is_named(page, model):
    words = set(re.findall(r"[A-Za-z_0-9]+", PAGES[page]))
    assert sorted(set(keys_of(model)) - words) == []


def test_every_unit_column_target_and_distribution_is_named():
    assert [column for column in COLUMNS if f"`{column}`" not in PAGES["vehicle-file"]] == []
    named = set(re.findall(r"[A-Za-z]+", PAGES["vehicle-file"]))
    assert [unit for unit in KNOWN if unit not in named | {"1", "cm", "mm", "kg", "ms", "mN", "kN"}] == []
    assert [name for name in DISTRIBUTIONS if f"`{name}`" not in PAGES["study-file"]] == []
    aerodynamic = re.compile(r"C_")
    assert [name for name in TARGETS if not aerodynamic.match(name) and f"`{name}`" not in PAGES["study-file"]] == []


def examples(page: str) -> list[str]:
    found = re.findall(r"```toml\n(.*?)```", PAGES[page], flags=re.DOTALL)
    assert found
    return found


@pytest.mark.parametrize("example", examples("vehicle-file"))
def test_examples_of_the_vehicle_page_load(vehicle_file, example):
    """Each example replaces what the reference vehicle says about the same keys."""
    text = library()["reference-evtol"].read_text(encoding="utf-8")
    given = tomllib.loads(example)
    if "mass" in given:
        path = vehicle_file((re.compile(r"\[mass\].*?(?=\n\[)", re.DOTALL), example))
        assert load_vehicle(path).airframe.mass.I_xx == pytest.approx(given["mass"]["I_xx"]["value"] * 1e-4, rel=1e-12)
    elif "sensors" in given:
        path = vehicle_file(("[validity]", example + "\n[validity]"))
        assert load_vehicle(path).sensors.delay.sum() == 2
    else:
        old = [(re.compile(rf"^{name} = .*$", re.MULTILINE), "#") for name in given if f"\n{name} = " in text]
        path = vehicle_file(*old, ("C_L0 = {", example + "\nC_L0 = {"))
        values = given["C_mq"]["value"]
        assert [load_vehicle(path).airframe.aerodynamics.value("C_mq", v) for v in given["airspeed"]["value"]] == pytest.approx(
            values
        )


@pytest.mark.parametrize("example", examples("study-file"))
def test_examples_of_the_study_page_load(study_file, example):
    given = tomllib.loads(example)["factor"][0]
    study = load_study(study_file((re.compile(r"\[\[factor\]\]\nname = \"M\".*?(?=\n\[\[)", re.DOTALL), example)))
    assert study.space.names[0] == given["name"]
    assert study.space.factors[0].distribution.support == (given["low"] / 1000, given["high"] / 1000)


def test_the_command_page_names_every_command_and_option():
    import typer

    from levelone.cli import app

    missing = []
    for name, command in typer.main.get_command(app).commands.items():
        section = PAGES["command"].partition(f"## levelone {name} ")[2].partition("\n## ")[0]
        assert section, name
        parts = getattr(command, "commands", {"": command})
        missing += [part for part in parts if f"levelone {name} {part}" not in section and part]
        options = [option for part in parts.values() for parameter in part.params for option in parameter.opts]
        missing += [option for option in options if option.startswith("--") and option not in section]
    assert missing == []
