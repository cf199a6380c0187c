# SPDX-License-Identifier: Apache-2.0
"""The guest's first and only file system: an archive that the kernel unpacks into memory, so that the guest never waits
for the host's disk. While it waits its virtual clock runs on (docs/vm.md)."""
import pathlib
import shutil
import stat

BUILD = pathlib.Path(__file__).resolve().parents[2] / "build/vm"
# What is loaded in the guest, each after all that its "depends=" names.
CAN_MODULES = ("can-dev", "can", "can-raw", "vcan", "can-gw")
DISK_MODULES = ("virtio_mmio", "virtio_blk")
CAMERA_MODULES = ("vivid",)


class Archive:
    """A cpio archive of the format newc, written as it grows; needs neither root nor a scratch folder."""

    def __init__(self, path):
        self.file = open(path, "wb")
        self.number = 0
        self.folders = set()

    def _entry(self, name, mode, size, device=(0, 0)):
        self.number += 1
        encoded = name.encode() + b"\0"
        fields = (self.number, mode, 0, 0, 1, 0, size, 0, 0, *device, len(encoded), 0)
        head = b"070701" + b"".join(b"%08x" % field for field in fields) + encoded
        self.file.write(head + b"\0" * (-len(head) % 4))

    def _parents(self, name):
        for parent in reversed(pathlib.PurePosixPath(name).parents):
            self.folder(str(parent))

    def folder(self, name):
        if name not in self.folders and name != ".":
            self.folders.add(name)
            self._entry(name, stat.S_IFDIR | 0o755, 0)

    def device(self, name, major, minor):
        self._parents(name)
        self._entry(name, stat.S_IFCHR | 0o600, 0, (major, minor))

    def text(self, name, text, executable=True):
        self._parents(name)
        data = text.encode()
        self._entry(name, stat.S_IFREG | (0o755 if executable else 0o644), len(data))
        self.file.write(data + b"\0" * (-len(data) % 4))

    def copy(self, name, source):
        self._parents(name)
        size = pathlib.Path(source).stat().st_size
        if size >= 1 << 32:
            raise SystemExit(f"vm: {source} has {size} bytes; a file of the guest's archive has less than 4 GiB")
        self._entry(name, stat.S_IFREG | 0o755, size)
        with open(source, "rb") as file:
            shutil.copyfileobj(file, self.file, 1 << 20)
        self.file.write(b"\0" * (-size % 4))

    def close(self):
        self._entry("TRAILER!!!", 0, 0)
        self.file.close()


def modules_by_name():
    """Every module of the package, by its name with underscores."""
    found = {path.stem.replace("-", "_"): path for path in (BUILD / "kernel/lib/modules").rglob("*.ko")}
    if not found:
        raise SystemExit("vm: the kernel package has no modules: remove build/vm/kernel and try again")
    return found


def depends_of(path):
    """The package ships no modules.dep; each module names what it needs."""
    for item in path.read_bytes().split(b"\0"):
        if item.startswith(b"depends="):
            return [name.replace("-", "_") for name in item[8:].decode().split(",") if name]
    return []


def in_order(names, builtin=()):
    """Paths of these modules and all they depend on, each after those."""
    known, order = modules_by_name(), []

    def add(name):
        if name in builtin:
            return
        if name not in known:
            raise SystemExit(f"vm: the kernel package has no module {name}")
        if known[name] not in order:
            for needed in depends_of(known[name]):
                add(needed)
            order.append(known[name])

    for name in names:
        add(name.replace("-", "_"))
    return order


def add_system(archive, init, camera=False):
    """busybox, candump with its C library, the modules and the script that the kernel starts."""
    tools = BUILD / "tools"
    archive.device("dev/console", 5, 1)
    archive.text("init", pathlib.Path(init).read_text())
    archive.copy("bin/busybox", tools / "bin/busybox")
    archive.copy("usr/bin/candump", tools / "usr/bin/candump")
    archive.copy("lib/ld-linux-aarch64.so.1", tools / "lib/aarch64-linux-gnu/ld-linux-aarch64.so.1")
    archive.copy("lib/aarch64-linux-gnu/libc.so.6", tools / "lib/aarch64-linux-gnu/libc.so.6")
    modules = in_order((*CAN_MODULES, *DISK_MODULES, *(CAMERA_MODULES if camera else ())))
    for number, path in enumerate(modules):
        archive.copy(f"modules/{number:02d}-{path.name}", path)
