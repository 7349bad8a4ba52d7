// @ts-check
// Light of the lit view, in GLSL: the environments and the tone curves of the engine. Each function names the Rust
// function of the crate `shibo-kernel`, folder `surface`, that it mirrors. The test `live` compares pictures of both.

// For the shape and for the background. Directions are those of the environment: see `surface/environment`.
export const LIGHT = `
uniform mat3 uLight;              // turns directions of the page to those of the environment
uniform bool uLamp;               // the lamp of Relief, which has no maps
uniform sampler2D uEnvironment;   // all levels, side by side, with their borders
uniform vec3 uLevels[7];          // place of each level in it, and the texels along its edge
uniform vec3 uDiffuse[9];         // light on a white surface without the key light, by spherical harmonics
uniform vec3 uKey;                // direction to the key light
uniform vec3 uKeyLight;           // its light on a white surface that faces it
uniform vec3 uKeyColor;           // colour of one unit of key light in a texel
uniform bool uKeyMoved;           // true if its place or size is not that of the maps
uniform mat3 uKeyBack;            // turns directions so that it stands as in the maps
uniform float uKeySize;           // its size; 1 is that of the maps
uniform float uExposure;

// environment::octahedron::place: a direction in the square -1..1.
vec2 place(vec3 d) {
  d /= max(abs(d.x) + abs(d.y) + abs(d.z), 1e-12);
  vec2 way = vec2(d.x < 0.0 ? -1.0 : 1.0, d.y < 0.0 ? -1.0 : 1.0);
  return d.z < 0.0 ? (1.0 - abs(d.yx)) * way : d.xy;
}

// environment::Map::at: the value of a level at a place, interpolated between four texels.
vec4 level_at(int level, vec2 at) {
  vec3 map = uLevels[level];
  vec2 texel = map.xy + 0.5 * map.z * (at + 1.0) + 1.0;
  return textureLod(uEnvironment, texel / vec2(textureSize(uEnvironment, 0)), 0.0);
}

// Environment::reflected: light that a surface reflects from around d, and the amount of key light in it.
vec4 in_maps(vec3 d, float roughness) {
  vec2 at = place(d);
  float level = 6.0 * clamp(roughness, 0.0, 1.0);
  int lower = min(int(level), 5);
  return mix(level_at(lower, at), level_at(lower + 1, at), level - float(lower));
}

// The same for a key light that has been moved: its amount is read where it stands in the maps. Around its middle the
// sphere is stretched by its size; a larger light is dimmer, so that all of its light stays the same.
vec4 reflected(vec3 d, float roughness) {
  vec4 found = in_maps(d, roughness);
  if (!uKeyMoved) return found;
  vec3 back = uKeyBack * d, middle = uKeyBack * uKey;
  float along = dot(back, middle);
  vec3 off = (back - along * middle) / (max(1.0 + along, 1e-3) * uKeySize);
  float far = dot(off, off);
  back = ((1.0 - far) * middle + 2.0 * off) / (1.0 + far);
  float amount = in_maps(back, roughness * inversesqrt(uKeySize)).a / (uKeySize * uKeySize);
  return vec4(max(found.rgb + uKeyColor * (amount - found.a), vec3(0.0)), amount);
}

// Environment::ambient: light without the key light on a white surface.
vec3 ambient(vec3 n) {
  vec3 light = uDiffuse[0] + uDiffuse[1] * n.y + uDiffuse[2] * n.z + uDiffuse[3] * n.x + uDiffuse[4] * n.x * n.y + uDiffuse[5] * n.y * n.z;
  light += uDiffuse[6] * (3.0 * n.z * n.z - 1.0) + uDiffuse[7] * n.x * n.z + uDiffuse[8] * (n.x * n.x - n.y * n.y);
  return max(light, vec3(0.0));
}

// display::filmic.
vec3 filmic(vec3 c) {
  c = max(c, vec3(0.0)) * 0.8;
  return min((c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14), vec3(1.0));
}

// display::neutral.
vec3 neutral(vec3 c) {
  c = max(c, vec3(0.0));
  float least = min(c.r, min(c.g, c.b));
  c -= least < 0.08 ? least - 6.25 * least * least : 0.04;
  float peak = max(c.r, max(c.g, c.b));
  if (peak < 0.76) return c;
  float top = 1.0 - 0.24 * 0.24 / (peak + 0.24 - 0.76);
  float white = 1.0 - 1.0 / (0.15 * (peak - top) + 1.0);
  c *= top / peak;
  return min(c + (top - c) * white, vec3(1.0));
}

// Tone curve and sRGB encoding, as of Relief: filmic under the lamp, neutral in an environment.
vec3 developed(vec3 c) {
  c = uLamp ? filmic(c * uExposure) : neutral(c * uExposure);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}`;

// Reflection of a surface: needs LIGHT.
export const SHADING = `
// A point of a surface. Directions are those of the environment.
struct Point {
  vec3 base;
  float roughness, metal, sheen, anisotropy;
  float open;         // ambient occlusion; 1 is open
  float lit;          // share of the key light that arrives
  float spread;       // squared change of the normal within a pixel
  vec3 f0;            // reflectance at normal incidence,
  float f90;          // and at grazing incidence
  float scatter;      // subsurface scattering; the engine's pictures do not show it
  vec3 n, t, b, v;    // the normal, along fibres, across them, to the viewer
  vec3 soft;          // the normal for scattered light
  vec3 shape;         // the normal of the shape without its relief
};

// Tilts of facets across fibres: shading::around::TILTS.
const float TILTS[7] = float[7](-1.664, -0.696, -0.298, 0.0, 0.298, 0.696, 1.664);

// shading::around::mirrored.
vec3 mirrored(vec3 n, vec3 v) { return 2.0 * dot(n, v) * n - v; }

// Block::widened: roughness, increased by normals that differ within a pixel.
float widened(float roughness, float spread) {
  float squared = clamp(roughness, 0.045, 1.0);
  squared *= squared;
  return min(sqrt(sqrt(squared * squared + min(spread / 6.0, 0.18))), 1.0);
}

// shading::around::reflectance: factor and summand of the reflectance at normal incidence.
vec2 reflectance(float roughness, float cosine) {
  vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
  float a = min(r.x * r.x, exp2(-9.28 * cosine)) * r.x + r.y;
  return vec2(-1.04, 1.04) * a + r.zw;
}

// shading::around::coat_reflectance.
float coat_reflectance(float cosine) { return 0.04 + 0.96 * pow(1.0 - clamp(cosine, 0.0, 1.0), 5.0); }

// Along::widths: widths of the lobe along fibres and across them.
vec2 widths(float a, float anisotropy) {
  float aspect = sqrt(1.0 - 0.9 * anisotropy);
  return vec2(max(a * aspect, 1e-3), min(a / aspect, 1.0));
}

// Block::gloss: light that the surface reflects. Across fibres several narrow lobes stand beside each other.
vec4 gloss(Point p, float roughness) {
  if (p.anisotropy <= 0.0) return reflected(mirrored(p.n, p.v), roughness);
  vec2 w = widths(roughness * roughness, p.anisotropy);
  float wide = sqrt(max(w.y * w.y - w.x * w.x, 0.0));
  float narrow = sqrt(max(w.x, 0.3 * wide));
  vec4 sum = vec4(0.0);
  for (int i = 0; i < 7; i += 1) sum += reflected(mirrored(normalize(p.n + TILTS[i] * wide * p.b), p.v), narrow);
  return sum / 7.0;
}

// Mirror::seen: light of which a share of the key light arrives.
vec3 seen(vec4 light, float lit) { return max(light.rgb - uKeyColor * (1.0 - lit) * light.a, vec3(0.0)); }

// Diffuse light of the key light. Scattered light wraps around beyond the terminator.
float facing(Point p, vec3 l) {
  float wrap = 0.5 * p.scatter;
  return max(dot(p.soft, l) + wrap, 0.0) / ((1.0 + wrap) * (1.0 + wrap)) * mix(p.lit, 1.0, 0.5 * p.scatter);
}

// Block::around: the surface in an environment, without coat and emission.
vec3 around(Point p) {
  float roughness = widened(p.roughness, p.spread);
  float cosine = max(dot(p.n, p.v), 1e-3);
  vec2 ab = reflectance(roughness, cosine);
  float hidden = 1.0 - (1.0 - p.open) * (0.4 + 0.6 * roughness);
  float above = clamp(1.0 + 1.1 * dot(mirrored(p.n, p.v), p.shape), 0.0, 1.0);
  vec3 f0 = mix(p.f0, p.base, p.metal);
  vec3 once = f0 * ab.x + mix(p.f90, 1.0, p.metal) * ab.y;
  vec3 again = 1.0 + f0 * (1.0 / (ab.x + ab.y) - 1.0);
  vec3 diffuse = ambient(p.soft) * p.open + uKeyLight * facing(p, uKey);
  vec3 color = p.base * (1.0 - p.metal) * (1.0 - (p.f0 * ab.x + p.f90 * ab.y)) * diffuse;
  color += seen(gloss(p, roughness), p.lit) * once * again * hidden * above * above;
  float away = 1.0 - cosine;
  return color + p.sheen * away * away * (0.5 + 0.5 * p.base) * diffuse;
}

// Block::coated: light that a coat with this normal and roughness reflects, over the light below it.
vec3 coated(vec3 under, Point p, float coat, vec3 n, float roughness) {
  float through = coat * coat_reflectance(max(dot(n, p.v), 1e-3));
  return mix(under, seen(reflected(mirrored(n, p.v), widened(roughness, p.spread)), p.lit), through);
}

const vec3 FILL = vec3(0.73535, -0.37469, 0.56464);
const vec3 LAMP = vec3(2.35, 2.22, 2.05);

// Light::shade_along: the specular factor of a light.
float shine(Point p, vec3 l, vec2 w) {
  vec3 h = normalize(l + p.v);
  float nl = max(dot(p.n, l), 0.0), nh = max(dot(p.n, h), 0.0), nv = max(dot(p.n, p.v), 1e-3);
  vec3 d = vec3(dot(p.t, h) / w.x, dot(p.b, h) / w.y, nh);
  float rarity = w.x * w.y * dot(d, d) * dot(d, d);
  float smith = nl * length(vec3(w * vec2(dot(p.t, p.v), dot(p.b, p.v)), nv)) + nv * length(vec3(w * vec2(dot(p.t, l), dot(p.b, l)), nl));
  return nl * 0.5 / max(rarity * smith, 1e-6);
}

// Fresnel's term of a light.
vec3 fresnel(Point p, vec3 l, vec3 f0, float f90) { return f0 + (f90 - f0) * pow(max(1.0 - dot(normalize(l + p.v), p.v), 0.0), 5.0); }

// Pixel::finished: the surface under the lamp, with its coat and without emission. A larger lamp has a wider highlight.
vec3 under_lamp(Point p, float coat, vec3 coat_n, float coat_roughness) {
  float rough = clamp(p.roughness, 0.06, 1.0), a = rough * rough + 0.02 * max(uKeySize - 1.0, 0.0);
  vec2 w = widths(a, p.anisotropy), broad = widths(sqrt(min(4.0 * a * a + 0.1, 1.0)), p.anisotropy);
  float toward = dot(p.n.xy, uKey.xy);
  float sky = p.open * (0.16 + 0.1 * p.n.z + 0.1 * toward);
  vec3 diffuse = LAMP * facing(p, uKey) + 0.24 * max(dot(p.soft, FILL), 0.0) * p.open + sky;
  float key = (0.75 * shine(p, uKey, w) + 0.5 * shine(p, uKey, broad)) * p.lit;
  float fill = shine(p, FILL, w) * p.open * p.open;
  float mirror = p.open * max(0.25 + 1.2 * toward, 0.0) * (1.0 - 0.6 * rough);
  vec3 f0 = mix(p.f0, p.base, p.metal);
  float f90 = mix(p.f90, 1.0, p.metal);
  vec3 under = p.base * (1.0 - p.metal) * (1.0 - p.f0) * diffuse + LAMP * fresnel(p, uKey, f0, f90) * key + 0.24 * fresnel(p, FILL, f0, f90) * fill + f0 * mirror;
  float away = 1.0 - clamp(dot(p.n, p.v), 0.0, 1.0);
  under = under * (1.0 - 0.06 * coat) + p.sheen * away * away * (0.5 + 0.5 * p.base) * diffuse;
  float smooth_a = clamp(coat_roughness, 0.06, 1.0);
  smooth_a *= smooth_a;
  p.n = coat_n;
  p.t = normalize(p.t - coat_n * dot(coat_n, p.t));
  p.b = cross(coat_n, p.t);
  vec3 clear = LAMP * fresnel(p, uKey, vec3(0.04), 1.0) * shine(p, uKey, vec2(smooth_a)) * p.lit;
  clear += 0.24 * fresnel(p, FILL, vec3(0.04), 1.0) * shine(p, FILL, vec2(smooth_a)) * p.open * p.open;
  return under + coat * clear;
}`;
