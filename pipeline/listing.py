"""What ``flexdoce list`` prints: what is known by name, where it comes from, and what it can be told."""

from collections.abc import Mapping
from typing import Any

from rich.markup import escape

from experiments import oracles, settings
from experiments.oracles import plugins
from experiments.oracles.command import GROUP as PARSERS

from .console import console


def print_known(known: Mapping[str, Any], origins: Mapping[str, str] | None = None) -> None:
    """Classes by name with their settings, and where they come from if that is told."""
    for name, cls in known.items():
        origin = (origins or {}).get(name, "")
        beside = f"  [dim]({escape(origin)})[/dim]" if origin else ""
        _print(f"  [cyan]{escape(name)}[/cyan]  {escape(str(cls.summary))}{beside}")
        for row in settings.describe(cls):
            unit = f" {row['unit']}" if row["unit"] not in ("", "1") else ""
            console.print(
                f"      {row['name']} = {row['default']}{unit}  {row['about']}",
                style="dim", markup=False, emoji=False, soft_wrap=True,
            )  # fmt: skip


def print_oracles() -> None:
    """Built in, registered, offered by installed packages; broken ones last, with the reason. Imports all of them."""
    ours, theirs, broken = {}, {}, []
    for offer in oracles.offers():
        cls, flaw = plugins.tried(offer)
        if cls is None:
            broken.append((offer, flaw))
        else:
            theirs[offer.name] = cls
    for name in dict.fromkeys((*oracles.names(), *oracles.CONFIGURED)):
        if name not in {offer.name for offer in oracles.offers() if not offer.flaw}:
            ours[name] = oracles.oracle_class(name)
    everything = {**ours, **theirs}
    _print("[bold]oracles[/bold]")
    print_known(everything, {name: oracles.origin_of(name) for name in everything})
    for offer, flaw in broken:
        _print(
            f"  [red]{escape(offer.name)}[/red]  [red]broken[/red] [dim]({escape(offer.origin)})[/dim]: {escape(flaw)}"
        )
    _print('  [dim]… and any file: oracle = "path/to/file.py:name", see docs/add-an-oracle.md[/dim]')


def print_parsers() -> None:
    """Functions of installed packages that read what a program leaves."""
    _print("\n[bold]parsers[/bold]")
    found = plugins.offers(PARSERS)
    for offer in found:
        _print(f"  [cyan]{escape(offer.name)}[/cyan]  {escape(offer.value)}  [dim]({escape(offer.distribution)})[/dim]")
    if not found:
        _print("  [dim]none; see docs/command-oracle.md[/dim]")


def _print(text: str) -> None:
    console.print(text, emoji=False, soft_wrap=True)
