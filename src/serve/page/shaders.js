// @ts-check
// Shaders of the lit view: the surface at each pixel. Its reflection is in light.js.
import { LIGHT, SHADING } from './light.js';

// Links a program of two shaders; throws their errors.
/** @param {WebGL2RenderingContext} gl @param {string} vertex @param {string} fragment */
export function linked(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, text] of /** @type {[number, string][]} */ ([[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]])) {
    const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(String(gl.getShaderInfoLog(shader)));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(String(gl.getProgramInfoLog(program)));
  return program;
}

// Returns whether the CPU renders for lack of a graphics card; tested with a picture of one pixel.
export function isSoftware() {
  const gl = new OffscreenCanvas(1, 1).getContext('webgl2');
  if (!gl) return false;
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  const renderer = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(renderer);
}

export const VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 aPosition;
layout(location = 1) in vec3 aNormal;
layout(location = 2) in vec3 aTangent;
layout(location = 3) in vec2 aUv;
uniform mat4 uView;
uniform vec2 uRepeat;
uniform float uDisplace;   // world units per mm; 0: no displacement
uniform vec2 uHeights;     // minimum and maximum height in mm
uniform sampler2D uHeight;
out vec3 vPosition;
out vec3 vNormal;
out vec3 vTangent;
out vec2 vUv;
void main() {
  vec2 uv = aUv * uRepeat;
  float h = uDisplace > 0.0 ? (textureLod(uHeight, uv, 0.0).r - uHeights.y) * uDisplace : 0.0;
  vPosition = aPosition + aNormal * h;
  vNormal = aNormal;
  vTangent = aTangent;
  vUv = uv;
  gl_Position = uView * vec4(vPosition, 1.0);
}`;

export const FRAGMENT = `#version 300 es
precision highp float;
in vec3 vPosition;
in vec3 vNormal;
in vec3 vTangent;
in vec2 vUv;
uniform vec4 uEye;          // the eye; with 0 as the fourth number, the direction to it from everywhere
// Each of the last three textures packs four single-channel maps: see textures.js.
uniform sampler2D uBaseColor, uNormal, uHeight, uEmission, uCoatNormal, uSurface, uGloss, uInner;
uniform int uMaps;          // available channels, one bit each
uniform float uGlow;        // factor of the emission colours
uniform vec4 uConstants;    // roughness, metal, anisotropy and coat where there is no map
uniform vec2 uHeights;
uniform float uUvPerMm;     // relative to the width of the canvas
uniform vec2 uAspect;       // the canvas: 1, width over height
uniform float uRelief;
uniform int uParallax;
uniform float uFine;        // share of the steps taken, 1 is all
uniform float uWorldPerMm;  // where texels are stretched; 0: as on the canvas
out vec4 oColor;
bool has(int bit) { return (uMaps & (1 << bit)) != 0; }

${LIGHT}
${SHADING}
// Turns of the texture per mm, across and down.
vec2 per_mm;

float height(vec2 uv) { return texture(uHeight, uv).r; }

// Intersection of the line of sight with the relief below the surface; d is in tangent space, y along v.
vec2 parallax(vec2 uv, vec3 d, float lod, out float depth) {
  float range = (uHeights.y - uHeights.x) * uRelief;
  depth = 0.0;
  if (range * per_mm.x < 1e-6) return uv;
  float steps = ceil(uFine * mix(44.0, 18.0, clamp(d.z, 0.0, 1.0)));
  vec2 reach = -d.xy / max(d.z, 0.18) * range * per_mm;
  float before = 0.0, gap_before = 0.0;
  for (float i = 0.0; i < 48.0; i += 1.0) {
    float t = i / steps;
    float below = (uHeights.y - textureLod(uHeight, uv + reach * t, lod).r) / (uHeights.y - uHeights.x);
    float gap = t - below;
    if (gap >= 0.0 || i >= steps) {
      float s = i == 0.0 ? 0.0 : clamp(gap_before / max(gap_before - gap, 1e-5), 0.0, 1.0);
      depth = mix(before, t, s);
      return uv + reach * depth;
    }
    before = t;
    gap_before = gap;
  }
  depth = 1.0;
  return uv + reach;
}

// Share of the key light that reaches a point of the relief.
float shadow(vec2 uv, float depth, vec3 l, float lod) {
  float range = (uHeights.y - uHeights.x) * uRelief;
  if (range * per_mm.x < 1e-6 || l.z <= 0.02) return 1.0;
  vec2 reach = l.xy / max(l.z, 0.12) * range * depth * per_mm;
  float worst = 0.0;
  float steps = ceil(14.0 * uFine);
  for (float i = 1.0; i <= 14.0; i += 1.0) {
    if (i > steps) break;
    float t = i / steps;
    float below = (uHeights.y - textureLod(uHeight, uv + reach * t, lod).r) / (uHeights.y - uHeights.x);
    worst = max(worst, (depth * (1.0 - t) - below) * (1.2 - t));
  }
  return 1.0 - smoothstep(0.0, 0.28 * uKeySize, worst);
}

// A normal of the texture, steepened by the relief factor.
vec3 leaning(vec3 n) { return normalize(vec3(n.xy * uRelief, max(n.z, 0.02))); }

void main() {
  vec3 N = normalize(vNormal);
  vec3 T = normalize(vTangent - N * dot(N, vTangent));
  vec3 D = cross(T, N);                      // towards +v, that is, down
  if (dot(D, dFdx(vPosition) * dFdx(vUv).y + dFdy(vPosition) * dFdy(vUv).y) < 0.0) D = -D;
  vec3 V = normalize(uEye.xyz - vPosition * uEye.w);
  vec3 L = transpose(uLight) * uKey;
  vec2 dx = dFdx(vUv), dy = dFdy(vUv);
  per_mm = uUvPerMm * uAspect;
  float turned = dx.x * dy.y - dy.x * dx.y;
  if (uWorldPerMm > 0.0 && turned != 0.0) {
    vec3 px = dFdx(vPosition), py = dFdy(vPosition);
    vec2 spread = vec2(length(px * dy.y - py * dx.y), length(py * dx.x - px * dy.x)) / abs(turned);
    per_mm = min(uWorldPerMm / max(spread, vec2(1e-6)), vec2(1.0));
  }
  vec2 uv = vUv;
  float depth = 0.0;
  vec2 size = vec2(textureSize(uHeight, 0));
  float lod = max(0.0, 0.5 * log2(max(max(dot(dx * size, dx * size), dot(dy * size, dy * size)), 1e-8)));
  bool steep = uParallax == 1 && has(4);
  float lit = 1.0;
  if (steep) {
    uv = parallax(uv, vec3(dot(V, T), dot(V, D), dot(V, N)), lod, depth);
    lit = shadow(uv, depth, vec3(dot(L, T), dot(L, D), dot(L, N)), lod);
  }

  vec3 base = has(0) ? textureGrad(uBaseColor, uv, dx, dy).rgb : vec3(0.5);
  vec4 surface = textureGrad(uSurface, uv, dx, dy), gloss = textureGrad(uGloss, uv, dx, dy), inner = textureGrad(uInner, uv, dx, dy);
  Point p;
  p.base = base;
  p.roughness = has(1) ? surface.x : uConstants.x;
  p.metal = has(2) ? surface.y : uConstants.y;
  p.open = has(5) ? surface.z : 1.0;
  float opacity = has(10) ? surface.w : 1.0;
  p.anisotropy = has(6) ? clamp(gloss.x, 0.0, 1.0) : uConstants.z;
  float angle = has(7) ? radians(gloss.y) : 0.0;
  p.sheen = has(8) ? gloss.z : 0.0;
  float coat = has(9) ? gloss.w : uConstants.w;
  float coat_roughness = has(11) ? inner.x : 0.25;   // shading::COAT
  float ior = has(14) ? max(inner.y, 1.0) : 1.5;
  p.f90 = has(15) ? inner.z : 1.0;
  p.f0 = vec3((ior - 1.0) / (ior + 1.0));
  p.f0 *= p.f0 * p.f90;
  p.scatter = has(16) ? clamp(inner.w, 0.0, 1.0) : 0.0;
  vec3 emission = has(13) ? textureGrad(uEmission, uv, dx, dy).rgb * uGlow : vec3(0.0);
  // Without cast shadows, hollows are darker, as in relief::render.
  p.lit = steep ? lit : 0.5 + 0.5 * p.open;

  // Block::slopes and Block::spreads, over the pixels of the picture or, if these are larger, of the texture.
  vec3 n = vec3(0.0, 0.0, 1.0);
  vec2 spread = vec2(0.0);
  if (has(4)) {
    vec2 wide = exp2(lod) / vec2(textureSize(uHeight, 0));
    float middle = height(uv);
    vec4 beside = vec4(height(uv + vec2(wide.x, 0.0)), height(uv - vec2(wide.x, 0.0)), height(uv + vec2(0.0, wide.y)), height(uv - vec2(0.0, wide.y)));
    n = vec3(vec2(beside.y - beside.x, beside.z - beside.w) / (2.0 * wide) * per_mm, 1.0);
    spread = (beside.xz + beside.yw - 2.0 * middle) / wide * per_mm * uRelief;
  }
  if (has(3)) n = textureGrad(uNormal, uv, dx, dy).rgb * 2.0 - 1.0;
  mat3 lying = uLight * mat3(T, -D, N);
  p.shape = lying[2];
  p.n = normalize(lying * leaning(n));
  vec3 nx = dFdx(p.n), ny = dFdy(p.n);
  p.spread = has(4) ? dot(spread, spread) : dot(nx, nx) + dot(ny, ny);
  p.v = uLight * V;
  // The lobe is narrow along fibres and wide across them: shading::light::lying.
  p.t = cos(angle) * lying[0] - sin(angle) * lying[1];
  p.t = normalize(p.t - p.n * dot(p.n, p.t));
  p.b = cross(p.n, p.t);
  // Subsurface light leaves beside the point where it entered, so relief and shadows are softer.
  p.soft = normalize(mix(p.n, p.shape, 0.6 * p.scatter));
  // A coat fills the relief and is flat unless it has a normal of its own.
  vec3 coat_n = has(12) ? normalize(lying * leaning(textureGrad(uCoatNormal, uv, dx, dy).rgb * 2.0 - 1.0)) : p.shape;
  vec3 color;
  if (uLamp) {
    color = under_lamp(p, coat, coat_n, coat_roughness);
  } else {
    color = around(p);
    if (coat > 0.0) color = coated(color, p, coat, coat_n, coat_roughness);
  }
  if (opacity < 0.5) discard;
  oColor = vec4(developed(color + emission), 1.0);
}`;
