// SPDX-License-Identifier: Apache-2.0
// Where robot and footholds are at a moment: what all views draw.
import { joined, linkPoses, poseOf } from "./pose.js";

export const FEET = ["left", "right"];

/** {base, links, soles: [left, right], estimated: [..], camera}: poses in the page's world, null where unknown. */
export function robotAt(run, t_s) {
  const base = run.base?.poseAt(t_s) ?? null;
  const angles = run.series("joints")?.at(t_s) ?? null;
  const links = run.robot && base && angles ? linkPoses(run.robot, base, angles) : [];
  const ofLegs = FEET.map((foot) => {
    const sole = run.robot?.sole;
    return links.length && sole?.joint ? joined(links[sole.joint[foot]], { p: sole.origin_m, q: [0, 0, 0, 1] }) : null;
  });
  const soles = FEET.map((foot, i) => run.sole(foot)?.poseAt(t_s) ?? ofLegs[i]);
  const estimated = FEET.map((foot) => run.series(`sole_estimated_${foot}`)?.poseAt(t_s) ?? null);
  const mount = run.camera?.base_T_camera ? poseOf(run.camera.base_T_camera) : null;
  return { base, links, soles, estimated, camera: base && mount ? joined(base, mount) : null };
}
