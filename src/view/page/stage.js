// The arm with light and shadow by WebGL: solids on a floor with a grid. The sheet with paths, handles and labels lies over it.

import { modelOf } from "./arm_shape.js";
import { STRIDE } from "./solids.js";
import { cross, matrix, scaled } from "./space.js";

// Direction to the light.
const SUN = [0.42, -0.5, 1];
// Half the side of the area that casts shadows, relative to the arm's reach.
const SHADOWED = 1.5;
// The resolution of software rendering relative to the screen.
const SLOW_RATIO = 0.6;
// Distance between the lines of the grid [m].
const GRID = 0.2;

const SHADE = `
  uniform highp sampler2DShadow shadows;
  uniform vec3 sun;
  uniform float softness;
  float lit(vec3 at) {
    if (any(lessThan(at, vec3(0))) || any(greaterThan(at, vec3(1)))) return 1.0;
    if (softness == 0.0) return texture(shadows, at);
    float sum = 0.0;
    for (int i = -1; i <= 1; i += 2) for (int j = -1; j <= 1; j += 2)
      sum += texture(shadows, vec3(at.xy + softness * vec2(i, j), at.z));
    return 0.25 * sum;
  }`;

const PROGRAMS = {
  shadow: [
    `in vec3 place; uniform mat4 light; uniform mat4 model; void main() { gl_Position = light * model * vec4(place, 1); }`,
    `void main() {}`,
  ],
  solid: [
    `in vec3 place; in vec3 normal; in vec3 color; uniform mat4 view; uniform mat4 light; uniform mat4 model; uniform float bias;
     out vec3 n; out vec3 c; out vec3 at;
     void main() {
       n = mat3(model) * normal; c = color;
       vec4 there = model * vec4(place, 1);
       at = (light * (there + vec4(bias * n, 0))).xyz * 0.5 + 0.5;
       gl_Position = view * there;
     }`,
    `${SHADE}
     in vec3 n; in vec3 c; in vec3 at; uniform vec3 eye; uniform float alpha; out vec4 pixel;
     void main() {
       vec3 normal = normalize(n);
       float sunny = max(dot(normal, sun), 0.0) * lit(at);
       vec3 sky = mix(vec3(0.30, 0.30, 0.32), vec3(0.62, 0.66, 0.72), 0.5 + 0.5 * normal.z);
       float gloss = pow(max(dot(normal, normalize(sun + eye)), 0.0), 48.0) * step(0.001, sunny);
       vec3 light = pow(c, vec3(2.2)) * (sky + 0.75 * sunny) + 0.16 * gloss;
       pixel = vec4(alpha * pow(light, vec3(1.0 / 2.2)), alpha);
     }`,
  ],
  floor: [
    `in vec3 place; uniform mat4 view; uniform mat4 light; out vec2 xy; out vec3 at;
     void main() { xy = place.xy; at = (light * vec4(place, 1)).xyz * 0.5 + 0.5; gl_Position = view * vec4(place, 1); }`,
    `${SHADE}
     in vec2 xy; in vec3 at; uniform vec3 line; uniform float grid; uniform vec3 middle; uniform float far; out vec4 pixel;
     void main() {
       vec2 cell = xy / grid;
       vec2 off = abs(fract(cell - 0.5) - 0.5) / fwidth(cell);
       float fade = 1.0 - smoothstep(0.35, 1.0, distance(xy, middle.xy) / far);
       float lines = 0.8 * (1.0 - min(min(off.x, off.y), 1.0)) * fade;
       float dark = 0.28 * (1.0 - lit(at)) * fade;
       float alpha = lines + dark * (1.0 - lines);
       pixel = vec4(line * lines, alpha);
     }`,
  ],
};

// Whether WebGL renders in software. If so, shadows and resolution are reduced.
function isSlow() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const info = gl?.getExtension("WEBGL_debug_renderer_info");
  return info ? /swiftshader|llvmpipe|software/i.test(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : false;
}

// Converts #rrggbb to three components.
export const parts = (color) => [1, 3, 5].map((i) => Number.parseInt(color.slice(i, i + 2), 16) / 255 || 0);

export class Stage {
  // Null if the browser has no WebGL.
  static on(canvas) {
    const slow = isSlow();
    const gl = canvas.getContext("webgl2", { antialias: !slow });
    return gl && new Stage(canvas, gl, slow);
  }

  constructor(canvas, gl, slow) {
    Object.assign(this, { canvas, gl, slow });
    this.armShape = [];
    this.make();
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => this.make());
  }

  make() {
    const { gl } = this;
    this.programs = Object.fromEntries(Object.entries(PROGRAMS).map(([name, sources]) => [name, this.program(...sources)]));
    this.solidBuffer = this.buffer(STRIDE, ["place", "normal", "color"]);
    this.solidBuffer.triangles = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.solidBuffer.triangles);
    this.floorBuffer = this.buffer(3, ["place"]);
    this.upload();
    this.shadowSize = this.slow ? 512 : 2048;
    this.shadows = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.shadows);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.DEPTH_COMPONENT24, this.shadowSize, this.shadowSize, 0, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT, null);
    for (const [name, value] of [
      ["MIN_FILTER", gl.LINEAR], ["MAG_FILTER", gl.LINEAR], ["WRAP_S", gl.CLAMP_TO_EDGE], ["WRAP_T", gl.CLAMP_TO_EDGE],
      ["COMPARE_MODE", gl.COMPARE_REF_TO_TEXTURE],
    ]) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${name}`], value);
    this.target = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.shadows, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  program(vertex, fragment) {
    const { gl } = this;
    const program = gl.createProgram();
    ["place", "normal", "color"].forEach((name, i) => gl.bindAttribLocation(program, i, name));
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, `#version 300 es\nprecision highp float;\n${source}`);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program));
    const places = new Map();
    const place = (name) => places.get(name) ?? places.set(name, gl.getUniformLocation(program, name)).get(name);
    return { program, place };
  }

  // A buffer of vertices with `stride` numbers each, three for each attribute.
  buffer(stride, attributes) {
    const { gl } = this;
    const [array, buffer] = [gl.createVertexArray(), gl.createBuffer()];
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    attributes.forEach((_, i) => {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 4 * stride, 12 * i);
    });
    return { array, buffer };
  }

  // Sets the surfaces, as surfacesOf returns them.
  setLooks(surfaces) {
    const { gl } = this;
    for (const { kept } of this.armShape) {
      gl.deleteVertexArray(kept.array);
      for (const buffer of [kept.buffer, kept.triangles]) gl.deleteBuffer(buffer);
    }
    this.armShape = surfaces;
    this.upload();
  }

  upload() {
    const { gl } = this;
    for (const surface of this.armShape) {
      const kept = this.buffer(STRIDE, ["place", "normal", "color"]);
      gl.bufferData(gl.ARRAY_BUFFER, surface.corners, gl.STATIC_DRAW);
      kept.triangles = gl.createBuffer();
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, kept.triangles);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, surface.triangles, gl.STATIC_DRAW);
      surface.kept = kept;
    }
    gl.bindVertexArray(null);
  }

  resize(width, height, ratio) {
    const fine = this.slow ? SLOW_RATIO : ratio;
    this.canvas.width = Math.round(width * fine);
    this.canvas.height = Math.round(height * fine);
  }

  use(name, uniforms) {
    const { gl } = this;
    const { program, place } = this.programs[name];
    gl.useProgram(program);
    for (const [key, value] of Object.entries(uniforms)) {
      if (value.length === 16) gl.uniformMatrix4fv(place(key), false, value);
      else if (value.length === 3) gl.uniform3fv(place(key), value);
      else gl.uniform1f(place(key), value);
    }
  }

  // Draws the solids, the surfaces of an arm whose links have these poses, and ghosts with the given opacity, as the camera sees them,
  // above a floor at the given height.
  draw(camera, { solids, frames, ghosts }, { floor, reach, line }) {
    const { gl } = this;
    if (gl.isContextLost()) return;
    const sun = scaled(1 / Math.hypot(...SUN), SUN);
    const view = camera.matrix(4 * reach);
    const light = lightMatrix(sun, camera.target, reach);
    this.take(solids);
    const drawAll = (name, uniforms) => {
      this.use(name, { ...uniforms, model: modelOf(0) });
      gl.bindVertexArray(this.solidBuffer.array);
      gl.drawElements(gl.TRIANGLES, solids.count, gl.UNSIGNED_INT, 0);
      for (const { carrier, kept, triangles } of frames ? this.armShape : []) {
        if (carrier > frames.length) continue;
        gl.uniformMatrix4fv(this.programs[name].place("model"), false, modelOf(carrier, frames));
        gl.bindVertexArray(kept.array);
        gl.drawElements(gl.TRIANGLES, triangles.length, gl.UNSIGNED_INT, 0);
      }
    };
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.viewport(0, 0, this.shadowSize, this.shadowSize);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    drawAll("shadow", { light });
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.bindTexture(gl.TEXTURE_2D, this.shadows);
    const softness = this.slow ? 0 : 0.7 / this.shadowSize;
    // The shadow lookup is offset by more than one texel, so that a surface casts no shadow on itself.
    drawAll("solid", { view, light, sun, softness, eye: camera.towards, bias: (6 * SHADOWED * reach) / this.shadowSize, alpha: 1 });
    // The floor is not drawn when it is seen from below.
    if (camera.towards[2] > 0.02) this.drawFloor(camera, { view, light, softness }, { floor, reach, line });
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    for (const { solids, alpha } of ghosts) {
      if (!solids.count) continue;
      this.take(solids);
      this.use("solid", { view, light, sun, softness: 0, eye: camera.towards, bias: 0, alpha, model: modelOf(0) });
      gl.drawElements(gl.TRIANGLES, solids.count, gl.UNSIGNED_INT, 0);
    }
  }

  // Sets the solids to draw next.
  take(solids) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.solidBuffer.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, solids.vertices.subarray(0, solids.size), gl.DYNAMIC_DRAW);
    gl.bindVertexArray(this.solidBuffer.array);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, solids.triangles.subarray(0, solids.count), gl.DYNAMIC_DRAW);
  }

  drawFloor({ target: middle }, { view, light, softness }, { floor, reach, line }) {
    const { gl } = this;
    const far = 2.2 * reach;
    const corner = (x, y) => [middle[0] + x * far, middle[1] + y * far, floor];
    const corners = [corner(-1, -1), corner(1, -1), corner(-1, 1), corner(-1, 1), corner(1, -1), corner(1, 1)];
    gl.bindBuffer(gl.ARRAY_BUFFER, this.floorBuffer.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(corners.flat()), gl.DYNAMIC_DRAW);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.use("floor", { view, light, softness, line: parts(line), grid: GRID, middle, far });
    gl.bindVertexArray(this.floorBuffer.array);
    // Solids that are in the floor or below it are visible through it.
    gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLES, 0, 6);
    gl.depthMask(true);
  }
}

// The transform from space to the view of the light, around the target of the camera.
function lightMatrix(sun, middle, reach) {
  const cut = (v) => scaled(1 / Math.hypot(...v), v);
  const right = cut(cross([0, 0, 1], sun));
  return matrix([right, cross(sun, right), scaled(-1, sun)], middle, [SHADOWED * reach, SHADOWED * reach, 5 * reach]);
}
