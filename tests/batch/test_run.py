"""Whole runs on real Dask workers over TCP: the same bytes whatever happens to the processes and the disk."""

import json
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from batches import WALKS, digests, good_row, long_row, read_mapping, walks, write_problems

from minsnap.batch.run import run_batch
from minsnap.errors import BatchError, FileError, InputError

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore::ResourceWarning"),  # Dask leaves sockets to the collector
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture(scope="module")
def there():
    """Address of a cluster of two workers with a thread each."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, protocol="tcp://", host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as cluster:
        assert cluster.scheduler_address.startswith("tcp://127.0.0.1:")
        yield cluster.scheduler_address


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A dataset by one worker, which every other run must repeat."""
    folder = tmp_path_factory.mktemp("whole") / "a"
    result = run_batch(walks(), folder, workers=1)
    assert (result.rows, result.shards, result.present, result.statuses) == (40, 5, 0, {"done": 40})
    return folder


def begin(folder, spec, *options, **more):
    """Start the command in a process group of its own, which a terminal's end reaches also where tests ignore it."""
    path = folder.parent / f"{folder.name}.yaml"
    path.write_text(json.dumps(spec))
    command = [sys.executable, "-m", "minsnap", "batch", str(path), "-o", str(folder), *options]
    how = {"preexec_fn": lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL)} | more
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True, **how)


def end_group(process):
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


def parts(folder):
    return sorted(path.name for path in folder.glob("part-*.parquet"))


def test_two_workers_write_the_bytes_of_one(whole, tmp_path):
    result = run_batch(walks(), tmp_path / "b", workers=2)
    assert digests(tmp_path / "b") == digests(whole) and len(digests(whole)) == 5
    assert (tmp_path / "b" / "_manifest.json").read_bytes() == (whole / "_manifest.json").read_bytes()
    assert result.statuses == {"done": 40} and not list((tmp_path / "b").glob(".*"))


def test_the_manifest_names_every_file(whole):
    manifest = json.loads((whole / "_manifest.json").read_text())
    assert {file["name"]: file["sha256"] for file in manifest["files"]} == digests(whole)
    assert sum(file["rows"] for file in manifest["files"]) == manifest["rows"] == 40


def test_pandas_reads_the_folder_with_its_datasheet(whole):
    import pandas

    rows = pandas.read_parquet(whole)
    assert rows.problem.tolist() == list(range(40)) and rows.certified.all()
    assert (whole / "_datasheet" / "README.md").exists() and (whole / "_datasheet" / "histograms.png").exists()


def test_a_complete_dataset_is_not_made_again(whole):
    before = {path: path.stat().st_mtime_ns for path in whole.iterdir()}
    result = run_batch(walks(), whole, workers=1)
    assert result.present == 5 and {path: path.stat().st_mtime_ns for path in whole.iterdir()} == before


def test_files_that_are_missing_or_were_half_written_are_made(whole, there, tmp_path):
    folder = tmp_path / "c"
    folder.mkdir()
    (folder / "_sha256").mkdir()
    for name in ("part-00001.parquet", "part-00003.parquet"):
        (folder / name).write_bytes((whole / name).read_bytes())
        (folder / f"_sha256/{name}.sha256").write_bytes((whole / f"_sha256/{name}.sha256").read_bytes())
    (folder / "_spec.json").write_bytes((whole / "_spec.json").read_bytes())
    for place in (folder, folder / "_sha256"):
        (place / ".0123456789abcdef.part").write_bytes(b"half")
    result = run_batch(walks(), folder, scheduler=there)
    assert result.present == 2 and digests(folder) == digests(whole) and not list(folder.rglob(".*.part"))


@pytest.mark.parametrize("manifest", ["kept", "missing", "damaged"])
def test_a_damaged_part_is_made_anew(whole, there, tmp_path, manifest):
    """A bit of one is flipped, another is cut off, and a third has lost its SHA-256 and the manifest."""
    folder = tmp_path / "k"
    shutil.copytree(whole, folder)
    flipped, cut = folder / "part-00001.parquet", folder / "part-00002.parquet"
    content = bytearray(flipped.read_bytes())
    content[len(content) // 2] ^= 1
    flipped.write_bytes(content)
    cut.write_bytes(cut.read_bytes()[:-9])
    if manifest != "kept":
        (folder / "_sha256" / "part-00004.parquet.sha256").unlink()
        (folder / "_manifest.json").unlink()
    if manifest == "damaged":
        (folder / "_manifest.json").write_text('{"files": [{"name": 3')
    result = run_batch(walks(), folder, scheduler=there)
    assert result.present == (3 if manifest == "kept" else 2) and digests(folder) == digests(whole)
    assert (folder / "_manifest.json").read_bytes() == (whole / "_manifest.json").read_bytes()


@pytest.mark.parametrize("text", ["{", "[]", "3", '{"name": 3}', '{"name": "x", "spec": [], "made_with": {}}'])
def test_a_damaged_specification_is_one_sentence(tmp_path, text):
    (tmp_path / "_spec.json").write_text(text)
    with pytest.raises(FileError, match=r"_spec\.json is damaged, .* give another folder"):
        run_batch(walks(), tmp_path)
    (tmp_path / "_spec.json").write_text("")  # as a run that was killed as it began leaves it, but without files
    (tmp_path / "part-00000.parquet").write_bytes(b"")
    with pytest.raises(FileError, match=r"_spec\.json is damaged"):
        run_batch(walks(), tmp_path)
    with pytest.raises(FileError, match="the folder of a dataset has no name"):
        run_batch(walks(), "")


def test_a_changed_clock_changes_no_byte(whole, there, tmp_path):
    """Times of files lie in the past or the future: what counts is their content."""
    folder = tmp_path / "l"
    shutil.copytree(whole, folder)
    for second, path in enumerate(sorted(folder.rglob("*"))):
        os.utime(path, (1e9 + second, 4e9 - 1e6 * second))
    (folder / "_manifest.json").unlink()
    result = run_batch(walks(), folder, scheduler=there)
    assert result.present == 5 and digests(folder) == digests(whole)


def test_another_specification_or_a_stranger_s_file_is_refused(whole, tmp_path):
    with pytest.raises(FileError, match=r"was begun with seed: 7, not 8: give another folder"):
        run_batch(walks(seed=8), whole)
    with pytest.raises(FileError, match="is not empty: give a new folder, or leave out --no-resume"):
        run_batch(walks(), whole, resume=False)
    (tmp_path / "x.parquet").write_bytes(b"")
    with pytest.raises(FileError, match=r"holds x\.parquet, which no batch has written"):
        run_batch(walks(), tmp_path)
    (whole / "part-00005.parquet").write_bytes((whole / "part-00000.parquet").read_bytes())
    with pytest.raises(FileError, match=r"holds part-00005\.parquet, which is no file of this batch: move it away"):
        run_batch(walks(), whole)
    (whole / "part-00005.parquet").rename(whole / "._part-00005.parquet")
    assert run_batch(walks(), whole).present == 5
    (whole / "._part-00005.parquet").unlink()
    for bad in ({"workers": 0}, {"workers": True}, {"problem_timeout": 0.0}, {"problem_timeout": float("nan")}):
        with pytest.raises(InputError):
            run_batch(walks(), tmp_path / "d", **bad)


def test_a_damaged_file_is_named_and_another_run_is_kept_out(whole, there, tmp_path):
    folder = tmp_path / "e"
    folder.mkdir()
    (folder / "_spec.json").write_bytes((whole / "_spec.json").read_bytes())
    (folder / "part-00002.parquet").write_bytes((whole / "part-00003.parquet").read_bytes())
    with pytest.raises(BatchError, match=r"part-00002\.parquet is not of this batch: move it away"):
        run_batch(walks(), folder, scheduler=there)
    import fcntl

    with open(whole / "_spec.json", "r+b") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with pytest.raises(BatchError, match="another run writes into"):
            run_batch(walks(), whole)


def test_poisoned_problems_cost_one_row_each(there, tmp_path):
    rows = [good_row(seed) for seed in range(8)]
    rows[1]["waypoints"][1][2] = float("nan")
    rows[4] = good_row(4, 1) | {"start": {"velocity": [0.0, 40.0, 0.0]}, "corridor": 0.01}
    rows[6] = long_row()
    write_problems(tmp_path / "p.csv", rows)
    spec = read_mapping({"table": str(tmp_path / "p.csv"), "shard_rows": 4})
    counted = []
    result = run_batch(
        *(spec, tmp_path / "f"),
        scheduler=there,
        problem_timeout=3.0,
        watch=lambda found: counted.append(found) or counted.append,
    )
    assert result.statuses == {"done": 5, "invalid": 1, "infeasible": 1, "timeout": 1}
    assert counted[0] == 0 and sum(sum(more.values()) for more in counted[1:]) == 8
    sheet = (tmp_path / "f" / "_datasheet" / "README.md").read_text()
    assert "| timeout | 1 |" in sheet and "| planned | 5 |" in sheet


def test_a_cluster_at_an_address_and_none_there(whole, there, tmp_path):
    run_batch(walks(), tmp_path / "g", scheduler=there)
    assert digests(tmp_path / "g") == digests(whole)
    with pytest.raises(BatchError, match=r"there is no scheduler at tcp://127\.0\.0\.1:1: .*goes on from there"):
        run_batch(walks(), tmp_path / "h", scheduler="tcp://127.0.0.1:1")


@pytest.mark.parametrize("address", ["foo", "", "tcp://", "tcp://host:x", "http://host:8786"])
def test_what_is_no_address_is_refused_at_once_without_a_client(tmp_path, monkeypatch, address):
    monkeypatch.delattr("distributed.Client")
    with pytest.raises(BatchError, match=f"there is no scheduler at {address}: .*goes on from there"):
        run_batch(walks(), tmp_path / "h", scheduler=address)


def test_kill_9_of_the_whole_group_loses_no_finished_file(whole, there, tmp_path):
    folder = tmp_path / "i"
    process = begin(folder, WALKS, "--workers", "2")
    while not parts(folder) and process.poll() is None:
        time.sleep(0.01)
    end_group(process)
    kept = digests(folder)
    assert kept and kept.items() <= digests(whole).items() and not (folder / "_manifest.json").exists()
    result = run_batch(walks(), folder, scheduler=there)
    assert result.present == len(kept) and digests(folder) == digests(whole)


def sentences(told):
    """Lines but for the pace, which a slow machine tells every 30 s, and those in brackets."""
    return [line for line in told.splitlines() if not re.match(r"\[|about |\d+ of \d+ problems", line)]


def test_a_disk_that_is_full_ends_with_a_sentence_and_a_folder_that_goes_on(whole, there, tmp_path):
    folder = tmp_path / "j"
    limit = sorted(path.stat().st_size for path in whole.glob("*.parquet"))[-2] + 1  # all files fit but the largest
    process = begin(
        *(folder, WALKS, "--workers", "1"),
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )
    _, said = process.communicate()
    said = sentences(said)
    assert process.returncode == 1 and len(said) == 1
    assert "cannot be written: File too large" in said[0] and "of 5 files are finished, and the same" in said[0]
    assert not list(folder.rglob(".*.part"))
    assert run_batch(walks(), folder, scheduler=there).shards == 5 and digests(folder) == digests(whole)


def test_a_small_disk(whole, there, tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=36k", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("this user may not mount a small disk")
    try:
        with pytest.raises(BatchError, match="No space left on device; . of 5 files are finished"):
            run_batch(walks(), disk / "k", scheduler=there)
        assert len(parts(disk / "k")) < 5
        subprocess.run(["mount", "-o", "remount,size=16m", str(disk)], check=True)
        run_batch(walks(), disk / "k", scheduler=there)
        assert digests(disk / "k") == digests(whole)
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def victims(process, name):
    """Return the processes of a run whose command line holds a name."""
    try:
        below = psutil.Process(process.pid).children(recursive=True)
        return [one for one in below if name in " ".join(one.cmdline())]
    except psutil.Error:
        return []


def test_three_kills_at_random_moments_change_no_byte(tmp_path):
    spec = WALKS | {"count": 600, "shard_rows": 20}
    reference, folder, dice, kills = tmp_path / "l", tmp_path / "m", random.Random(5), 0
    run_batch(read_mapping(spec), reference, workers=2)
    while kills < 3:
        process = begin(folder, spec, "--workers", "2")
        while process.poll() is None and kills < 3:
            time.sleep(dice.uniform(0.1, 0.8))
            kind = dice.choice(["solver_process", "spawn_main", "spawn_main", "group"])
            chosen = victims(process, kind)
            if kind == "group" and parts(folder):
                end_group(process)
                kills += 1
            elif chosen:
                dice.choice(chosen).kill()
                kills += 1
        if not process.stderr.closed:
            process.communicate()
        if (folder / "_manifest.json").exists():
            for path in folder.glob("part-*1.parquet"):
                path.unlink()
    run_batch(read_mapping(spec), folder, workers=2)
    assert digests(folder) == digests(reference) and len(digests(folder)) == 30


def test_the_command_says_what_it_wrote(tmp_path):
    path = tmp_path / "s.yaml"
    path.write_text("{generator: walks, count: 6, legs: [2, 3], shard_rows: 3}")
    command = [sys.executable, "-m", "minsnap", "batch", str(path), "-o", str(tmp_path / "n"), "--workers", "1"]
    done = subprocess.run(command, capture_output=True, text=True)
    progress = done.stderr.splitlines()  # a line every half a minute, on a busy machine
    told = re.compile(r"about .* for 6 problems|\d of 6 problems")
    assert done.returncode == 0 and all(map(told.match, progress))
    assert done.stdout == f"{tmp_path / 'n'}: 6 problems in 2 files: 6 done\n"
    again = subprocess.run(command, capture_output=True, text=True)
    assert again.stdout == f"{tmp_path / 'n'}: 6 problems in 2 files (2 were there already): 6 done\n"
    path.write_text("{generator: walks, count: 7, legs: [2, 3], shard_rows: 3}")
    refused = subprocess.run(command, capture_output=True, text=True)
    assert refused.returncode == 2 and "was begun with count: 6, not 7" in refused.stderr
    assert Path(tmp_path / "n").is_dir()


@pytest.mark.parametrize("marks", [("_spec.json",), ("_spec.json", "part-00000.parquet")], ids=["starting", "at work"])
@pytest.mark.parametrize(
    ("send", "number", "status"),
    [(os.killpg, signal.SIGINT, 130), (os.kill, signal.SIGTERM, 143), (os.killpg, signal.SIGHUP, 129)],
    ids=["Ctrl-C", "SIGTERM", "SIGHUP"],
)
def test_a_run_that_is_ended_says_one_sentence_and_leaves_nothing_unfinished(tmp_path, marks, send, number, status):
    """Workers had Ctrl-C too, and told it in tracebacks, as did a cluster that was ended while it began."""
    folder, scratch = tmp_path / "a", tmp_path / "scratch"
    scratch.mkdir()
    spec, where = WALKS | {"count": 20000, "shard_rows": 50}, os.environ | {"TMPDIR": str(scratch)}
    run = begin(folder, spec, "--workers", "2", env=where)
    while not all((folder / mark).exists() for mark in marks):
        assert run.poll() is None, run.communicate()
        time.sleep(0.1)
    time.sleep(0.5)
    send(run.pid, number)
    _, told = run.communicate(timeout=120)
    assert sentences(told) == ["minsnap: interrupted: finished files are kept, and the same command goes on from there"]
    assert run.returncode == status and not list(folder.rglob(".*.part")) and not list(scratch.glob("minsnap*"))
