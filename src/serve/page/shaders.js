// @ts-check
// Shaders of the lit view: GGX with anisotropy, a coat and subsurface scattering, under a studio of soft boxes that is
// evaluated analytically, as if prefiltered.

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

// Light, for the shape and for the background.
export const LIGHT = `
uniform mat3 uLight;        // rotates the environment
uniform int uScene;         // studio, overcast sky, evening, one light in the dark, a panorama
uniform vec4 uKey;          // direction of the key light, and its size: 1 is that of the studio
uniform float uExposure;
uniform sampler2D uEnvironment;   // a panorama, with levels blurred for rougher surfaces
uniform vec3 uIrradiance[9];      // its light on a white surface, by spherical harmonics
uniform vec3 uSunLight;           // the colour of its sun
const float PI = 3.14159265;
const int OWN = 4;

// One soft box: its light in direction d, blurred by a lobe of width blur.
float box(vec3 d, vec3 to, vec3 side, vec2 half_size, float blur) {
  float z = dot(d, to);
  if (z <= 0.0) return 0.0;
  vec3 up = cross(to, side);
  vec2 p = vec2(dot(d, side), dot(d, up)) / z;
  vec2 soft = vec2(0.03 + blur);
  vec2 inside = smoothstep(half_size + soft, half_size - soft, abs(p));
  // Blurring spreads the light and so weakens it.
  vec2 energy = half_size / (half_size + 0.6 * blur);
  return inside.x * inside.y * energy.x * energy.y * smoothstep(0.0, 0.25, z);
}

vec3 key_color() {
  if (uScene == OWN) return uSunLight;
  if (uScene == 1) return vec3(1.0, 0.98, 0.94);
  if (uScene == 2) return vec3(1.35, 0.85, 0.5);
  return vec3(1.05, 1.0, 0.93);
}

// Light from direction d, as reflected by a surface of this roughness.
vec3 studio(vec3 d, float roughness) {
  d = uLight * d;
  if (uScene == OWN) return textureLod(uEnvironment, vec2(0.5 + atan(d.x, -d.z) / (2.0 * PI), acos(clamp(d.y, -1.0, 1.0)) / PI), 5.0 * roughness).rgb;
  float blur = roughness * roughness * 1.6;
  float sky = smoothstep(-0.5 - blur, 0.6 + blur, d.y);
  vec3 side = normalize(vec3(0.65, 0.0, 0.75));
  float key = box(d, uKey.xyz, side, vec2(0.42, 0.3) * uKey.w, blur);
  if (uScene == 1) {
    // A bright sky all around, brown ground, the sun behind clouds.
    vec3 light = mix(vec3(0.2, 0.17, 0.14), mix(vec3(0.95, 1.0, 1.05), vec3(0.62, 0.76, 1.0), clamp(d.y, 0.0, 1.0)), sky);
    return light + vec3(3.0) * key_color() * key;
  }
  if (uScene == 2) {
    // A low sun, a dark blue sky, a glow along the horizon.
    vec3 light = mix(vec3(0.09, 0.07, 0.06), vec3(0.2, 0.25, 0.38), sky);
    light += vec3(0.9, 0.42, 0.16) * exp(-10.0 / (1.0 + 6.0 * blur) * d.y * d.y) * (0.6 + 0.4 * dot(d, uKey.xyz));
    return light + vec3(8.0) * key_color() * key;
  }
  if (uScene == 3) {
    vec3 light = vec3(0.025) + vec3(9.0) * key_color() * key;
    return light + vec3(1.3, 1.4, 1.6) * box(d, normalize(vec3(0.9, 0.2, -0.5)), normalize(vec3(0.5, 0.0, 0.9)), vec2(0.06, 0.9), blur);
  }
  vec3 light = mix(vec3(0.15, 0.14, 0.13), vec3(0.52, 0.535, 0.56), sky);
  light += vec3(7.05) * key_color() * key;
  light += vec3(3.0, 3.2, 3.6) * box(d, normalize(vec3(0.95, 0.25, 0.25)), normalize(vec3(-0.25, 0.0, 0.95)), vec2(0.16, 0.75), blur);
  light += vec3(2.2) * box(d, normalize(vec3(0.1, 1.0, -0.25)), vec3(1.0, 0.0, 0.0), vec2(0.9, 0.22), blur);
  light += vec3(1.2, 1.15, 1.05) * box(d, normalize(vec3(-0.6, -0.1, -0.8)), normalize(vec3(-0.8, 0.0, 0.6)), vec2(0.3, 0.6), blur);
  return light;
}

// Light on a white surface.
vec3 ambient(vec3 n) {
  if (uScene != OWN) return studio(n, 1.0);
  n = uLight * n;
  vec3 light = uIrradiance[0] + uIrradiance[1] * n.y + uIrradiance[2] * n.z + uIrradiance[3] * n.x + uIrradiance[4] * n.x * n.y + uIrradiance[5] * n.y * n.z;
  light += uIrradiance[6] * (3.0 * n.z * n.z - 1.0) + uIrradiance[7] * n.x * n.z + uIrradiance[8] * (n.x * n.x - n.y * n.y);
  return max(light, vec3(0.0));
}

vec3 film(vec3 c) {
  c *= 0.72;
  return clamp((c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14), 0.0, 1.0);
}

// Tone mapping and sRGB encoding.
vec3 developed(vec3 c) {
  c = film(c * uExposure);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}`;

export const FRAGMENT = `#version 300 es
precision highp float;
in vec3 vPosition;
in vec3 vNormal;
in vec3 vTangent;
in vec2 vUv;
uniform vec3 uEye;
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
// Turns of the texture per mm, across and down.
vec2 per_mm;

float luma(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }
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
  return 1.0 - smoothstep(0.0, 0.28 * uKey.w, worst);
}

float d_ggx(float at, float ab, float toh, float boh, float noh) {
  vec3 v = vec3(ab * toh, at * boh, at * ab * noh);
  float w = at * ab / max(dot(v, v), 1e-9);
  return at * ab * w * w / PI;
}

float v_ggx(float at, float ab, float tov, float bov, float nov, float tol, float bol, float nol) {
  float a = nol * length(vec3(at * tov, ab * bov, nov));
  float b = nov * length(vec3(at * tol, ab * bol, nol));
  return 0.5 / max(a + b, 1e-5);
}

vec2 split_sum(float roughness, float nov) {
  vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
  float a = min(r.x * r.x, exp2(-9.28 * nov)) * r.x + r.y;
  return vec2(-1.04, 1.04) * a + r.zw;
}

// A normal of the texture, steepened by the relief factor.
vec3 leaning(vec3 n) { return normalize(vec3(n.xy * uRelief, max(n.z, 0.02))); }

// Roughness, increased by normals too fine to be visible.
float widened(float roughness, vec3 n) {
  vec3 nx = dFdx(n), ny = dFdy(n);
  return clamp(sqrt(roughness * roughness + min(0.35 * (dot(nx, nx) + dot(ny, ny)), 0.2)), 0.045, 1.0);
}

void main() {
  vec3 N = normalize(vNormal);
  vec3 T = normalize(vTangent - N * dot(N, vTangent));
  vec3 D = cross(T, N);                      // towards +v, that is, down
  if (dot(D, dFdx(vPosition) * dFdx(vUv).y + dFdy(vPosition) * dFdy(vUv).y) < 0.0) D = -D;
  vec3 V = normalize(uEye - vPosition);
  vec3 L = normalize(transpose(uLight) * uKey.xyz);
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
  float lit = 1.0;
  vec2 size = vec2(textureSize(uHeight, 0));
  float lod = max(0.0, 0.5 * log2(max(max(dot(dx * size, dx * size), dot(dy * size, dy * size)), 1e-8)));
  if (uParallax == 1 && has(4)) {
    uv = parallax(uv, vec3(dot(V, T), dot(V, D), dot(V, N)), lod, depth);
    lit = shadow(uv, depth, vec3(dot(L, T), dot(L, D), dot(L, N)), lod);
  }

  vec3 base = has(0) ? textureGrad(uBaseColor, uv, dx, dy).rgb : vec3(0.5);
  vec4 surface = textureGrad(uSurface, uv, dx, dy), gloss = textureGrad(uGloss, uv, dx, dy), inner = textureGrad(uInner, uv, dx, dy);
  float roughness = has(1) ? surface.x : uConstants.x;
  float metal = has(2) ? surface.y : uConstants.y;
  float ao = has(5) ? surface.z : 1.0;
  float opacity = has(10) ? surface.w : 1.0;
  float anisotropy = has(6) ? clamp(gloss.x, 0.0, 1.0) : uConstants.z;
  float angle = has(7) ? radians(gloss.y) : 0.0;
  float sheen = has(8) ? gloss.z : 0.0;
  float coat = has(9) ? gloss.w : uConstants.w;
  float coat_roughness = has(11) ? inner.x : 0.0;
  float ior = has(14) ? max(inner.y, 1.0) : 1.5;
  float specular = has(15) ? inner.z : 1.0;
  float scatter = has(16) ? clamp(inner.w, 0.0, 1.0) : 0.0;
  vec3 emission = has(13) ? textureGrad(uEmission, uv, dx, dy).rgb * uGlow : vec3(0.0);

  vec3 n = vec3(0.0, 0.0, 1.0);
  if (has(3)) {
    n = textureGrad(uNormal, uv, dx, dy).rgb * 2.0 - 1.0;
  } else if (has(4)) {
    vec2 texel = 1.0 / vec2(textureSize(uHeight, 0));
    float x = height(uv + vec2(texel.x, 0.0)) - height(uv - vec2(texel.x, 0.0));
    float y = height(uv + vec2(0.0, texel.y)) - height(uv - vec2(0.0, texel.y));
    n = vec3(vec2(-x, y) / (2.0 * texel) * per_mm, 1.0);
  }
  vec3 geometric = N;
  mat3 lying = mat3(T, -D, N);
  N = normalize(lying * leaning(n));
  roughness = widened(roughness, N);

  float nov = max(abs(dot(N, V)), 1e-3);
  float mirror = (ior - 1.0) / (ior + 1.0);
  vec3 f0 = mix(vec3(mirror * mirror * specular), base, metal);
  float f90 = mix(specular, 1.0, metal);
  vec3 diffuse = base * (1.0 - metal);

  // The lobe is narrow along brush lines t and wide across them, as in pictures of Relief.
  vec3 t = normalize(cos(angle) * (T - N * dot(N, T)) + sin(angle) * (D - N * dot(N, D)));
  vec3 b = cross(N, t);
  float a = roughness * roughness;
  float aspect = sqrt(1.0 - 0.9 * anisotropy);
  float at = max(a * aspect, 1e-3), ab = min(a / aspect, 1.0);
  vec3 bent = normalize(mix(N, cross(cross(t, V), t), 0.7 * anisotropy * clamp(5.0 * roughness, 0.0, 1.0)));

  // Reflection of the studio.
  vec3 R = reflect(-V, bent);
  vec2 ss = split_sum(roughness, nov);
  vec3 energy = f0 * ss.x + f90 * ss.y;
  float occluded = clamp(pow(nov + ao, exp2(-16.0 * roughness - 1.0)) - 1.0 + ao, 0.0, 1.0);
  float horizon = clamp(1.0 + 1.1 * dot(R, geometric), 0.0, 1.0);
  // Subsurface light leaves beside the point where it entered, so relief and shadows are softer.
  vec3 soft = normalize(mix(N, geometric, 0.6 * scatter));
  vec3 color = ambient(soft) * diffuse * ao * (1.0 - luma(energy));
  color += studio(R, roughness) * energy * occluded * horizon * horizon * mix(1.0, lit, 0.5);

  // The key light.
  float nol = dot(N, L), side = dot(geometric, L);
  vec3 H = normalize(V + L);
  vec3 f = f0 + (f90 - f0) * pow(1.0 - max(dot(L, H), 0.0), 5.0);
  vec3 key = 2.2 * key_color() * mix(1.0, ao, 0.4);
  if (side > 0.0 || scatter > 0.0) {
    // Scattered light wraps around beyond the terminator.
    float wrap = 0.5 * scatter;
    float round_it = max(dot(soft, L) + wrap, 0.0) / ((1.0 + wrap) * (1.0 + wrap));
    color += key * round_it * mix(lit, 1.0, 0.5 * scatter) * diffuse / PI * (1.0 - f);
  }
  if (nol > 0.0 && side > 0.0) {
    // A large light has a wide highlight.
    float wide = 0.02 * (uKey.w - 1.0);
    float d = d_ggx(max(at + wide, 2e-3), max(ab + wide, 2e-3), dot(t, H), dot(b, H), max(dot(N, H), 0.0));
    float v = v_ggx(at, ab, dot(t, V), dot(b, V), nov, dot(t, L), dot(b, L), nol);
    color += key * nol * lit * min(d * v * f, vec3(16.0));
  }
  color += sheen * mix(vec3(1.0), base, 0.5) * pow(1.0 - nov, 4.0) * ambient(N) * ao + emission;
  // A coat fills the relief and is flat unless it has a normal of its own.
  vec3 C = has(12) ? normalize(lying * leaning(textureGrad(uCoatNormal, uv, dx, dy).rgb * 2.0 - 1.0)) : geometric;
  coat_roughness = widened(coat_roughness, C);
  if (coat > 0.0) {
    float g = max(dot(C, V), 1e-3);
    float through = coat * (0.04 + 0.96 * pow(1.0 - g, 5.0));
    color = color * (1.0 - through) + through * studio(reflect(-V, C), coat_roughness);
  }
  if (opacity < 0.5) discard;
  oColor = vec4(developed(color), 1.0);
}`;
