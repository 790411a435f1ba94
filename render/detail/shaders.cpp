#include "render/detail/shaders.h"

namespace limber::render::detail {

// A list a pixel (or a sample) of what is drawn there half transparent: detail/layer_lists.h.
const char* const layer_lists = R"(
#ifdef FRAGMENT
struct Fragment { uint red_green, blue_alpha; float depth; uint next_samples; };
layout(std430, binding = 0) buffer Heads { uint count; uint heads[]; };   // 1 + the place of the last one put; 0: none
layout(std430, binding = 1) buffer Fragments { Fragment fragments[]; };
uniform int columns, first_row;  // of the lists
uint list(ivec2 place) { return uint((place.y - first_row) * columns + place.x); }
uint after(uint i) { return fragments[i - 1u].next_samples >> 4; }
bool covers(uint i, uint samples) { return (fragments[i - 1u].next_samples & samples) != 0u; }
void put(ivec2 where, uint samples, vec4 color, float depth) {
  uint place = atomicAdd(count, 1u);
  if (place >= uint(fragments.length())) return;
  uint next = atomicExchange(heads[list(where)], place + 1u);
  fragments[place] = Fragment(packHalf2x16(color.rg), packHalf2x16(color.ba), depth, next << 4 | samples);
}
#endif
)";

const char* const mesh_vertex_shader = R"(
layout(location = 0) in vec3 position_in;
layout(location = 1) in vec3 normal_in;
#ifdef TINTED
layout(location = 2) in vec4 tint_in;
#ifdef TRANSPARENT
centroid
#endif
out vec4 tint;
#endif
#ifdef PASSES
layout(location = 3) in float scalar_in;
out float scalar;
#endif
#ifdef GRAINED
layout(location = 4) in vec3 rest_in;
uniform float grains_a_metre;
out vec3 rest;                   // in wavelengths of the grain's texture
#endif
#if defined IMAGE || defined NORMAL_IMAGE
layout(location = 5) in vec2 uv_in;
out vec2 uv;
#endif
#ifdef CORNER_COLORS
layout(location = 6) in vec4 color_in;
out vec3 corner_color;
#endif
uniform mat4 clip_from_world;
uniform mat4 shadow_from_world;
uniform vec3 toward_key;
uniform float shadow_offset_m;   // along the normal: about a texel of the shadow map, or surfaces shade themselves
#if PLANES > 0
uniform vec4 planes[PLANES];     // what is below one is cut off
out float gl_ClipDistance[PLANES];
#endif
#ifdef TRANSPARENT
centroid
#endif
out vec3 position, normal, shadow_place;
void main() {
  position = position_in;
  normal = normal_in;
  // Towards the light's side, whichever way the mesh is wound.
  vec3 offset = shadow_offset_m * (dot(normal_in, toward_key) < 0.0 ? -normal_in : normal_in);
  shadow_place = (shadow_from_world * vec4(position_in + offset, 1.0)).xyz;
  gl_Position = clip_from_world * vec4(position_in, 1.0);
#ifdef TINTED
  tint = tint_in;
#endif
#ifdef PASSES
  scalar = scalar_in;
#endif
#ifdef GRAINED
  rest = grains_a_metre * rest_in;
#endif
#if defined IMAGE || defined NORMAL_IMAGE
  uv = uv_in;
#endif
#ifdef CORNER_COLORS
  corner_color = color_in.rgb;
#endif
#if PLANES > 0
  for (int i = 0; i < PLANES; ++i) gl_ClipDistance[i] = dot(planes[i], vec4(position_in, 1.0));
#endif
}
)";

// Key: Lambert and GGX with Schlick's approximations (Karis, SIGGRAPH 2013 course). Ambient: a sky above, the
// ground below.
const char* const mesh_fragment_shader = R"(
#ifdef TRANSPARENT
centroid                         // a pixel is shaded once, where the triangle covers it
#endif
in vec3 position, normal, shadow_place;
#ifdef TRANSPARENT
uniform float stand_back;        // as glPolygonOffset's factor
uniform mat4 clip_from_world;
// Of the centroid: beyond the triangle, a far side would come before its near one along an outline. Not handed over:
// what is noperspective is lost where Mesa 22.3 clips a triangle by several sides.
float depth() {
  vec4 clip = clip_from_world * vec4(position, 1.0);
  return 0.5 + 0.5 * clip.z / clip.w;
}
#endif
#ifdef TINTED
#ifdef TRANSPARENT
centroid
#endif
in vec4 tint;                    // colour, and the share of the sky that is open
#endif
#ifdef PAINTED
uniform vec3 paint;              // times the image and the corners' colours
vec3 albedo;
#elif defined TINTED
#define albedo tint.rgb
#else
uniform vec3 albedo;
#endif
#if defined IMAGE || defined NORMAL_IMAGE
in vec2 uv;
#endif
#ifdef IMAGE
uniform sampler2D image;
#endif
#ifdef NORMAL_IMAGE
uniform sampler2D normal_image;
#endif
#ifdef CORNER_COLORS
in vec3 corner_color;
#endif
#ifdef PASSES
in float scalar;
uniform int object;
layout(location = 1) out vec4 normal_scalar;
layout(location = 2) out int object_seen;
#endif
uniform vec3 eye, up, toward_key, toward_box;
uniform vec3 key_light, sky_light, ground_color;  // ground_color is black without a ground
uniform float ground_key;        // share of the key light that a level surface gets
uniform vec3 ground_x, ground_y;
uniform vec2 ground_lower, ground_scale;
uniform float ground_height;
uniform float faced_m;           // how far before a wall lies the ground that lights it
uniform float roughness, metallic, opacity, sheen;
uniform int sheet;
#ifdef GRAINED
in vec3 rest;
uniform sampler3D grain_map;     // slope of the relief along the three axes at rest, −1 … 1 as 0 … 1
uniform float grain;
#endif
#ifdef TRANSLUCENT
uniform float translucency;
uniform vec3 scatter;            // depths of the map by which each colour falls to 1/e
uniform float scatter_radius;    // the same depth across, in units of the map
uniform sampler2D entry_depth;   // where the key light first meets anything
#endif
uniform mat3 shadow_from_normal;
uniform float shadow_softness, min_shadow, max_shadow;  // radius of the half-shade, in units of the map: for each unit of depth; limits
uniform sampler2DShadow shadow_map;
uniform sampler2D shadow_depth;  // the same, not compared
uniform sampler2D ground_sky_map;
#ifndef TRANSPARENT
layout(location = 0) out vec4 color;
#elif SAMPLES_A_LIST == 1
layout(early_fragment_tests) in;
#else
uniform SAMPLER opaque_depth;

// Of the samples of this pixel that the triangle covers those that nothing opaque hides.
uint seen() {
  vec2 slope = vec2(dFdx(gl_FragCoord.z), dFdy(gl_FragCoord.z));
  uint covered = uint(gl_SampleMaskIn[0]), result = 0u;
  for (int i = 0; i < 4; ++i) {
    float place = gl_FragCoord.z + dot(slope, DEPTH_PLACE(i)), opaque = FETCH(opaque_depth, ivec2(gl_FragCoord.xy), DEPTH_SAMPLE(i)).r;
    if ((covered >> i & 1u) != 0u && place < opaque) result |= 1u << DEPTH_SAMPLE(i);
  }
  return result;
}
#endif

// Four samples that are shaded side by side, 2 × 2, share what each has looked up, since lights and shadows are blurred
// (Penner, Shader Amortization using Pixel Quad Message Passing, GPU Pro 2, 2011). Of two samples a pixel's side they are
// one pixel. Where a triangle covers less than four, its plane goes on.
int of_four() { return int(gl_FragCoord.x) & 1 | (int(gl_FragCoord.y) & 1) << 1; }
vec2 mean_of_four(vec2 own) {
  vec2 to_middle = 0.5 - vec2(ivec2(gl_FragCoord.xy) & 1);
  own += to_middle.x * dFdxFine(own);
  return own + to_middle.y * dFdyFine(own);
}
// A direction for each four: Jimenez' interleaved gradient noise (2014), once round a diamond.
vec2 around() {
  float turn = 4.0 * fract(52.9829189 * fract(dot(floor(0.5 * gl_FragCoord.xy), vec2(0.06711056, 0.00583715))));
  return normalize(vec2(abs(turn - 2.0) - 1.0, 1.0 - abs(abs(turn - 1.0) - 2.0)));
}

// Of four samples the k-th has the looks k, k + 4, … of a spiral: its first direction, and by golden4 the next.
const mat2 golden = mat2(-0.73736888, 0.67549029, -0.67549029, -0.73736888);  // a turn by the golden angle
const mat2 golden2 = golden * golden, golden4 = golden2 * golden2;
vec2 turned_by_own(vec2 along) {
  int own = of_four();
  if ((own & 1) != 0) along = golden * along;
  if ((own & 2) != 0) along = golden2 * along;
  return along;
}

#ifdef TRANSPARENT
// Four bilinear taps: 4 × 4 texels, of even weight but for a soft rim. A transparent surface has many layers, and shadows on it are faint.
float key_visibility(vec3 n) {
  float sum = 0.0;
  for (int y = -1; y <= 1; y += 2)
    for (int x = -1; x <= 1; x += 2)
      sum += texture(shadow_map, vec3(shadow_place.xy + 0.6 * min_shadow * vec2(x, y), shadow_place.z));
  return 0.25 * sum;
}
#else
// Percentage-closer soft shadows (Fernando 2005): what hides the light near this place, by how far it is away, says over
// which disc to ask. The disc lies in the tangent plane, or a slanting surface would shade itself; its taps are on
// Vogel's spiral, one after the other to the four samples that share them, turned from four to four.
float key_visibility(vec3 n) {
  const int searching = 3, taps = 4;  // of each of the four
  vec3 s = shadow_from_normal * n;
  vec2 slope = -s.xy / min(s.z, -0.15 * length(s));
  slope *= min(1.0, 6.0 / max(length(slope), 1e-6));
  int own = of_four();
  vec2 along = turned_by_own(around());
  vec2 first = along;
  float search = clamp(shadow_softness * shadow_place.z, min_shadow, max_shadow);
  vec2 above = vec2(0.0);  // how high what blocks the light is, summed, and how often something does
  for (int i = 0; i < searching; ++i) {
    vec2 way = search * sqrt((float(4 * i + own) + 0.5) / float(4 * searching)) * along;
    float height = shadow_place.z + dot(slope, way) - texture(shadow_depth, shadow_place.xy + way).r;
    above += step(0.0, height) * vec2(height, 1.0);
    along = golden4 * along;
  }
  above = mean_of_four(above);
  float radius = clamp(shadow_softness * above.x / max(above.y, 0.25), min_shadow, max_shadow), sum = 0.0;
  along = first;
  for (int i = 0; i < taps; ++i) {
    vec2 way = radius * sqrt((float(4 * i + own) + 0.5) / float(4 * taps)) * along;
    sum += texture(shadow_map, vec3(shadow_place.xy + way, shadow_place.z + dot(slope, way)));
    along = golden4 * along;
  }
  return mean_of_four(vec2(sum)).x / float(taps);
}
#endif

#ifdef NORMAL_IMAGE
// The frame of the image on the surface from screen derivatives (Schüler, Normal mapping without precomputed tangents,
// ShaderX5, 2006): across is the way in which u grows and v does not.
vec3 bent_by_image(vec3 n) {
  vec3 across = dFdx(position), upward = dFdy(position);
  vec2 uv_across = dFdx(uv), uv_upward = dFdy(uv);
  vec3 a = cross(upward, n), b = cross(n, across);
  float side = dot(across, a) < 0.0 ? -1.0 : 1.0;
  vec3 along_u = side * (a * uv_across.x + b * uv_upward.x), along_v = side * (a * uv_across.y + b * uv_upward.y);
  float scale = inversesqrt(max(max(dot(along_u, along_u), dot(along_v, along_v)), 1e-30));
  vec3 m = 2.0 * texture(normal_image, uv).xyz - 1.0;
  m.xy *= gl_FrontFacing ? scale : -scale;
  return normalize(m.x * along_u + m.y * along_v + max(m.z, 0.05) * n);
}
#endif

#ifdef GRAINED
// Bump mapping unparametrized surfaces on the GPU (Mikkelsen 2010), its heights' derivatives by the chain rule.
vec3 bent(vec3 n) {
  vec3 slope = grain * (2.0 * texture(grain_map, rest).xyz - 256.0 / 255.0);
  vec3 across = dFdx(position), upward = dFdy(position);
  vec3 a = cross(upward, n), b = cross(n, across);
  float area = dot(across, a);
  // Heights are in wavelengths, as the places at rest are; a stretched body's slopes fall with its stretch.
  vec3 gradient = dot(slope, dFdx(rest)) * a + dot(slope, dFdy(rest)) * b;
  float scale = max(length(dFdx(rest)) / max(length(across), 1e-12), length(dFdy(rest)) / max(length(upward), 1e-12));
  return normalize(abs(area) * n - (sign(area) / max(scale, 1e-12)) * gradient);
}
#endif

void main() {
  vec3 n = normalize(normal) * (gl_FrontFacing ? 1.0 : -1.0);
  vec3 smooth_n = n;
#ifdef PAINTED
  albedo = paint;
#endif
#ifdef IMAGE
  albedo *= texture(image, uv).rgb;
#endif
#ifdef CORNER_COLORS
  albedo *= corner_color;
#endif
#ifdef NORMAL_IMAGE
  n = bent_by_image(n);
#endif
#ifdef GRAINED
  n = bent(n);
#endif
  vec3 v = normalize(eye - position);
  vec3 h = normalize(toward_key + v);
  float n_key = max(dot(n, toward_key), 0.0);
  float n_v = max(dot(n, v), 1e-3);
  float n_h = max(dot(n, h), 0.0);
  float v_h = max(dot(v, h), 0.0);

  vec3 diffuse = albedo * (1.0 - metallic);
  vec3 f0 = mix(vec3(0.04), albedo, metallic);
  float a2 = roughness * roughness * roughness * roughness;
  float d = n_h * n_h * (a2 - 1.0) + 1.0;
  float k = (roughness + 1.0) * (roughness + 1.0) / 8.0;
  float visibility = 0.25 / ((n_key * (1.0 - k) + k) * (n_v * (1.0 - k) + k));
  float grazing = 1.0 - v_h;
  float grazing2 = grazing * grazing;
  vec3 fresnel = f0 + (1.0 - f0) * (grazing2 * grazing2 * grazing);
  vec3 key = (diffuse + fresnel * (a2 / (d * d) * visibility)) * (n_key * key_visibility(smooth_n)) * key_light;
#ifdef TRANSLUCENT
  // Thickness by the first surface that the light meets (Green, GPU Gems 16); what comes out does so on all sides, most
  // where the light grazes. A colour that the material holds back gets less far.
  // Light spreads sideways as far as it gets, so the mean over a disc counts.
  const int depths = 3;  // of each of the four
  vec2 aside = turned_by_own(around());
  vec3 through = vec3(0.0);
  for (int i = 0; i < depths; ++i) {
    vec2 way = scatter_radius * sqrt((float(4 * i + of_four()) + 0.5) / float(4 * depths)) * aside;
    float thickness = max(shadow_place.z - texture(entry_depth, shadow_place.xy + way).r, 0.0);
    through += exp2(-1.442695 * thickness / scatter) / float(depths);
    aside = golden4 * aside;
  }
  through = vec3(mean_of_four(through.rg), mean_of_four(through.bb).x);
  key += (0.5 * translucency * smoothstep(0.55, -0.35, dot(smooth_n, toward_key))) * diffuse * through * key_light;
#endif

  float n_up = dot(n, up);
  // The ground that a surface faces lights it less where it is itself in the dark, as under a body; from higher up one sees
  // more of the ground, and the dark counts less.
  vec3 faced = position + faced_m * n;
  vec2 ground_place = (vec2(dot(ground_x, faced), dot(ground_y, faced)) - ground_lower) * ground_scale;
  float nearness = exp2(-max(dot(up, position) - ground_height, 0.0) / (1.5 * faced_m));
  float open = 1.0 - nearness * texture(ground_sky_map, ground_place).r;
  vec3 bounce = ground_color * (0.9 * ground_key * key_light + 0.9 * sky_light) * open;
  vec3 ambient = diffuse * mix(bounce, sky_light, 0.5 + 0.5 * n_up);
  // What is mirrored: ground, a sky that is brighter towards the horizon, and a soft box opposite the key light; the rougher, the
  // more blurred.
  vec3 r = 2.0 * dot(n, v) * n - v;
  float r_up = dot(r, up), blur = 0.1 + 0.7 * roughness;
  vec3 mirrored = mix(bounce, sky_light * (1.6 - 0.6 * max(r_up, 0.0)), smoothstep(-blur, blur, r_up));
  mirrored += sky_light * (2.0 / (1.0 + 4.0 * roughness)) * smoothstep(0.88 - 0.8 * blur, 0.92 + 0.08 * blur, dot(r, toward_box));
  // Split sum of the environment's reflection, fitted by Karis (Physically based shading on mobile, 2014).
  vec4 k4 = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
  float a = min(k4.x * k4.x, exp2(-9.28 * n_v)) * k4.x + k4.y;
  vec2 ab = vec2(-1.04, 1.04) * a + k4.zw;
  vec3 glossy = mirrored * (f0 * ab.x + ab.y);

  float edge = 1.0 - n_v;
  vec3 rim = sky_light * ((0.55 + 1.2 * sheen) * edge * edge * edge * (0.5 + 0.5 * n_up)) * (0.4 + 0.6 * albedo);
#ifdef TINTED
  // What hides the sky sends some light itself, the more the lighter it is (Jimenez et al., Practical Realtime Strategies
  // for Accurate Indirect Occlusion, 2016, eq. 10).
  float sky = tint.a;
  vec3 open_sky = max(vec3(sky), ((sky * (2.0404 * albedo - 0.3324) + (0.6417 - 4.7951 * albedo)) * sky + (2.7552 * albedo + 0.6903)) * sky);
  ambient *= open_sky;
  // Of a narrow lobe a crevice hides more, the more so towards grazing angles (Lagarde and de Rousiers, Moving Frostbite to PBR,
  // 2014, listing 26).
  float open_glossy = clamp(pow(n_v + sky, exp2(-16.0 * roughness - 1.0)) - 1.0 + sky, 0.0, 1.0);
  glossy *= open_glossy;
  rim *= sky * sky;
#endif
  vec3 light = key + ambient + glossy + rim;
#ifdef FLAT_INSIDE
  if (!gl_FrontFacing) light = 0.5 * albedo * (sky_light + 0.5 * key_light);
#endif
#ifdef TRANSPARENT
  float covered = sheet == 1 ? 1.0 - pow(1.0 - opacity, 1.0 / n_v) : opacity;  // Beer and Lambert
#if SAMPLES_A_LIST == 1
  put(ivec2(gl_FragCoord.xy), 1u, vec4(light * covered, covered), gl_FragCoord.z);
#else
  uint samples = seen();
  if (samples != 0u) put(ivec2(gl_FragCoord.xy), samples, vec4(light * covered, covered), depth() + stand_back * fwidth(gl_FragCoord.z));
#endif
#else
  color = vec4(light, 1.0);
#endif
#ifdef PASSES
  normal_scalar = vec4(n, scalar);
  object_seen = object;
#endif
}
)";

const char* const depth_vertex_shader = R"(
layout(location = 0) in vec3 position_in;
uniform mat4 clip_from_world;
#if PLANES > 0
uniform vec4 planes[PLANES];
out float gl_ClipDistance[PLANES];
#endif
void main() {
  gl_Position = clip_from_world * vec4(position_in, 1.0);
#if PLANES > 0
  for (int i = 0; i < PLANES; ++i) gl_ClipDistance[i] = dot(planes[i], vec4(position_in, 1.0));
#endif
}
)";
const char* const depth_fragment_shader = "void main() {}";

// The list is walked for the nearest four of those not shown yet, kept in order of depth, until none is left.
// Of equal depth, what was put later is in front: a list begins with the last.
const char* const layers_fragment_shader = R"(
out vec4 color;
void main() {
  uint head = heads[list(LIST)];
  if (head == 0u) discard;
  color = vec4(0.0);
  float shown_depth = -1.0;
  uint shown = head + 1u;
  for (;;) {
    vec4 depths = vec4(2.0);
    uvec4 nearest = uvec4(0u);
    for (uint i = head; i != 0u;) {
      uint next = fragments[i - 1u].next_samples;
      float depth = fragments[i - 1u].depth;
      bool left = depth > shown_depth || (depth == shown_depth && i < shown);
      if ((next & SAMPLE) == 0u || !left) depth = 2.0;
      bvec4 behind = lessThan(vec4(depth), depths);
      depths = vec4(behind.x ? depth : depths.x, behind.x ? depths.x : behind.y ? depth : depths.y,
                    behind.y ? depths.y : behind.z ? depth : depths.z, behind.z ? depths.z : behind.w ? depth : depths.w);
      nearest = uvec4(behind.x ? i : nearest.x, behind.x ? nearest.x : behind.y ? i : nearest.y,
                      behind.y ? nearest.y : behind.z ? i : nearest.z, behind.z ? nearest.z : behind.w ? i : nearest.w);
      i = next >> 4;
    }
    for (; nearest.x != 0u; nearest = uvec4(nearest.yzw, 0u)) {
      uvec2 halves = uvec2(fragments[nearest.x - 1u].red_green, fragments[nearest.x - 1u].blue_alpha);
      color += (1.0 - color.a) * vec4(unpackHalf2x16(halves.x), unpackHalf2x16(halves.y));
      shown = nearest.x;
    }
    if (depths.w == 2.0) break;
    shown_depth = depths.w;
  }
}
)";

const char* const line_vertex_shader = R"(
layout(location = 0) in vec4 clip_in;
layout(location = 1) in float across_in;  // distance from the middle, in samples; not bent by perspective
noperspective out float across;
void main() { across = across_in; gl_Position = clip_in; }
)";
const char* const line_fragment_shader = R"(
noperspective in float across;
uniform vec4 line_color;    // straight
uniform float half_width;   // samples
#ifdef TRANSPARENT
layout(early_fragment_tests) in;
uniform int putting;        // 1: what lies before a transparent surface is put into its list; 0: the rest is drawn
#endif
out vec4 color;
void main() {
  float cover = line_color.a * clamp(half_width + 0.5 - abs(across), 0.0, 1.0);
  color = vec4(line_color.rgb * cover, cover);
#ifdef TRANSPARENT
  // Just before the nearest transparent surface behind it. Lines that are there already have the depth of their transparent surface.
  float behind = 2.0;
  for (uint i = heads[list(LIST)]; i != 0u; i = after(i))
    if (covers(i, SAMPLE) && fragments[i - 1u].depth > gl_FragCoord.z) behind = min(behind, fragments[i - 1u].depth);
  if (putting == 1 && behind < 2.0 && cover > 0.0) put(LIST, SAMPLE, color, behind);
  if (behind < 2.0) color = vec4(0.0);
#endif
}
)";

const char* const whole_picture_vertex_shader = R"(
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }
)";

// Of each pixel the sample nearest to the eye.
const char* const passes_fragment_shader = R"(
uniform SAMPLER samples_depth, normal_scalar;
uniform INTEGER_SAMPLER object;
uniform int last_row;
layout(location = 0) out vec4 pixel_normal_scalar;
layout(location = 1) out float pixel_depth;
layout(location = 2) out int pixel_object;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.x, last_row - int(gl_FragCoord.y));
  int nearest = 0;
  pixel_depth = 1.0;
  for (int i = 0; i < SAMPLES; ++i) {
    float depth = FETCH(samples_depth, pixel, i).r;
    if (depth < pixel_depth) nearest = i;
    pixel_depth = min(pixel_depth, depth);
  }
  pixel_normal_scalar = FETCH(normal_scalar, pixel, nearest);
  pixel_object = FETCH(object, pixel, nearest).r;
}
)";

}  // namespace limber::render::detail
