# SPDX-License-Identifier: Apache-2.0
"""The packaged daemon climbs in the emulated machine, in closed loop with a simulated robot (tests/vm/guest_plant.cpp):
toolchain/vm/run --daemon. The pictures are rendered on the host, while the guest's time stands still; what the daemon
recorded is replayed there afterwards, and what it says it commanded is compared with what the drives got."""
import contextlib
import os
import re
import shutil
import subprocess

import machine

PACKAGE = machine.ROOT / "build/package"
GUEST_PLANT = machine.ROOT / "build/orin/tests/vm/guest_plant"
INJECTED = machine.ROOT / "build/orin/firmware/daemon/polygmapd_inject"
RELEASE = machine.ROOT / "build/release"
OF_A_ROW = re.compile(r"(allocate|overrun=\w+)@[\d.]+")
MISSED = "the fault was never injected"  # what the guest's programs say of one whose time never came
BAD = ("flagged", "short_ones", "wrong_stamp", "missing", "timeouts")  # of what the camera's driver counts
TARGETS = ("orin:guest_plant", "orin:polygmapd_inject", "release:render_pictures", "release:recorded_frames", "release:polygmap_replay")
DRIVES = 12
PIPES = ("requests", "pictures")  # of the renderer, in the emulator's own folder
LATENCY_MS, EXPOSURE_MS = 22, 16  # of the camera; its stamp is that of the exposure's end, less the latency
DISK_BYTES = 1 << 31  # sparse
RECORDED_MB = 1500  # the guest's memory for what is recorded, 20 a second

CONFIG = r"""
cd / && ar x /job/package.deb && tar xzf data.tar.gz -C / && rm -f data.tar.gz control.tar.gz debian-binary
cd /etc/polygmap
sed 's/"can/"vcan/' /job/bus.toml >vm_bus.toml
printf '[gait.planner]\npattern = "{gait}"\n' >vm_params.toml
sed -e 's#/dev/polygmap/depth#/dev/video0#' -e 's/Z16/Y16/' -e 's/^frames_per_s/# &/' -e 's#cameras/d435#cameras/kuavo#' \
    -e 's/^latency_ms.*/latency_ms = {latency}/' -e 's/^exposure_ms.*/exposure_ms = {exposure}/' \
    -e 's#^bus = .*#bus = "vm_bus.toml"#' -e 's#^\# params = .*#params = "vm_params.toml"#' \
    -e 's/^sender = .*/sender = "127.0.0.1"/' -e 's/^least_delay_ms.*/least_delay_ms = 0.0/' -e 's/^hold_s.*/hold_s = 1.0/' -e '/^operator = /d' \
    -e 's/^cpu = 4/cpu = 0/' -e 's/^cpu = 5/cpu = {perception_cpu}/' polygmapd.toml >vm.toml
{one_lane}
cd /
"""
ONE_LANE = "sed -i -e 's/^lanes = 2/lanes = 1/' -e '/^\\[perception\\]/,/^$/d' vm.toml"

# Until the robot is on top, or the daemon has ended; then SIGTERM, as systemd would.
RUN = r"""
/job/guest_plant /etc/polygmap/vm_bus.toml {pipes} --seed {seed} --steps {steps} --latency {picture_latency} \
  --witness /out/frames.log --notify polygmap {inject} >/out/plant.txt 2>&1 & plant=$!
while ! grep -qs ready /out/plant.txt; do [ -d /proc/$plant ] || break; sleep 0.05; done
export NOTIFY_SOCKET=@polygmap WATCHDOG_USEC=400000
( sh -c 'echo $$ >/tmp/daemon; exec {daemon} --config /etc/polygmap/vm.toml --record /out/run.mcap' >/out/daemon.txt 2>&1; echo $? >/out/code ) & runs=$!
for i in $(seq {limit_tenths}); do
  [ -e /out/code ] && break
  grep -qs '^PLANT climbed' /out/plant.txt && sleep 1.5 && break
  sleep 0.1
done
kill -TERM $(cat /tmp/daemon) 2>/dev/null
wait $runs
kill -TERM $plant; wait $plant
grep -v '^TOLD' /out/plant.txt; cat /out/daemon.txt
"""


def say(text):
    print(text, flush=True)


@contextlib.contextmanager
def renderer(work, args):
    """The host's process that renders the guest's pictures; it is asked and answers by named pipes in work."""
    pipes = [work / name for name in PIPES]
    for pipe in pipes:
        os.mkfifo(pipe)
    process = subprocess.Popen([RELEASE / "tests/vm/render_pictures", str(args.seed), str(args.steps), *pipes])
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        for pipe in pipes:
            pipe.unlink()


def main_script(args):
    """In the guest. What a row does is injected by another build of the daemon, all else by the robot."""
    of_a_row = bool(args.inject and OF_A_ROW.fullmatch(args.inject))
    words = {"gait": args.gait, "latency": LATENCY_MS, "exposure": EXPOSURE_MS, "perception_cpu": args.cpus - 1,
             "one_lane": ONE_LANE if args.lanes == 1 else ""}
    run = {"pipes": " ".join(PIPES), "seed": args.seed, "steps": args.steps, "picture_latency": LATENCY_MS + EXPOSURE_MS // 2,
           "inject": f"--inject {args.inject}" if args.inject and not of_a_row else "",
           "daemon": "/job/polygmapd_inject" if of_a_row else "/usr/bin/polygmapd", "limit_tenths": 10 * (15 + 5 * args.steps)}
    return CONFIG.format(**words) + RUN.format(**run)


def numbers(pattern, text):
    """{key: value} of the last line that begins so."""
    lines = re.findall(rf"^{pattern} (.*)$", text, re.M)
    return dict(re.findall(r"(\w+)=([\w.-]+)", lines[-1])) if lines else {}


def missed_fault(said):
    return bool(re.search(f"^{MISSED}", said, re.M))


def replay(recording):
    done = subprocess.run([RELEASE / "polygmap_replay", recording], capture_output=True, text=True)
    found = re.search(r"^replay: (\d+) ticks, (\d+) differ$", done.stdout, re.M)
    if not found or int(found[2]):
        say("REPLAY " + (done.stdout + done.stderr).strip())
    return (int(found[1]), int(found[2])) if found else (0, -1)


def compare(out, bus):
    words = [RELEASE / "tests/vm/recorded_frames", out / "run.mcap", bus, out / "frames.log"]
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode:
        say((done.stdout + done.stderr).strip())
    return {key: int(value) for key, value in numbers("FRAMES", done.stdout).items()}


def judge(out, args):
    """What a run left in out: its figures, and whether it climbed without a flaw."""
    plant, daemon = ((out / name).read_text() if (out / name).exists() else "" for name in ("plant.txt", "daemon.txt"))
    robot, last, camera = numbers("PLANT(?= steps=)", plant), numbers("stopped", daemon), numbers("device camera", daemon)
    missed = missed_fault(plant + daemon)
    frames = compare(out, args.bus)
    ticks, differ = replay(out / "run.mcap")
    figures = {
        "steps": int(robot.get("steps", 0)), "state": last.get("state"), "phase": last.get("phase"), "reason": last.get("reason"),
        "support": robot.get("support"), "fell": robot.get("fell"), "exit": last.get("exit"), "down_s": robot.get("down_s"),
        "ticks": int(last.get("cycles", 0)),
        "overruns": sum(int(last.get(key, 1)) for key in ("overruns", "skipped", "caught_up")),
        "page_faults": int(last.get("page_faults", 1)), "heap_calls": int(last.get("heap_calls", 1)),
        "frames": frames.get("frames", 0), "frames_differ": frames.get("frames_differ", 1) + frames.get("missing", 0),
        "replayed": ticks, "ticks_differ": differ, "wake_max_us": last.get("wake_max_us"),
        "special": frames.get("special", 0), "pictures": frames.get("pictures", 0),
        "pictures_lost": frames.get("lost", 1) + sum(int(camera.get(key, 0)) for key in BAD),
        "fault": "none" if not args.inject else "missed" if missed else "injected"}
    flaws = ("overruns", "page_faults", "heap_calls", "frames_differ", "ticks_differ", "pictures_lost")
    good = (not missed and not any(figures[key] for key in flaws) and figures["steps"] == args.steps and figures["fell"] == "0"
            and figures["support"] == "both" and figures["frames"] > 0 and figures["pictures"] > 0
            and figures["special"] <= DRIVES * (2 if args.inject else 1)  # enters motor mode; once more after a silence
            and ticks == figures["ticks"] and figures["exit"] == "0")
    return figures, good


def told(out):
    """What the daemon told the service manager: (seconds since the drives had gains, text)."""
    robot = (out / "plant.txt").read_text() if (out / "plant.txt").exists() else ""
    found = re.findall(r"^TOLD (-?[\d.]+) (.*)$", robot, re.M)
    return [(float(since_s), text) for since_s, text in found]


def line_of(figures, good):
    return f"RESULT {'pass' if good else 'fail'} " + " ".join(f"{key}={value}" for key, value in figures.items())


def package():
    """The package's file, made anew."""
    if subprocess.run([machine.ROOT / "toolchain/package/package"]).returncode:
        raise SystemExit(1)
    return next(PACKAGE.glob("polygmap_*_arm64.deb"))


def boot(args, work, deb):
    """One climb in the guest; what it leaves is in work/out."""
    work.mkdir(parents=True, exist_ok=True)
    files = {"package.deb": deb, "guest_plant": GUEST_PLANT, "bus.toml": args.bus}
    if args.inject and OF_A_ROW.fullmatch(args.inject):
        (work / "injection").write_text(args.inject)
        files |= {"injection": work / "injection", "polygmapd_inject": INJECTED}
    with renderer(work, args) as process:
        machine.run(work, main_script(args), files, cpus=args.cpus, camera=True, limit_s=args.limit, disk_bytes=DISK_BYTES,
                    more_mb=RECORDED_MB, companion=process)


def climb(args, work, deb):
    boot(args, work, deb)
    figures, good = judge(work / "out", args)
    if args.keep:
        args.keep.mkdir(parents=True, exist_ok=True)
        shutil.copy(work / "serial.log", args.keep)
        shutil.copytree(work / "out", args.keep, dirs_exist_ok=True)
    say(line_of(figures, good))
    return 0 if good else 1
