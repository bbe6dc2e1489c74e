"""What the command line asks JAX to keep."""

from pathlib import Path

from pipeline.compilation import FOLDER, SHORTEST, keep_compiled


def test_the_folder_is_in_the_users_cache():
    environment = {"XDG_CACHE_HOME": "/caches"}
    keep_compiled(environment)
    assert environment[FOLDER] == str(Path("/caches/flexdoce/jax"))
    assert float(environment[SHORTEST]) > 0


def test_without_one_it_is_below_home():
    environment: dict[str, str] = {}
    keep_compiled(environment)
    assert environment[FOLDER] == str(Path.home() / ".cache" / "flexdoce" / "jax")


def test_the_users_settings_go_first():
    for own in ("/mine", ""):
        environment = {FOLDER: own}
        keep_compiled(environment)
        assert environment == {FOLDER: own}
