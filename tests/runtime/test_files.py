"""Files survive whatever happens to the process and the disk."""

import errno
import json
import os
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from yaml import safe_load

from chefbot.config import ConfigError
from chefbot.maths.grid import Grid
from chefbot.storage import atomic_files
from chefbot.storage.atomic_files import StorageError, write_atomic
from chefbot.storage.map_files import load_map, map_png, save_map

CALLS = ("open", "write", "fsync", "close", "replace", "unlink")


def a_map(seed, shape=(4, 7)):
    cells = np.random.default_rng(seed).choice(np.array([-1, 0, 100], np.int8), size=shape)
    return Grid(cells, 0.05 * (seed + 1), -1.5 * seed, 0.25)


def same(one, other):
    return (
        np.array_equal(one.cells, other.cells)
        and one.resolution == other.resolution
        and (one.origin_x, one.origin_y) == (other.origin_x, other.origin_y)
    )


class Killed(BaseException):
    """The process is gone; nothing that it would do afterwards happens."""


class FaultyOs:
    """`os`, of which the n-th change to the disk fails, or kills the process so that none follows."""

    def __init__(self, n, error):
        self._n, self._error, self.calls = n, error, 0

    def __getattr__(self, name):
        real = getattr(os, name)
        return self._guard(real) if name in CALLS else real

    def _guard(self, real):
        def call(*args):
            self.calls += 1
            if self.calls == self._n or (self._error is Killed and self.calls > self._n):
                raise self._error
            return real(*args)

        return call


def faulty(monkeypatch, n, error):
    system = FaultyOs(n, error)
    monkeypatch.setattr(atomic_files, "os", system)
    monkeypatch.setattr(Path, "unlink", lambda self, missing_ok=False: unlink(system, self, missing_ok))
    return system


def unlink(system, path, missing_ok):
    if missing_ok and not path.exists():
        return
    system.unlink(path)


def calls_of(monkeypatch, work):
    with monkeypatch.context() as patch:
        system = faulty(patch, 0, OSError(errno.EIO, "never"))
        work()
    return system.calls


def test_write_atomic_follows_links_and_keeps_permissions(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "real")
    write_atomic(tmp_path / "link", b"one")
    write_atomic(tmp_path / "link", b"two" * 100_000)
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_bytes() == b"two" * 100_000
    umask = os.umask(0)
    os.umask(umask)
    assert stat.S_IMODE((tmp_path / "real").stat().st_mode) == 0o666 & ~umask
    assert sorted(p.name for p in tmp_path.iterdir()) == ["link", "real"]


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), Killed])
def test_failed_write_atomic_leaves_the_old_or_the_new_file(tmp_path, monkeypatch, error):
    path = tmp_path / "file"
    write_atomic(path, b"old")
    count = calls_of(monkeypatch, lambda: write_atomic(path, b"old"))
    assert count >= 6
    for n in range(1, count + 1):
        write_atomic(path, b"old")
        with monkeypatch.context() as patch:
            faulty(patch, n, error)
            with pytest.raises(Killed if error is Killed else StorageError) as caught:
                write_atomic(path, b"new")
        assert path.read_bytes() in (b"old", b"new")
        if error is not Killed:
            assert "No space left on device" in str(caught.value)
            assert [p.name for p in tmp_path.iterdir()] == ["file"], "no litter"
            if n <= 3:
                assert path.read_bytes() == b"old"


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), Killed])
def test_failed_save_map_leaves_the_old_or_the_new_map(tmp_path, monkeypatch, error):
    old, new, other = a_map(0), a_map(1), a_map(2, (5, 3))
    count = calls_of(monkeypatch, lambda: save_map(tmp_path / "hotel", old))
    seen = []
    for n in range(1, count + 1):
        yaml = save_map(tmp_path / "hotel", old)
        with monkeypatch.context() as patch:
            faulty(patch, n, error)
            try:
                save_map(tmp_path / "hotel", new)
            except (StorageError, Killed):
                pass
            else:
                assert error is not Killed, "what was called before is called again"
        loaded = load_map(yaml)
        seen.append(same(loaded, new))
        assert same(loaded, old) or same(loaded, new)
        if error is not Killed:
            assert not list(tmp_path.glob(".*")), "no temporary file stays"
        save_map(tmp_path / "hotel", other)
        assert same(load_map(yaml), other), "the next save works after any accident"
        assert sorted(p.name for p in tmp_path.iterdir() if p.suffix != ".tmp") == ["hotel.pgm", "hotel.yaml"]
    assert not seen[0] and seen[-1] and seen == sorted(seen), (
        "first always the old one, then always the new one"
    )


@pytest.mark.slow
def test_a_killed_process_leaves_a_complete_map(tmp_path):
    """A real process ends by the system's hand, at every call that changes the disk."""
    script = """
import json, os, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import test_files as t
from chefbot.storage.map_files import load_map, save_map
folder, results = Path(sys.argv[2]), []
for n in range(1, 60):
    save_map(folder / "m", t.a_map(0))
    child = os.fork()
    if child == 0:
        def die(real, count=[0]):
            def call(*args):
                count[0] += 1
                if count[0] == n:
                    os._exit(7)
                return real(*args)
            return call
        for name in ("open", "write", "fsync", "replace"):
            setattr(os, name, die(getattr(os, name), die.__defaults__[0]))
        save_map(folder / "m", t.a_map(1))
        os._exit(0)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code == 0:
        break
    loaded = load_map(folder / "m.yaml")
    results.append([code, t.same(loaded, t.a_map(0)), t.same(loaded, t.a_map(1))])
print(json.dumps(results))
"""
    done = subprocess.run(
        [sys.executable, "-c", script, str(Path(__file__).parent), str(tmp_path)],
        capture_output=True,
        text=True,
        check=True,
    )
    results = json.loads(done.stdout)
    assert len(results) > 15
    assert all(code == 7 and old != new for code, old, new in results)


def test_special_files_are_written_in_place(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_atomic(pipe, b"through")
    assert os.read(reader, 100) == b"through"
    os.close(reader)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    with pytest.raises(StorageError, match="No space left on device"):
        write_atomic(Path("/dev/full"), b"x")
    assert stat.S_ISCHR(Path("/dev/full").stat().st_mode)
    with pytest.raises(StorageError, match="Is a directory"):
        write_atomic(tmp_path, b"x")


def test_a_full_disk_leaves_the_old_map(tmp_path):
    """The system's own limit on a file's size, met in the middle of the picture."""
    old = a_map(3)
    yaml = save_map(tmp_path / "m", old)
    script = """
import resource, signal, sys
import numpy as np
from pathlib import Path
from chefbot.storage.atomic_files import StorageError
from chefbot.maths.grid import Grid
from chefbot.storage.map_files import save_map
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
try:
    save_map(Path(sys.argv[1]), Grid(np.zeros((300, 300), np.int8), 0.05, 0.0, 0.0))
except StorageError as error:
    print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "m")], capture_output=True, text=True, check=True
    )
    assert "File too large" in done.stdout
    assert same(load_map(yaml), old)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["m.pgm", "m.yaml"]


def test_map_names_give_the_file_names(tmp_path):
    grid = a_map(4)
    assert save_map(tmp_path, grid) == tmp_path / "map.yaml"
    assert save_map(tmp_path / "floor.2", grid) == tmp_path / "floor.2.yaml"
    assert save_map(tmp_path / "b.yaml", grid) == tmp_path / "b.yaml"
    assert b"image: floor.2.pgm\n" in (tmp_path / "floor.2.yaml").read_bytes()
    names = {"map.pgm", "map.yaml", "floor.2.pgm", "floor.2.yaml", "b.pgm", "b.yaml"}
    assert {p.name for p in tmp_path.iterdir()} == names
    assert same(load_map(tmp_path / "b.yaml"), grid)


def test_raw_mode_keeps_percentages(tmp_path):
    grid = Grid(np.arange(-1, 101, dtype=np.int8).reshape(6, 17), 0.05, 0.0, 0.0)
    assert same(load_map(save_map(tmp_path / "m", grid, "raw")), grid)


def test_a_foreign_picture_beside_the_map_is_kept(tmp_path):
    for name in ("m.old.pgm", "m.0123456789abcdef0.pgm", "n.0123456789abcdef.pgm"):
        (tmp_path / name).write_bytes(b"mine")
    save_map(tmp_path / "m", a_map(1))
    assert len(list(tmp_path.iterdir())) == 5


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("missing.yaml", "does not exist"),
        (".", "cannot be read"),
        ("no_picture.yaml", "does not exist"),
        ("folder_as_picture.yaml", "is not a file"),
        ("pipe_as_picture.yaml", "is not a file"),
        ("huge.yaml", "longer"),
    ],
)
def test_a_missing_map_is_reported_in_one_sentence(tmp_path, name, reason):
    save_map(tmp_path / "m", a_map(0))
    text = (tmp_path / "m.yaml").read_text()
    os.mkfifo(tmp_path / "pipe")
    for image in ("no_picture", "folder_as_picture", "pipe_as_picture"):
        target = {"no_picture": "nothing.pgm", "folder_as_picture": "..", "pipe_as_picture": "pipe"}[image]
        (tmp_path / f"{image}.yaml").write_text(text.replace("m.pgm", target))
    (tmp_path / "huge.yaml").write_bytes(b"#" * 200_000)
    with pytest.raises(ConfigError, match=reason):
        load_map(tmp_path / name)


@pytest.mark.parametrize("name", ["no/such/folder/m", "file/m", "a\0b", "loop/m"])
def test_an_unwritable_folder_is_reported_in_one_sentence(tmp_path, name):
    (tmp_path / "file").write_bytes(b"")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(StorageError, match="cannot be written"):
        save_map(tmp_path / name, a_map(0))
    with pytest.raises(StorageError, match="cannot be written"):
        write_atomic(tmp_path / name, b"x")


def test_picture_of_a_map_has_the_right_pixels(tmp_path):
    (tmp_path / "m.png").write_bytes(map_png(Grid(np.array([[0, 100], [-1, 50]], np.int8), 0.1, 0, 0)))
    with Image.open(tmp_path / "m.png") as image:
        assert np.asarray(image).tolist() == [[205, 127], [254, 0]]


@settings(max_examples=60)
@given(st.integers(0, 10_000), st.binary(max_size=4), st.booleans())
def test_one_flipped_bit_on_disk_is_found(tmp_path_factory, place, junk, in_yaml):
    folder = tmp_path_factory.mktemp("maps")
    grid = a_map(1)
    yaml = save_map(folder / "m", grid)
    damaged = yaml if in_yaml else folder / "m.pgm"
    data = damaged.read_bytes()
    place %= len(data)
    data = data[:place] + junk + data[place + len(junk) :]
    damaged.write_bytes(data)
    try:
        loaded = load_map(yaml)
    except ConfigError:
        return
    if not in_yaml:
        assert same(loaded, grid), "a changed picture is refused"
        return
    # A changed YAML file may declare another frame, but the verified picture gives the cells.
    declared = safe_load(data)
    assert loaded.cells.shape == grid.cells.shape
    assert loaded.resolution == float(declared["resolution"])
    assert (loaded.origin_x, loaded.origin_y) == tuple(map(float, declared["origin"][:2]))


def test_a_map_whose_picture_is_gone_names_file_and_key(tmp_path):
    save_map(tmp_path / "m.yaml", a_map(1))
    (tmp_path / "m.pgm").unlink()
    with pytest.raises(ConfigError, match=r"map file .*m\.yaml: image: .*m\.pgm does not exist"):
        load_map(tmp_path / "m.yaml")
