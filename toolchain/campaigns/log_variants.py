# SPDX-License-Identifier: Apache-2.0
"""A log of `polygmap estimate` as it might have been: fewer rows, a foot that slips, samples and contacts out of time, an IMU
that is off. The truth stays. A log is a dict of columns, name -> numbers, as its header names them."""
import bisect
import csv
import math

FEET = ("left", "right")
AXES = "xyz"
GYRO, ACCEL = ([f"{sensor}_{axis}_{unit}" for axis in AXES] for sensor, unit in (("gyro", "radps"), ("accel", "mps2")))
TRUE_ATTITUDE = [f"truth_q{part}" for part in "wxyz"]
SLIP_MPS, SLIP_S = 0.3, 0.2
PIVOT_RAD = math.radians(5)


def read(path):
    with open(path, encoding="utf-8-sig", newline="") as file:
        header, *lines = csv.reader(file)
    return {name.strip(): [float(line[i]) for line in lines if line] for i, name in enumerate(header)}


def write(path, log):
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(log)
        writer.writerows(zip(*(map(repr, values) for values in log.values())))


def product(p, q):
    """Of quaternions w, x, y, z."""
    return (p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3], p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
            p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1], p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0])


def turned(q, v):
    return product(product(q, (0.0, *v)), (q[0], -q[1], -q[2], -q[3]))[1:]


def yaw_of(q):
    return math.atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] ** 2 + q[3] ** 2))


def rows_of(log, names):
    return list(zip(*(log[name] for name in names)))


def with_rows(log, names, rows):
    """The log with these columns instead of its own."""
    return {**log, **dict(zip(names, map(list, zip(*rows))))}


def thinned(log, every):
    return {name: values[::every] for name, values in log.items()}


def begun_on_one_foot(log):
    """From the first row on, of its second half, at which one foot stands."""
    left, right = (log[f"{foot}_contact"] for foot in FEET)
    at = next((i for i in range(len(left) // 2, len(left)) if (left[i] >= 0.5) != (right[i] >= 0.5)), None)
    if at is None:
        raise ValueError("it has no foot that stands alone")
    return {name: values[at:] for name, values in log.items()}


def imu_late(log, late_s):
    """The samples are of so much earlier than their rows say, interpolated."""
    times = log["t_s"]

    def earlier(values):
        for t in times:
            i = max(bisect.bisect_left(times, t - late_s), 1)
            share = max((t - late_s - times[i - 1]) / (times[i] - times[i - 1]), 0.0)
            yield values[i - 1] + share * (values[i] - values[i - 1])
    return {**log, **{name: list(earlier(log[name])) for name in (*GYRO, *ACCEL)}}


def contacts_late(log, late_s):
    """Early where late_s is negative."""
    times = log["t_s"]
    at = [max(bisect.bisect_right(times, t - late_s + 1e-9) - 1, 0) for t in times]
    return {**log, **{f"{foot}_contact": [log[f"{foot}_contact"][i] for i in at] for foot in FEET}}


def accel_scaled(log, scale):
    return {**log, **{name: [scale * value for value in log[name]] for name in ACCEL}}


def imu_tilted(log, angle_rad):
    """The IMU is mounted off by a turn about the base's y axis."""
    q = (math.cos(angle_rad / 2), 0.0, math.sin(angle_rad / 2), 0.0)
    for sensor in (GYRO, ACCEL):
        log = with_rows(log, sensor, [turned(q, v) for v in rows_of(log, sensor)])
    return log


def stances(log, foot):
    """(first row, row after the last) of each time that the foot stands."""
    stands = [False, *(contact >= 0.5 for contact in log[f"{foot}_contact"]), False]
    changes = [i for i, (before, now) in enumerate(zip(stands, stands[1:])) if before != now]
    return list(zip(changes[::2], changes[1::2]))


def middle_stance(log):
    """(foot, first row, row after the last, start of what happens in its middle): of a whole step where there is one that is
    long enough, as near to the log's middle as can be."""
    times = log["t_s"]

    def mid_s(first, end):
        return (times[first] + times[end - 1]) / 2
    long_enough = [(foot, first, end) for foot in FEET for first, end in stances(log, foot)
                   if times[end - 1] - times[first] > 1.5 * SLIP_S]
    if not long_enough:
        raise ValueError("no foot stands long enough")
    foot, first, end = min(long_enough, key=lambda s: (s[1] == 0 or s[2] == len(times), abs(mid_s(*s[1:]) - mid_s(0, len(times)))))
    return foot, first, end, mid_s(first, end) - SLIP_S / 2


def share_done(times, first, end, start_s):
    """Of what happens in SLIP_S from start_s on, row by row; it stays until the foot is lifted."""
    return [min(max((t - start_s) / SLIP_S, 0.0), 1.0) if first <= i < end else 0.0 for i, t in enumerate(times)]


def foot_slips(log):
    """A foot that stands moves over the ground along the base's x axis, and the base goes where it went."""
    foot, first, end, start_s = middle_stance(log)
    names = [f"{foot}_foot_{axis}_m" for axis in AXES]
    moved = []
    for q, place, share in zip(rows_of(log, TRUE_ATTITUDE), rows_of(log, names), share_done(log["t_s"], first, end, start_s)):
        along = turned(q, (1.0, 0.0, 0.0))
        way_m = share * SLIP_MPS * SLIP_S / math.hypot(*along[:2])
        slip = turned((q[0], -q[1], -q[2], -q[3]), (way_m * along[0], way_m * along[1], 0.0))
        moved.append([p + s for p, s in zip(place, slip)])
    return with_rows(log, names, moved)


def sole_pivots(log):
    """A sole that stands turns about its own vertical; only a log that has the soles tells it."""
    foot, first, end, start_s = middle_stance(log)
    attitude, rate = [f"{foot}_foot_q{part}" for part in "wxyz"], [f"{foot}_foot_w{axis}_radps" for axis in AXES]
    if attitude[0] not in log:
        raise ValueError("the log has no soles")
    shares = share_done(log["t_s"], first, end, start_s)
    attitudes, rates = [], []
    for q, w, share in zip(rows_of(log, attitude), rows_of(log, rate), shares):
        turn_rad = share * PIVOT_RAD
        attitudes.append(product(q, (math.cos(turn_rad / 2), 0.0, 0.0, math.sin(turn_rad / 2))))
        spin = turned(q, (0.0, 0.0, PIVOT_RAD / SLIP_S if 0.0 < share < 1.0 else 0.0))
        rates.append([a + b for a, b in zip(w, spin)])
    return with_rows(with_rows(log, attitude, attitudes), rate, rates)


def truth_late(log, late_s):
    """The truth of a row is that of so much earlier, of the nearest row."""
    times = log["t_s"]
    at = [max(bisect.bisect_right(times, t - late_s + 1e-9) - 1, 0) for t in times]
    return {**log, **{name: [values[i] for i in at] for name, values in log.items() if name.startswith("truth_")}}


def gyro_against_truth(log, span_s):
    """rad, of each span in turn: between the turn that the gyro felt, its bias in it, and the truth's."""
    times, attitudes, rates = log["t_s"], rows_of(log, TRUE_ATTITUDE), rows_of(log, GYRO)
    apart, first, felt = [], 0, (1.0, 0.0, 0.0, 0.0)
    for i in range(len(times) - 1):
        turn = [rate * (times[i + 1] - times[i]) for rate in rates[i]]
        angle = math.hypot(*turn)
        axis = [part / angle if angle > 0.0 else 0.0 for part in turn]
        felt = product(felt, (math.cos(angle / 2), *(math.sin(angle / 2) * part for part in axis)))
        if times[i + 1] - times[first] >= span_s:
            w, *v = attitudes[first]
            true = product((w, *(-part for part in v)), attitudes[i + 1])
            w, *v = product((felt[0], *(-part for part in felt[1:])), true)
            apart.append(2 * math.atan2(math.hypot(*v), abs(w)))
            first, felt = i + 1, (1.0, 0.0, 0.0, 0.0)
    return apart


# What a table calls it -> the log so.
VARIANTS = {
    "as it is": lambda log: log,
    "every 2nd row": lambda log: thinned(log, 2),
    "every 5th row": lambda log: thinned(log, 5),
    "begun on one foot": begun_on_one_foot,
    "a foot slips 60 mm in 0.2 s": foot_slips,
    "a sole pivots 5 degrees in 0.2 s": sole_pivots,
    "contacts 20 ms early": lambda log: contacts_late(log, -0.020),
    "contacts 20 ms late": lambda log: contacts_late(log, 0.020),
    "IMU 10 ms late": lambda log: imu_late(log, 0.010),
    "accelerometer 1 % high": lambda log: accel_scaled(log, 1.01),
    "truth 10 ms late": lambda log: truth_late(log, 0.010),
    "truth 10 ms early": lambda log: truth_late(log, -0.010),
    "IMU tilted 1 degree": lambda log: imu_tilted(log, math.radians(1)),
}
THINNED = ("as it is", "every 2nd row", "every 5th row")
