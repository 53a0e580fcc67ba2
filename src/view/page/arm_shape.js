// The shape of the arm from its robot description: surfaces that move with its joints.

import { axes } from "./space.js";
import { STRIDE } from "./solids.js";

// Surfaces in the format of /arm_shape: the length of a JSON list, the list, and the numbers of each surface.
export function surfacesOf(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const list = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  const take = (Numbers, count) => {
    const numbers = new Numbers(buffer, at, count);
    at += numbers.byteLength;
    return numbers;
  };
  return list.map(({ carrier, corners, triangles }) => ({
    carrier,
    corners: take(Float32Array, STRIDE * corners),
    triangles: take(Uint32Array, 3 * triangles),
  }));
}

const STILL = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);

// The transform to the base frame from the frame that carries a surface: the base, or a link with the given pose.
export function modelOf(carrier, frames) {
  if (carrier === 0) return STILL;
  const pose = frames[carrier - 1];
  const [x, y, z] = axes(pose.slice(3));
  return new Float32Array([...x, 0, ...y, 0, ...z, 0, ...pose.slice(0, 3), 1]);
}
