// SPDX-License-Identifier: Apache-2.0
// Rotations as quaternions [x, y, z, w], and the places of the robot's links.

export function turn(q, v) {
  const [x, y, z, w] = q;
  const tx = 2 * (y * v[2] - z * v[1]),
    ty = 2 * (z * v[0] - x * v[2]),
    tz = 2 * (x * v[1] - y * v[0]);
  return [v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx];
}

export function times(a, b) {
  return [
    a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
    a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
    a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
    a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
  ];
}

/** A point of a pose's frame in the frame that the pose is in. */
export const placed = (pose, v) => turn(pose.q, v).map((c, k) => c + pose.p[k]);

export const joined = (a, b) => ({ p: placed(a, b.p), q: times(a.q, b.q) });

export function back(pose, v) {
  const q = [-pose.q[0], -pose.q[1], -pose.q[2], pose.q[3]];
  return turn(q, [v[0] - pose.p[0], v[1] - pose.p[1], v[2] - pose.p[2]]);
}

export const poseOf = (seven) => ({ p: seven.slice(0, 3), q: seven.slice(3, 7) });

export const aboutZ = (angle) => [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];

export function yawOf(q) {
  return Math.atan2(2 * (q[3] * q[2] + q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2]));
}

/** Angle between the pose's z and the vertical, rad. */
export function tiltOf(q) {
  return Math.acos(Math.min(1, Math.max(-1, 1 - 2 * (q[0] * q[0] + q[1] * q[1]))));
}

const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };

/** The poses of all joints' frames, each after its own turn, in the base's world. */
export function linkPoses(robot, base, angles) {
  const poses = [];
  robot.joints.forEach((joint, j) => {
    const parent = joint.parent < 0 ? base : poses[joint.parent];
    const axis = AXES[joint.axis] ?? joint.axis;
    const half = (angles?.[j] ?? 0) / 2,
      s = Math.sin(half);
    poses.push(joined(parent, { p: joint.origin_m, q: [axis[0] * s, axis[1] * s, axis[2] * s, Math.cos(half)] }));
  });
  return poses;
}

/** Corners of a sole's rectangle [toe, heel, half width], from the left toe on. */
export function soleCorners([toe, heel, half]) {
  return [
    [toe, half, 0],
    [toe, -half, 0],
    [heel, -half, 0],
    [heel, half, 0],
  ];
}
