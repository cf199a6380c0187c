# SPDX-License-Identifier: Apache-2.0
"""Boots the guest and reads its console."""
import contextlib
import os
import pathlib
import selectors
import signal
import subprocess
import sys
import tarfile
import time

import initrd

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
DISK_BYTES = 1 << 28  # for what comes back; sparse
SKIP = 77


def command(archive, disk, memory_mb, cpus, semihosting):
    """Virtual time is exact: one nanosecond an instruction, and none while the host does something else. A file system
    of type tmpfs would hold no more than half of the memory."""
    return ["qemu-system-aarch64", "-machine", "virt,gic-version=3", "-cpu", "cortex-a76", "-m", str(memory_mb),
            "-smp", str(cpus), "-nographic", "-nodefaults", "-serial", "stdio", "-no-reboot",
            "-kernel", str(initrd.BUILD / "kernel/vmlinuz"), "-initrd", str(archive),
            "-append", "console=ttyAMA0 quiet panic=-1 nokaslr norandmaps rootfstype=ramfs rdinit=/init",
            "-drive", f"file={disk},format=raw,if=none,id=out", "-device", "virtio-blk-device,drive=out",
            "-icount", "shift=0,sleep=off", "-rtc", "clock=vm,base=2026-01-01", "-seed", "1",
            *(["-semihosting-config", "enable=on,userspace=on,target=native"] if semihosting else [])]


@contextlib.contextmanager
def started(words, folder):
    """The emulator's process, ended when the block is left, whatever the reason."""
    def stop(number, frame):
        sys.exit(128 + number)
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, stop)
    process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, cwd=folder)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def lines_of(process, limit_s, companion=None):
    """Lines of the console until the emulator ends; a TimeoutError when that takes longer than limit_s, a ChildProcessError when
    its companion, without which it may wait for ever, ends before it."""
    deadline, rest = time.monotonic() + limit_s, b""
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        while True:
            if not selector.select(min(1.0, max(0.0, deadline - time.monotonic()))):
                if time.monotonic() >= deadline:
                    raise TimeoutError
                if companion is not None and companion.poll() is not None:
                    raise ChildProcessError
                continue
            data = os.read(process.stdout.fileno(), 1 << 16)
            if not data:
                break
            *whole, rest = (rest + data).split(b"\n")
            for line in whole:
                yield line.decode(errors="replace").rstrip("\r")
    if rest:
        yield rest.decode(errors="replace")


def run(work, main, files, *, cpus=1, camera=False, limit_s=120, hold_back=None, disk_bytes=DISK_BYTES,
        more_mb=0, companion=None):
    """Boots, runs the shell script `main` with `files` ({name in /job: path}) beside it. Prints the console as it
    comes, but for lines that begin with hold_back. Returns it and leaves it in work/serial.log, and in work/out what the job
    left in /out. companion: a process of the host that the guest's programs talk to, by files in work that they may open
    (tests/vm/semihosting.hpp)."""
    work.mkdir(parents=True, exist_ok=True)
    archive_path, disk = work / "initrd.cpio", work / "disk.img"
    archive = initrd.Archive(archive_path)
    initrd.add_system(archive, HERE / "init", camera)
    archive.text("job/main", main)
    for name, path in files.items():
        archive.copy(f"job/{name}", path)
    archive.close()
    disk.unlink(missing_ok=True)
    with open(disk, "wb") as file:
        file.truncate(disk_bytes)
    # The archive is in memory twice while the kernel unpacks it.
    memory_mb = 256 + more_mb + 2 * archive_path.stat().st_size // 2**20
    console, stopped = [], None
    with open(work / "serial.log", "w") as log, started(command(archive_path, disk, memory_mb, cpus, companion is not None), work) as process:
        try:
            for line in lines_of(process, limit_s, companion):
                console.append(line)
                print(line, file=log, flush=True)
                if hold_back is None or not line.startswith(hold_back):
                    print(line, flush=True)
        except TimeoutError:
            stopped = f"vm: stopped at the limit of {limit_s} s of this host's time"
        except ChildProcessError:
            stopped = f"vm: stopped: {companion.args[0]} ended with {companion.returncode} while the guest ran"
        if stopped:
            console.append(stopped)
            print(stopped, file=log)
            print(stopped, flush=True)
    take_out(disk, work / "out")
    archive_path.unlink()
    disk.unlink()
    return console


def take_out(disk, folder):
    """What the guest wrote to the disk, a tar archive or nothing."""
    folder.mkdir(exist_ok=True)
    with contextlib.suppress(tarfile.ReadError), tarfile.open(disk, "r:") as archive:
        archive.extractall(folder)
