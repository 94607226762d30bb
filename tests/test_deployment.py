"""Dockerfile and compose.yaml: valid, and what they call exists."""

from __future__ import annotations

import argparse
import json
import re
import shlex
import tomllib
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import yaml

from fieldcal.commands import serve
from fieldcal.commands.run_page import parse_address

ROOT = Path(__file__).parent.parent
COMPOSE: dict[str, Any] = yaml.safe_load((ROOT / "compose.yaml").read_text())
SERVICES: dict[str, Any] = COMPOSE["services"]


def instructions() -> list[tuple[str, str]]:
    """What the Dockerfile says, continued lines as one."""
    text = re.sub(r"\\\n", " ", (ROOT / "Dockerfile").read_text())
    lines = [line for line in text.splitlines() if line and line[0] != "#"]
    return [(line.split()[0], line.split(maxsplit=1)[1]) for line in lines]


def said(name: str) -> str:
    return next(rest for word, rest in instructions() if word == name)


def served(command: list[str]) -> argparse.Namespace:
    """What `fieldcal serve` understands of a command."""
    parser = argparse.ArgumentParser(exit_on_error=False)
    serve.add_arguments(parser)
    assert command[0] == "serve"
    return parser.parse_args(command[1:])


def test_the_image_installs_what_there_is_and_serves_where_it_says() -> None:
    words = [word for word, _ in instructions()]
    assert words[0] == "FROM" and words[-1] == "CMD"
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    install = said("RUN")
    extras = re.search(r"\.\[([\w,]+)\]", install)
    assert extras
    assert set(extras[1].split(",")) <= set(project["optional-dependencies"])
    named = re.search(r"-c (\S+)", install)
    assert named and (ROOT / named[1]).is_file()
    python = re.search(r"python:(\d+)\.(\d+)", said("FROM"))
    assert python and (int(python[1]), int(python[2])) >= (3, 11)
    assert f"useradd --create-home --uid 1000 {said('USER')}" in install
    assert json.loads(said("ENTRYPOINT")) == ["fieldcal"]
    args = served(json.loads(said("CMD")))
    assert parse_address(args.listen)[1] == int(said("EXPOSE"))
    assert str(args.folder) == said("VOLUME")


def test_the_service_of_compose_is_one_that_fieldcal_understands() -> None:
    service = SERVICES["service"]
    args = served(service["command"])
    host, port = parse_address(args.listen)
    assert host == "0.0.0.0"
    (published,) = service["ports"]
    assert published == f"127.0.0.1:{port}:{port}", "this computer alone by default"
    assert {f"localhost:{port}", f"127.0.0.1:{port}"} <= set(args.known_as)
    assert args.tokens.name in service["secrets"]
    url = service["environment"]["FIELDCAL_HISTORY"]
    store = SERVICES["store"]["environment"]
    user, database = store["POSTGRES_USER"], store["POSTGRES_DB"]
    assert url.startswith(f"postgresql://{user}:") and url.endswith(
        f"@store/{database}"
    )
    assert args.scheduler == f"tcp://scheduler:{SERVICES['scheduler']['command'][3]}"
    assert SERVICES["worker"]["command"][0] == args.scheduler
    volume, place = service["volumes"][0].split(":")
    assert (
        place == str(args.folder)
        and f"{volume}:{place}" in SERVICES["worker"]["volumes"]
    )


def test_compose_names_only_what_it_declares() -> None:
    for name, service in SERVICES.items():
        assert ("build" in service) != ("image" in service), name
        assert service.get("build", ".") == "."
        for volume in service.get("volumes", ()):
            assert volume.split(":")[0] in COMPOSE["volumes"]
        assert set(service.get("secrets", ())) <= set(COMPOSE["secrets"])
        assert set(service.get("depends_on", ())) <= set(SERVICES)
    waits = SERVICES["service"]["depends_on"]
    healthy = [n for n, w in waits.items() if w["condition"] == "service_healthy"]
    assert healthy and all("healthcheck" in SERVICES[name] for name in healthy)


@pytest.mark.parametrize("name", ["scheduler", "worker"])
def test_dask_has_the_commands_that_compose_calls(name: str) -> None:
    program, command = SERVICES[name]["entrypoint"]
    assert (program, command) == ("dask", name)
    cli = import_module(f"distributed.cli.dask_{name}").main
    known = {o for p in cli.params for o in (*p.opts, *p.secondary_opts)}
    given = {word for word in SERVICES[name]["command"] if word.startswith("--")}
    assert given and given <= known
    cli.make_context(name, list(SERVICES[name]["command"]))


def test_nothing_secret_goes_into_the_image_or_the_file() -> None:
    ignored = (ROOT / ".dockerignore").read_text().split()
    assert {".git", "tokens.txt", ".env"} <= set(ignored)
    text = (ROOT / "compose.yaml").read_text()
    assert all(m.startswith("${") for m in re.findall(r"PASSWORD: (\S+)", text))
    assert shlex.split(SERVICES["store"]["healthcheck"]["test"][1])[0] == "pg_isready"
